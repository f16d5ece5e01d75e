"""The section, the fit, and the command on a walk that is known to settle."""

from __future__ import annotations

import json

import numpy as np
import pytest

from biped.campaign import simulate
from biped.cli import main
from biped.commands import plan_of
from biped.errors import RunError
from biped.geometry import motion
from biped.stability.fit import Returns, fit_map
from biped.stability.section import Section, crossings
from biped.stability.study import study

SLOW = "level_slow_generalized"


@pytest.fixture(scope="module")
def walk():
    run = plan_of(SLOW, ["duration=14.0", "window.end=14.0"]).run(0)
    t = simulate(run)
    section = Section(run, t.tree)
    return t, section, crossings(t, section.height)


def test_crossings_are_on_the_section(walk):
    t, section, found = walk
    heel = motion(t.tree, found.q, found.v)
    assert len(found.time) >= 6
    # The chord between two ticks is off the path by at most its sagitta, a dt² / 8 with a below 200 m/s².
    assert heel.point[:, 1, 1] == pytest.approx(section.height, abs=2.5e-5)
    assert (heel.point_velocity[:, 1, 1] < 0).all(), "the heel comes down"
    assert (found.q[:, 3] > found.q[:, 6] + 0.3).all(), "the right leg is ahead"
    assert np.diff(found.time) == pytest.approx(1.589, rel=0.1), "once a stride"


def test_walk_from_the_section_is_the_walk_itself(walk):
    """(q, v) on the section is all there is to know in generalized mode: a fresh start goes where the walk went."""
    _, section, found = walk
    states = section.states(found)
    for k in (3, 5):
        t, after = section.walk(states[k], 2.0)
        assert t.end == "completed"
        assert len(after) == 1, "the start itself is no crossing"
        # Ticks fall elsewhere between crossings, which moves switches by up to a tick: 1 ms of motion at 1 rad/s.
        assert np.linalg.norm(after[0] - states[k + 1]) < 0.02
        assert np.linalg.norm(after[0] - states[k + 1]) < 0.1 * np.linalg.norm(states[k] - states[0]) + 0.02


def test_section_does_not_know_how_far_the_walk_has_come(walk):
    _, section, found = walk
    moved = found._replace(q=found.q + np.array([7.0, *[0.0] * 8]))
    assert np.array_equal(section.states(moved), section.states(found))


def test_kicks_have_their_size_and_keep_the_feet_on_the_ground(walk):
    t, section, found = walk
    state = section.states(found)[4]
    rng = np.random.default_rng(0)
    kicks = np.array([section.kicked(state, 0.01, rng) - state for _ in range(400)])
    assert kicks[:, 1:].std(axis=0) == pytest.approx(0.01, rel=0.15)
    whole = np.hstack([np.zeros((400, 1)), kicks + state]) * section._unit
    lowest = motion(t.tree, whole[:, :9], whole[:, 9:]).point[..., 1].min(axis=1)
    assert np.abs(lowest).max() < 1e-12


def scattered(matrix, noise: float, rng, walks: int = 150, length: int = 3) -> Returns:
    """Returns of a linear map with additive noise, in the first directions of 17."""
    r = len(matrix)
    before, after = np.zeros((walks, length, 17)), np.zeros((walks, length, 17))
    for w in range(walks):
        x = rng.standard_normal(r)
        for k in range(length):
            y = matrix @ x + noise * rng.standard_normal(r)
            before[w, k, :r], after[w, k, :r] = x, y
            x = y
    return Returns(before.reshape(-1, 17) + 3.0, after.reshape(-1, 17) + 3.0, np.repeat(np.arange(walks), length))


MATRIX = np.array([[0.5, -0.4, 0.0], [0.4, 0.5, 0.1], [0.0, 0.0, -0.3]])


def test_fit_finds_a_map_without_noise():
    fit = fit_map(scattered(MATRIX, 0.0, np.random.default_rng(1)), np.random.default_rng(2))
    assert fit.multipliers == pytest.approx([0.5 + 0.4j, 0.5 - 0.4j, -0.3], abs=1e-10)
    assert fit.explained == pytest.approx(1.0)
    assert np.ptp(fit.interval) < 1e-10


def test_interval_of_the_fit_holds_the_truth_as_often_as_it_says():
    rng = np.random.default_rng(3)
    truth = abs(0.5 + 0.4j)
    fits = [fit_map(scattered(MATRIX, 0.5, rng), rng) for _ in range(60)]
    hits = sum(low <= truth <= high for low, high in (fit.interval for fit in fits))
    assert hits >= 50, "95 % of 60 are 57; fewer than 50 come by chance less than once in 1000"
    assert all(0.01 < np.ptp(fit.interval) < 0.4 for fit in fits)


def test_unstable_map_is_not_called_stable():
    fit = fit_map(scattered(np.diag([1.3, 0.2]), 0.3, np.random.default_rng(4)), np.random.default_rng(5))
    assert fit.interval[0] > 1.0


def test_what_does_not_walk_has_no_gait():
    with pytest.raises(RunError, match="no steady gait"):
        study(SLOW, ["controller=style", "gains.k_d1=0.0", "gains.b_d1=0.0"])


@pytest.mark.parametrize("argv", [["stability"], ["stability", SLOW, "--reference"], ["stability", "no_such"]])
def test_bad_calls(argv, capsys):
    assert main(argv) == 2
    answer = capsys.readouterr()
    assert answer.out == ""
    assert answer.err.startswith("biped: ")


def test_reference_command(capsys):
    assert main(["stability", "--reference", "--json"]) == 0
    cycles = json.loads(capsys.readouterr().out)
    assert cycles["rimless wheel"]["stable"]
    assert not cycles["simplest walker, short period"]["stable"]
    assert main(["stability", "--reference"]) == 0
    assert "long period" in capsys.readouterr().out


@pytest.mark.slow
def test_slow_gait_is_stable_at_both_steps(tmp_path, capsys):
    assert main(["stability", SLOW, "--out", str(tmp_path), "--json"]) == 0
    result = json.loads(capsys.readouterr().out)
    assert result == json.loads((tmp_path / "stability.json").read_text(encoding="utf-8"))
    assert (tmp_path / "stability.png").stat().st_size > 5000
    radii = [row["radius"] for row in result["fits"]]
    assert max(radii) < 0.6
    assert all(row["interval"][0] <= row["radius"] * 1.05 for row in result["fits"])
