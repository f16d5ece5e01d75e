"""What a run leaves behind survives saving."""

from __future__ import annotations

from dataclasses import fields

import msgspec
import numpy as np
import pytest

from biped.base.errors import InputError
from biped.ensemble import failures
from biped.ensemble.campaign import simulate
from biped.ensemble.plan import Plan
from biped.measure.stored import load
from biped.measure.trajectory import Trajectory
from biped.robot.columns import COLUMNS, WIDTH
from biped.robot.planar.description import description_at
from biped.scenario.reading import read_scenario
from tests.runs import made
from tests.ticks import HUMAN


def test_columns_fill_the_log_without_overlap():
    taken = np.zeros(WIDTH, int)
    for first, shape in COLUMNS.values():
        taken[first : first + int(np.prod(shape, dtype=int))] += 1
    np.testing.assert_array_equal(taken, 1)


@pytest.mark.parametrize("name", ["pushed", "generalized"])
def test_round_trip(name, tmp_path):
    t = made(name)
    t.save(tmp_path / "t.npz")
    back = load(tmp_path / "t.npz")
    assert back.log.tobytes() == t.log.tobytes()
    for field in ("tick", "slope", "generalized", "pushes", "end", "cause", "warnings"):
        assert getattr(back, field) == getattr(t, field)
    for mine, theirs in zip(back.tree, t.tree, strict=True):
        np.testing.assert_array_equal(mine, theirs)


@pytest.mark.parametrize("name", ["walk", "slope"])
def test_what_seven_links_know_otherwise_is_what_holds_for_every_robot(name):
    """Lean, tilt, loads and joint angles from places and axes alone, as those of a robot of any kind are."""
    t = made(name)
    for quantity in ("x", "y"):
        np.testing.assert_array_equal(getattr(t, quantity), getattr(Trajectory, quantity).fget(t))
    np.testing.assert_array_equal(t.tilt, Trajectory.tilt.func(t))
    for quantity in ("lean", "foot_force"):
        theirs = getattr(Trajectory, quantity)
        np.testing.assert_allclose(getattr(t, quantity), theirs.func(t), rtol=0, atol=1e-9)
    np.testing.assert_allclose(t.joint_angles[:, :2], Trajectory.joint_angles.fget(t)[:, :2], rtol=0, atol=1e-9)
    np.testing.assert_array_equal(t.joint_torques, Trajectory.joint_torques.fget(t))


def test_same_run_same_file(tmp_path):
    made("pushed").save(tmp_path / "a.npz")
    load(tmp_path / "a.npz").save(tmp_path / "b.npz")
    assert (tmp_path / "a.npz").read_bytes() == (tmp_path / "b.npz").read_bytes()


def test_file_is_plain_numpy_with_named_arrays(tmp_path):
    t = made("pushed")
    t.save(tmp_path / "t.npz")
    with np.load(tmp_path / "t.npz", allow_pickle=False) as file:
        assert set(file) == {"about", *COLUMNS}
        np.testing.assert_array_equal(file["force"], t.force[..., [0, 2]])


def test_last_seconds():
    t = made("pushed")
    end = t.last(0.25)
    assert len(end) == 250
    np.testing.assert_array_equal(end.log, t.log[-250:])
    assert len(t.last(1e6)) == len(t)


@pytest.mark.parametrize("content", [b"", b"text", b"PK\x03\x04"])
def test_what_is_no_trajectory(content, tmp_path):
    (tmp_path / "t.npz").write_bytes(content)
    with pytest.raises(InputError, match=r"t\.npz: not a trajectory"):
        load(tmp_path / "t.npz")


def test_a_missing_file(tmp_path):
    with pytest.raises(InputError, match=r"t\.npz: not a trajectory"):
        load(tmp_path / "t.npz")


class Before(Trajectory):
    """A trajectory that is written as an earlier version did."""

    named = True

    @property
    def about(self):
        about = {name: value for name, value in super().about.items() if name not in ("side_slope", "gravity", "robot")}
        about["tree"] = {name: value.tolist() for name, value in self.tree._asdict().items()}
        return about | ({"robot": msgspec.to_builtins(description_at(HUMAN))} if self.named else {})


class Unnamed(Before):
    """The oldest: all of them were the human's."""

    named = False


class General(Trajectory):
    """One of another robot, which said so."""

    @property
    def about(self):
        robot = {name: value for name, value in super().about["robot"].items() if name not in ("motor", "seven_links")}
        return super().about | {"kind": "general", "robot": robot}


def standing():
    """A few rows of a robot that is not one of seven links."""
    return simulate(Plan(read_scenario("spatial/own", ["duration=0.02", "window.start=0.0", "window.end=0.02"])).run(0))


@pytest.mark.parametrize(
    ("version", "run"), [(Before, lambda: made("pushed")), (Unnamed, lambda: made("pushed")), (General, standing)]
)
@pytest.mark.parametrize("how", ["plain", "packed"])
def test_what_earlier_versions_kept_still_reads(version, run, how, tmp_path):
    t = run()
    old = version(**{field.name: getattr(t, field.name) for field in fields(t)})
    path = tmp_path / "t"
    if how == "plain":
        old.save(path)
        back = load(path)
        assert back.log.tobytes() == t.log.tobytes()
    else:
        failures.save_packed(old, path)
        back = failures.load_packed(path)
        np.testing.assert_allclose(back.q, t.q, atol=1e-6)
    assert back.columns == t.columns
    assert (back.robot.feet[0].name, back.mass) == (t.robot.feet[0].name, pytest.approx(t.mass))
    np.testing.assert_allclose(back.point, t.point, atol=1e-5)
    np.testing.assert_array_equal(back.gravity, t.gravity)
