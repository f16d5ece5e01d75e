"""The section, the fit, and the command on a walk that is known to settle."""

from __future__ import annotations

import json
from functools import partial

import numpy as np
import pytest

from biped.base.errors import InputError, RunError
from biped.cli.main import main
from biped.ensemble.campaign import simulate
from biped.ensemble.executor import mapped
from biped.robot.planar.tree import motion
from biped.studies.run import plan_of
from biped.studies.stability import basin as basin_module
from biped.studies.stability import study, word_for
from biped.studies.stability.basin import SIZES, Shrinking, floor
from biped.studies.stability.cycle import Returns, fit_map
from biped.studies.stability.orbit import Exponent, Orbit, find_orbit, growth
from biped.studies.stability.section import Kicks, PoincareSection, Steady, crossings

SLOW = "level_slow_generalized"


@pytest.fixture(scope="module")
def walk():
    run = plan_of(SLOW, ["duration=14.0", "window.end=14.0"]).run(0)
    t = simulate(run)
    section = PoincareSection(run, t.tree)
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


def test_kicks_leave_what_stands_where_it_is(walk):
    """By forward kinematics alone: the standing foot does not move, the swinging heel stays on the section."""
    t, section, found = walk
    state = section.states(found)[4]
    kicks = Kicks(section, state)
    rng = np.random.default_rng(0)
    moved = np.array([kicks.random(0.01, rng) for _ in range(300)])
    assert ((moved - state) @ kicks.basis).std(axis=0) == pytest.approx(0.01, rel=0.2)
    # Off the tangent plane only by what its curvature makes of kicks of this size.
    assert np.linalg.norm((moved - state) @ (np.eye(17) - kicks.basis @ kicks.basis.T), axis=1).max() < 0.01
    whole, plain = section.whole(moved), section.whole(state)
    now, before = (motion(t.tree, w[..., :9], w[..., 9:]) for w in (whole, plain))
    left = slice(2, 4)
    assert before.point[left, 1].max() < 5e-4, "the left foot stands"
    assert np.abs(now.point[:, left, 1] - before.point[left, 1]).max() < 1e-11
    assert np.abs(now.point_velocity[:, left] - before.point_velocity[left]).max() < 1e-10
    assert np.abs(now.point[:, 1, 1] - before.point[1, 1]).max() < 1e-11


def test_lean_and_speed_are_what_is_asked_for(walk):
    _, section, found = walk
    kicks = Kicks(section, section.states(found)[4])
    change = section.whole(kicks.moved(0.2, 0.3)) - section.whole(kicks.z)
    assert change[2] == pytest.approx(-0.2, abs=1e-9), "pitch counts backwards"
    assert change[9] == pytest.approx(0.3, abs=1e-9)
    legs = change[2] + np.cumsum(change[3:6])
    assert np.abs(legs).max() < 0.05, "the legs stay where they are"


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
    with pytest.raises(RunError, match=r"mujoco, 1 ms: no steady gait.*mujoco, 0.5 ms: no steady gait"):
        study(SLOW, ["controller=style", "gains.k_d1=0.0", "gains.b_d1=0.0"], ["mujoco"])


@pytest.mark.parametrize(
    "argv",
    [
        ["stability"],
        ["stability", SLOW, "--reference"],
        ["stability", "no_such"],
        ["stability", SLOW, "--engine", "moon"],
    ],
)
def test_bad_calls(argv, capsys):
    assert main(argv) == 2
    answer = capsys.readouterr()
    assert answer.out == ""
    assert answer.err.startswith("biped: ")


@pytest.mark.parametrize(
    ("scenario", "changes", "words"),
    [
        (SLOW, ["ground.tiles.height=0.01"], r"ground: expected neither tiles nor steps: strides return"),
        (SLOW, ["ground.steps.rise=0.01"], r"ground: expected neither tiles nor steps"),
        ("any/walker2d", [], r"expected a planar biped of seven links for this, got 'walker2d'"),
    ],
)  # fmt: skip
def test_starts_are_on_level_ground_and_of_seven_links(scenario, changes, words):
    with pytest.raises(InputError, match=words):
        study(scenario, changes)


def test_reference_command(capsys):
    assert main(["stability", "--reference", "--json"]) == 0
    cycles = json.loads(capsys.readouterr().out)
    assert cycles["rimless wheel"]["stable"]
    assert not cycles["simplest walker, short period"]["stable"]
    assert main(["stability", "--reference"]) == 0
    assert "long period" in capsys.readouterr().out


