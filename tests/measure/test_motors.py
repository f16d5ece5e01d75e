"""Loads of motors and electrical costs, against a torque and a rate that can be worked out by hand."""

from __future__ import annotations

import numpy as np
import pytest

from biped.base.files import folder
from biped.measure import stored
from biped.measure.metrics import measure
from biped.measure.metrics.belief import inferred
from biped.measure.metrics.energy import motor_load
from biped.measure.seven_links import PlanarTrajectory
from biped.measure.trajectory import Trajectory
from biped.robot.columns import WIDTH, Q, U, V
from biped.robot.load import load_robot
from biped.robot.planar.topology import BASE, HIP, NU

DISTANCE = 0.5
"""[m] in the second that runs last here."""
ROBOT = folder("models") / "robot.xml"


def trajectory(u, rate, n: int = 1001, speed: float = 0.5, **changes) -> Trajectory:
    """Joints that turn evenly under even torques while the torso goes forward."""
    log = np.zeros((n, WIDTH))
    log[:, 0] = 1e-3 * np.arange(n)
    log[:, Q] = speed * log[:, 0]
    log[:, U : U + NU], log[:, V + BASE : V + BASE + NU] = u, rate
    plain = {"tick": 1e-3, "slope": 0.0, "generalized": False, "torque_limit": (20.0,) * NU,
             "pushes": (), "end": "completed", "cause": "", "warnings": {},
             "robot": load_robot(ROBOT, None)}  # fmt: skip
    return PlanarTrajectory(log=log, **(plain | changes))


def one(joint: int, value: float) -> np.ndarray:
    return value * np.eye(NU)[joint]


def test_a_hip_that_lifts_draws_copper_loss_and_work():
    numbers = motor_load(trajectory(one(0, 10.0), one(0, 2.0)), slice(None), DISTANCE)
    current = 10.0 / (21 * 0.0302 * 0.81)
    weight = 14.32 * 9.81 * 0.5  # W at 0.5 m/s
    heat = 0.299 * current**2
    assert numbers["cost_of_transport_heat"] == pytest.approx(heat / weight, rel=2e-3)
    work = heat + 10.0 * 2.0 / 0.81
    assert numbers["cost_of_transport_electrical"] == pytest.approx(work / weight, rel=2e-3)
    assert numbers["motor_load"] == pytest.approx(10.0 / (0.81 * 21 * 0.177))
    assert numbers["gear_load"] == pytest.approx(10.0 / 11.3)
    assert (numbers["beyond_gear"], numbers["beyond_line"]) == (0.0, 0.0)


def test_a_hip_that_brakes_fast_gives_nothing_back():
    numbers = motor_load(trajectory(one(0, 1.0), one(0, -20.0)), slice(None), DISTANCE)
    assert numbers["cost_of_transport_electrical"] == 0.0
    current = 0.81 / (21 * 0.0302)  # the gear's loss is on the joint's side
    assert numbers["cost_of_transport_heat"] == pytest.approx(0.299 * current**2 / (14.32 * 9.81 * 0.5), rel=2e-3)


@pytest.mark.parametrize(("rate", "beyond"), [(19.0, 0.0), (20.0, 1.0), (-20.0, 0.0)])
def test_the_torque_speed_line(rate, beyond):
    """A hip of 41.3 N m and 37.8 rad/s gives 20 N m up to 19.5 rad/s, and any speed backwards."""
    assert motor_load(trajectory(one(3, 20.0), one(3, rate)), slice(None), DISTANCE)["beyond_line"] == beyond


def test_half_of_the_time_beyond_the_gear():
    t = trajectory(one(2, 12.0), np.zeros(NU))
    t.log[500:, U : U + NU] = 0.0
    assert motor_load(t, slice(None), DISTANCE)["beyond_gear"] == pytest.approx(0.5, abs=1e-3)


def test_a_robot_without_motors_has_torques_alone():
    human = load_robot(folder("models") / "human.xml", None)
    t = trajectory(one(0, 3.0), np.zeros(NU), robot=human)
    assert motor_load(t, slice(None), DISTANCE) == {}
    assert measure(t, (0.0, 1.0))["rms_torque"] == pytest.approx(3.0)


def test_an_estimates_errors_gaps_and_clipping():
    noted = np.zeros((1001, 4))
    noted[:, 0] = np.radians(0.3)
    noted[100, 0] = np.radians(-2.0)
    noted[200:260, 2] = noted[400:420, 2] = 1.0
    noted[:100, 3] = 1.0
    t = trajectory(np.zeros(NU), one(HIP[0] - BASE, 0.0), inferred=noted)
    numbers = inferred(t, slice(None))
    assert numbers["torso_error"] == pytest.approx(np.sqrt((1000 * 0.09 + 4.0) / 1001))
    assert numbers["torso_error_worst"] == pytest.approx(2.0)
    assert numbers["underactuated"] == pytest.approx(80 / 1001)
    assert numbers["longest_gap"] == pytest.approx(0.06)
    assert numbers["gyro_clipped"] == pytest.approx(100 / 1001)
    assert inferred(trajectory(np.zeros(NU), np.zeros(NU)), slice(None)) == {}


def test_what_was_inferred_is_saved_with_the_run(tmp_path):
    noted = np.random.default_rng(0).normal(size=(1001, 4))
    t = trajectory(np.zeros(NU), np.zeros(NU), inferred=noted)
    t.save(tmp_path / "t.npz")
    back = stored.load(tmp_path / "t.npz")
    np.testing.assert_array_equal(back.inferred, noted)
    assert back.robot.motor == t.robot.motor
    np.testing.assert_array_equal(t.last(0.1).inferred, noted[-100:])
