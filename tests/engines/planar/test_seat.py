"""A seat in MuJoCo: its force is MuJoCo's own, the sentinels hold, and it meets nothing but the pelvis."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import mujoco
import numpy as np
import pytest

from biped.base.errors import InputError
from biped.engines.planar.mujoco import simulate
from biped.ensemble.failures import load_packed, save_packed
from biped.ensemble.plan import Plan
from biped.measure import stored
from biped.measure.metrics import measure
from biped.measure.trajectory import Trajectory
from biped.robot.ground import box_of
from biped.robot.planar.build import PELVIS, SEAT, compile_foreign
from biped.scenario.keys import Scenario
from biped.scenario.reading import read_scenario
from biped.scenario.world import Seat

HIP = 0.3245184
"""[m] below the torso's origin."""


SEATED = [
    "controller=sit", "start.q=[-0.35, 0.95, 1.35, 3.0, 1.45, 0.0, 3.0, 1.45, 0.0]", "start.jitter=0.0",
    "start.posture=flat",
    "start.contacts=['right_toe', 'right_heel', 'left_toe', 'left_heel']", "ground.seat.height=0.485",
    "fall.height=0.5", "duration=2.0", "window.start=1.0", "window.end=2.0",
]  # fmt: skip


def plan(*changes: str) -> Plan:
    """Somebody who is put down a centimetre above a seat."""
    return Plan(read_scenario("calm/own", [*SEATED, *changes]))


@lru_cache(maxsize=4)
def sat_down(*changes: str) -> Trajectory:
    return simulate(plan(*changes).run(0))


def test_the_seats_force_is_that_of_mujocos_contact():
    """At every 5th row, set up afresh: the contact's own force in the world, and its moment about the torso."""
    run = plan().run(0)
    t, model = sat_down(), compile_foreign(run.model, run.scenario).model
    data, pelvis = mujoco.MjData(model), model.geom(PELVIS).id
    force, borne = np.zeros(6), 0
    for k in range(0, len(t), 5):
        data.qpos[:], data.qvel[:], data.ctrl[:] = t.q[k], t.v[k], t.u[k]
        mujoco.mj_forward(model, data)
        wrench = np.zeros(3)
        for i in range(data.ncon):
            if pelvis not in data.contact[i].geom:
                continue
            mujoco.mj_contactForce(model, data, i, force)
            # MuJoCo's force is that on the second geom.
            sign = -1.0 if data.contact[i].geom[0] == pelvis else 1.0
            x, _, z = sign * data.contact[i].frame.reshape(3, 3).T @ force[:3]
            rx, rz = data.contact[i].pos[[0, 2]] - t.q[k, :2]
            wrench += [x, z, rx * z - rz * x]
        np.testing.assert_allclose(t.seat_force[k], wrench, atol=2e-3 * max(1.0, np.abs(wrench).max()), err_msg=f"{k}")
        borne += wrench[1] > 100.0
    assert borne > 200


def test_who_sits_is_borne_by_seat_and_feet_together_and_nothing_comes_from_nowhere():
    t = sat_down()
    numbers = measure(t, (1.0, 2.0))
    assert (numbers["sat"], numbers["stood"], numbers["walked"], numbers["falls"]) == (1, 0, 0, 0)
    assert numbers["seat_load"] + numbers["support"] == pytest.approx(1.0, abs=1e-3)
    assert numbers["seat_load"] > 0.7
    assert numbers["energy_residual"] < 1e-3
    assert numbers["momentum_residual"] < 1e-6
    unknown = replace(t, seat=None, seat_force=None)
    assert measure(unknown, (1.0, 2.0))["momentum_residual"] > 0.1  # the seat bore it


def test_the_pelvis_lies_on_the_seat_and_legs_pass_through_it():
    t = sat_down()
    pitch = t.q[-1, 2]
    hip = t.q[-1, :2] + HIP * np.array([np.sin(pitch), -np.cos(pitch)])
    assert hip[1] == pytest.approx(0.485 + t.seat.pelvis, abs=1e-3)
    assert t.seat.front - t.seat.depth < hip[0] < t.seat.front
    model = compile_foreign(plan().model, plan().scenario).model
    meets = [{model.geom(a).name, model.geom(b).name} for a, b in zip(model.pair_geom1, model.pair_geom2, strict=True)]
    assert [pair for pair in meets if SEAT in pair] == [{SEAT, PELVIS}]
    assert not model.geom_contype[model.geom(SEAT).id]


def test_in_python_it_is_what_it_is_compiled(tmp_path):
    """With somebody looking on the ticks are Python's and the model has its visual geoms."""
    run = plan("duration=0.5", "window.start=0", "window.end=0.5").run(0)
    compiled, watched = simulate(run), simulate(run, lambda *seen: None)
    assert compiled.seat_force[:, 1].max() > 300.0
    np.testing.assert_allclose(watched.seat_force, compiled.seat_force, atol=1e-6)
    np.testing.assert_allclose(watched.q, compiled.q, atol=1e-9)
    compiled.save(tmp_path / "t.npz")
    again = stored.load(tmp_path / "t.npz")
    assert again.seat == compiled.seat
    np.testing.assert_array_equal(again.seat_force, compiled.seat_force)
    assert len(again.rows(slice(10, 20)).seat_force) == 10
    save_packed(compiled, tmp_path / "t.xz")
    assert load_packed(tmp_path / "t.xz").seat == compiled.seat


def test_a_seat_that_nobody_touches_changes_nothing():
    """Bit for bit: another geom and pair in the model, and no contact."""
    far = "ground.seat.front=-5.0"
    with_seat, without = sat_down(far), sat_down("ground.seat.height=0.0")
    np.testing.assert_array_equal(with_seat.log, without.log)
    assert len(with_seat) > 300  # the feet bear something before it falls
    assert not with_seat.seat_force.any()
    assert without.seat is None


def test_the_box():
    middle, half = box_of(Seat(height=0.4, front=-0.1, depth=0.6))
    np.testing.assert_allclose(middle + half, [-0.1, 0.25, 0.4])
    np.testing.assert_allclose(middle - half, [-0.7, -0.25, 0.0], atol=1e-15)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        (["engine=home"], "in the engine 'home' nothing but toes and heels meets"),
        (["ground.seat.height=-0.1"], r"ground\.seat\.height"),
        (["ground.seat.high=0.4"], "height"),
    ],
)
def test_a_seat_that_cannot_be(changes, said):
    with pytest.raises(InputError, match=said):
        plan(*changes)


def test_robots_of_other_kinds_have_none():
    with pytest.raises(InputError, match=r"ground\.seat: expected none"):
        Plan(read_scenario("any/h1", ["ground.seat.height=0.45"]))
    assert Scenario().ground.seat.height == 0.0