def henon(z: np.ndarray) -> np.ndarray:
    return np.array([1.0 - 1.4 * z[0] ** 2 + z[1], 0.3 * z[0]])


def test_growth_is_the_exponent_of_known_maps():
    """Linear: the largest multiplier's logarithm. Hénon's map: 0.4192 per return (Sprott, Chaos and Time-Series)."""
    linear = np.diag([0.7, 0.2])
    start = np.array([1.0, -2.0])
    rates = growth(lambda z: linear @ z, start, start + 1e-8 / np.sqrt(2.0), 60)
    assert rates[30:] == pytest.approx(np.log(0.7), abs=1e-6)
    start = np.array([0.1, 0.1])
    assert growth(henon, start, start + 1e-9, 20000)[100:].mean() == pytest.approx(0.4192, abs=0.01)


def test_floor_is_where_kicks_neither_grow_nor_shrink():
    def rows(f):
        return [Shrinking(size, [size, size, f(size)], 0, 1) for size in SIZES]

    assert floor(rows(lambda d: 0.5 * d)) == 0.0
    assert floor(rows(lambda d: 2.0 * d)) is None
    assert floor(rows(lambda _: 5e-3)) == pytest.approx(5e-3, rel=1e-9), "what always ends at one distance"
    assert floor(rows(lambda d: 1e-2 if d < 0.05 else np.nan)) == pytest.approx(1e-2), "falls have no distance"


@pytest.mark.parametrize(
    ("returns", "value", "word"),
    [(1, -0.5, "stable limit cycle"), (3, -0.5, "stable cycle of 3"), (None, -0.5, "no cycle"), (1, 0.5, "chaotic"),
     (1, 0.05, "undecided")],
)  # fmt: skip
def test_words_follow_the_numbers(returns, value, word):
    orbit = Orbit(returns, 0.0, np.zeros(17), None)
    assert word in word_for(orbit, Exponent(value, 0.1, False, 0))


def test_basin_knows_the_gait_and_a_fall(walk, monkeypatch):
    _, section, found = walk
    monkeypatch.setattr(basin_module, "LEAN", (0.0, 1.2))
    monkeypatch.setattr(basin_module, "SPEED", (0.0,))
    gait = Steady(section, section.states(found)[4:], np.array([1.588]), 0, 1)
    cut = basin_module.basin_slice(gait, np.random.default_rng(0), partial(mapped, jobs=1))
    assert cut.counts["returned"] == [[2], [0]], "unchanged strides are the gait"
    assert cut.counts["fell"] == [[0], [2]], "69 degrees of lean is a fall"


def test_answers_do_not_depend_on_the_number_of_jobs():
    assert mapped(lambda x: x**2, range(7), 2) == mapped(lambda x: x**2, range(7), 1) == [x**2 for x in range(7)]


def test_slow_gait_is_a_limit_cycle(walk):
    """Newton's fixed point returns to itself, and its largest multiplier is what neighbours do in Benettin's method."""
    _, section, found = walk
    orbit = find_orbit(section, section.states(found)[-1], 1.588)
    assert orbit.returns == 1
    assert orbit.cycle is not None
    assert orbit.cycle.stable
    z = orbit.state
    assert np.abs(section.returned(z, 1.588) - z).max() < 1e-9
    kicks = Kicks(section, z)
    rates = growth(lambda at: section.returned(at, 1.588), z, kicks.along(np.ones(kicks.basis.shape[1]), 1e-8), 10)
    assert rates[4:] == pytest.approx(np.log(abs(orbit.cycle.multipliers[0])), abs=1e-4)


@pytest.mark.slow
def test_slow_gait_is_stable_in_both_engines_at_both_steps(tmp_path, capsys):
    assert main(["stability", SLOW, "--basin", "--out", str(tmp_path), "--json"]) == 0
    result = json.loads(capsys.readouterr().out)
    assert result == json.loads((tmp_path / "stability.json").read_text(encoding="utf-8"))
    for name in ("stability.png", "basin.png"):
        assert (tmp_path / name).stat().st_size > 5000
    assert [gait["engine"] for gait in result["gaits"]] == ["mujoco", "mujoco", "home", "home"]
    for gait in result["gaits"]:
        assert gait["kind"].startswith("stable"), gait
        assert gait["exponent"]["value"] + gait["exponent"]["half_width"] < 0.0
        assert gait["fit"]["interval"][1] < 0.5
