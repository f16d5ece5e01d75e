"""Dry friction of joints in Drake: closed forms, MuJoCo's, servos and rotors beside it, and the audit of a robot."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from biped.ensemble.campaign import simulate
from biped.measure.metrics import assess

drake = pytest.importorskip("pydrake", reason="Drake is not installed")
from biped.engines.sap.stepper import Stepper  # noqa: E402
from tests.engines.steppers import run_of  # noqa: E402

STEP, LENGTH, MASS, FRICTION = 1e-3, 0.5, 2.0, 1.5
SHORT = ("duration=1.1", "window={start=0.1, end=1.1}")

MODEL = """<mujoco><option timestep="{step}" gravity="0 0 {gravity}"/>
  <worldbody><geom type="plane" size="0 0 1" pos="0 0 -9"/>
    <body name="rod"><joint name="hinge" axis="0 1 0" frictionloss="{friction}" armature="{armature}"/>
      <inertial pos="0 0 -0.5" mass="2" diaginertia="0.01 0.01 0.01"/></body></worldbody>{more}</mujoco>"""
SERVO = """<actuator><position joint="hinge" kp="30" kv="8" forcelimited="true" forcerange="-8 8"/></actuator>"""


def hinge(gravity=-9.81, friction=FRICTION, armature=0.0, more="", step=STEP):
    """A rod of 2 kg on a hinge, its centre half a metre below it."""
    text = MODEL.format(gravity=gravity, friction=friction, armature=armature, more=more, step=step)
    return Stepper(mujoco.MjModel.from_xml_string(text), run_of("any/humanoid").robot, True, "rod")


@pytest.mark.parametrize("armature", [0.0, 0.3])
def test_a_sliding_hinge_slows_down_by_its_friction_and_stops_when_it_must(armature):
    stepper = hinge(gravity=0.0, armature=armature)
    inertia, start = 0.01 + MASS * LENGTH**2 + armature, 2.0
    stepper.v[0], rates = start, []
    for _ in range(2000):
        stepper.step()
        rates.append(stepper.v[0])
    stop = inertia * start / FRICTION
    times = STEP * np.arange(1, 2001)
    sliding = times < stop - STEP
    assert np.array(rates)[sliding] == pytest.approx(start - FRICTION / inertia * times[sliding], abs=1e-9)
    assert np.abs(np.array(rates)[times > stop + 5 * STEP]).max() < 1e-9
    assert stepper.q[0] == pytest.approx(0.5 * start * stop, rel=2e-3)
    assert stepper.work == pytest.approx(-0.5 * inertia * start**2, rel=1e-9)
    assert stepper.given == 0.0  # friction is no actuator


def test_a_pendulum_within_the_cone_stays_and_one_outside_falls_into_it():
    inside, outside = hinge(), hinge()
    load = MASS * 9.81 * LENGTH
    inside.q[0], outside.q[0] = np.arcsin(0.95 * FRICTION / load), np.arcsin(1.05 * FRICTION / load)
    angle, acceleration = inside.q[0], 0.95 * FRICTION / (0.01 + MASS * LENGTH**2)
    before, m = outside.q[0], inside.model
    data = mujoco.MjData(m)
    data.qpos[0] = angle
    for _ in range(2000):
        inside.step()
        outside.step()
        mujoco.mj_step(m, data)
    # What is held creeps by a hundredth of what it would gain in a step, and no more.
    assert 0.0 <= angle - inside.q[0] < 1.1 * 0.01 * acceleration * STEP * 2.0
    assert 50.0 < (angle - data.qpos[0]) / (angle - inside.q[0]) < 200.0  # MuJoCo's friction is softer
    assert inside._joints.friction[0] == pytest.approx(load * np.sin(inside.q[0]), rel=1e-6)
    assert before - outside.q[0] > 1e-3
    assert abs(outside.v[0]) < 1e-4
    assert load * np.sin(outside.q[0]) < FRICTION


def test_friction_never_exceeds_its_limit_and_always_opposes_motion():
    stepper = hinge(friction=4.0)
    stepper.q[0], swings = 2.0, []
    for _ in range(3000):
        stepper.step()
        torque = stepper._joints.friction[0]
        swings.append(torque * stepper.v[0])
        assert abs(torque) <= 4.0
    assert max(swings) <= 0.0
    assert abs(stepper.v[0]) < 1e-4


@pytest.mark.parametrize("margin", [0.0, 0.05])
def test_a_stop_begins_at_mujocos_margin(margin):
    text = MODEL.format(gravity=-9.81, friction=0.0, armature=0.0, more="", step=STEP)
    limits = f'limited="true" range="-20 60" margin="{margin}" damping="1" '
    model = mujoco.MjModel.from_xml_string(text.replace('axis="0 1 0"', limits + 'axis="0 1 0"'))
    stepper, data = Stepper(model, run_of("any/humanoid").robot, True, "rod"), mujoco.MjData(model)
    stepper.q[0] = data.qpos[0] = 0.5
    stepper.applied[0] = data.qfrc_applied[0] = 30.0
    for _ in range(2000):
        stepper.step()
        mujoco.mj_step(model, data)
    assert stepper.q[0] == pytest.approx(np.radians(60.0) - margin, abs=1e-3)
    assert data.qpos[0] == pytest.approx(stepper.q[0], abs=5e-3)
    assert stepper.stop[0] == pytest.approx(MASS * 9.81 * LENGTH * np.sin(stepper.q[0]) - 30.0, rel=1e-3)


def test_a_swinging_pendulum_is_mujocos():
    stepper, q = hinge(friction=0.3), []
    m = stepper.model
    data = mujoco.MjData(m)
    stepper.q[0] = data.qpos[0] = 1.0
    for _ in range(2500):
        mujoco.mj_step(m, data)
        stepper.step()
        q.append((stepper.q[0], data.qpos[0]))
    ours, theirs = np.array(q).T
    assert np.abs(ours - theirs).max() < 0.02
    assert np.ptp(ours[-1200:]) == pytest.approx(np.ptp(theirs[-1200:]), rel=0.05)
    assert np.ptp(ours[-1200:]) < 0.9 * np.ptp(ours[:1200])


def test_a_servo_and_a_rotor_act_beside_friction():
    stepper = hinge(armature=0.3, more=SERVO)
    M = stepper.plant.CalcMassMatrix(stepper.context)
    assert M[0, 0] == pytest.approx(0.01 + MASS * LENGTH**2 + 0.3, rel=1e-12)
    stepper.q[0], stepper.target[0] = 0.4, -0.3
    for _ in range(800):
        stepper.step()
        wanted = np.clip(30.0 * (-0.3 - stepper.q[0]) - 8.0 * stepper.v[0], -8.0, 8.0)
        assert stepper.torque[0] == pytest.approx(wanted, abs=1e-7)
        assert abs(stepper.residual([0])[0]) < 1e-3
    assert abs(stepper.v[0]) < 1e-4
    assert abs(stepper.torque[0] - MASS * 9.81 * LENGTH * np.sin(stepper.q[0])) <= FRICTION


BESIDE = """<mujoco><option timestep="1e-3"/>
  <worldbody><geom type="plane" size="0 0 1" pos="0 0 -9"/>
    <body name="wheel"><joint name="free" axis="0 1 0" armature="0.4"/>
      <inertial pos="0 0 0" mass="1" diaginertia="0.1 0.1 0.1"/>
      <body name="rod"><joint name="hinge" axis="0 1 0" frictionloss="1.5"/>
        <inertial pos="0 0 -0.5" mass="2" diaginertia="0.01 0.01 0.01"/></body></body></worldbody>
  <actuator><position joint="hinge" kp="30" kv="8"/></actuator></mujoco>"""


def test_a_rotor_that_nothing_holds_stands_beside_servos_and_friction():
    """Drake has rows for it in what servos are told."""
    model = mujoco.MjModel.from_xml_string(BESIDE)
    stepper = Stepper(model, run_of("any/humanoid").robot, True, "rod")
    stepper.target[0] = 0.3
    for _ in range(500):
        stepper.step()
        assert stepper.torque[1] == pytest.approx(30.0 * (0.3 - stepper.q[1]) - 8.0 * stepper.v[1], abs=1e-7)
        assert stepper.torque[0] == 0.0
        assert np.abs(stepper.residual([0, 1])).max() < 1e-3


@pytest.mark.parametrize("name", ["any/h1", "any/h1_walk"])
def test_energy_and_momentum_of_a_robot_with_dry_friction_are_accounted_for(name):
    run = run_of(name, "truth.joint_friction=1.0", *SHORT)
    trajectory, numbers = assess(simulate(run), run.scenario.interval)
    assert trajectory.end == "completed"
    assert numbers["energy_residual"] < 1e-3
    assert numbers["momentum_residual"] < 1e-4
    assert numbers["verdict"] == "sound", numbers["doubt"]
    without = simulate(run_of(name, *SHORT))
    assert np.abs(trajectory.q - without.q).max() > 1e-4
