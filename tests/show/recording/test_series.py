"""Curves and lanes of a recording: every tick of the trajectory, or its mean."""

import dataclasses

import numpy as np
import pytest

from biped.robot.ground import GRAVITY
from biped.show.recording import record
from tests.show.recording.pushed import ROOT, nanoseconds
from tests.show.recordings import SLOPE, read, recorded


def test_curves_are_the_trajectorys(path, run):
    t = run.trajectory
    rows = np.arange(len(t))
    expected = {
        "velocity": t.v[:, :1], "angle": np.degrees(t.q[:, 3:]), "torque": t.u, "power": t.u * t.v[:, 3:],
        "torso": np.degrees(t.q[:, 2:3]) + 90.0 + SLOPE,
        "force": np.stack([t.force[:, :2, 2].sum(axis=1), t.force[:, 2:, 2].sum(axis=1)], axis=1),
    }  # fmt: skip
    for entity, values in expected.items():
        temporal, static = read(path, f"{ROOT}/series/{entity}")
        time, scalars = temporal["Scalars:scalars"]
        assert np.array_equal(time, nanoseconds(t, rows)), entity
        np.testing.assert_allclose(np.array(scalars), values[rows], rtol=1e-12, atol=1e-12, err_msg=entity)
        assert len(static["SeriesLines:names"]) == values.shape[1]
        assert static["SeriesLines:aggregation_policy"] == [2]  # the viewer averages what is too dense


def test_curves_of_a_faster_controller_are_means_not_samples(run, tmp_path):
    """A foot that is loaded every other tick weighs half, whichever tick is looked at first."""
    log = run.trajectory.log[:400].copy()
    t = dataclasses.replace(run.trajectory, log=log, tick=0.0005)
    t.column("force")[:] = 0.0
    t.column("force")[::2, 1, 1] = 1500.0
    record(tmp_path / "fast.rrd", [run._replace(trajectory=t)], title="fast")
    _, force = read(tmp_path / "fast.rrd", f"{ROOT}/series/force")[0]["Scalars:scalars"]
    assert force == [[750.0, 0.0]] * 200


def test_cost_of_transport_ends_at_the_net_cost_and_begins_after_half_a_metre(tmp_path):
    run = recorded("level", ["duration=3.0", "window.start=1.0", "window.end=3.0"])
    t = run.trajectory
    record(tmp_path / "cost.rrd", [run], title="cost")
    temporal, _ = read(tmp_path / "cost.rrd", "/level/series/cost")
    time, cost = temporal["Scalars:scalars"]
    row = np.round(time / 1e6).astype(int)
    assert t.q[row[0], 0] - t.q[0, 0] == pytest.approx(0.5, abs=0.01)
    last = row[-1]
    mean = (t.v[:last, 3:] + t.v[1 : last + 1, 3:]) / 2.0
    work = np.abs((t.u[:last] * mean).sum(axis=1)).sum() * t.tick
    assert cost[-1][0] == pytest.approx(work / (75.0 * GRAVITY * (t.q[last, 0] - t.q[0, 0])), rel=1e-9)


@pytest.mark.parametrize(("lane", "column"), [("states/right\\ leg", 0), ("states/left\\ leg", 1)])
def test_leg_states_can_be_rebuilt_from_their_changes(path, run, lane, column):
    t = run.trajectory
    temporal, static = read(path, f"{ROOT}/{lane}")
    time, states = temporal["StateChange:state"]
    assert states[-1] == ["-"]  # a gap after the end
    rows = np.round(time[:-1] / 1e6).astype(int)
    rebuilt = np.repeat([int(s[0]) for s in states[:-1]], np.diff(np.append(rows, len(t))))
    assert np.array_equal(rebuilt, t.phase[:, column])
    visible = dict(zip(static["StateConfiguration:values"], static["StateConfiguration:visible"], strict=True))
    assert visible == {"1": True, "2": True, "3": True, "4": True, "-": False}


@pytest.mark.parametrize(
    ("lane", "source", "column"),
    [
        ("states/left\\ leg\\,\\ heel", "believed", 3),
        ("states/right\\ leg\\,\\ toe", "believed", 0),
        ("constraints/left\\ knee", "active", 5),
    ],
)
def test_contacts_are_on_or_a_gap(path, run, lane, source, column):
    t = run.trajectory
    time, states = read(path, f"{ROOT}/{lane}")[0]["StateChange:state"]
    rows = np.round(time / 1e6).astype(int)
    rebuilt = np.repeat([s == ["1"] for s in states[:-1]], np.diff(rows))
    assert np.array_equal(rebuilt, t.column(source)[:, column].astype(bool))
    assert all(s in (["1"], ["-"]) for s in states)
