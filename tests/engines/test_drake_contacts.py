"""Drake's contacts with the ground, against closed forms: a ball that rests, rebounds, slides, lands or is pushed."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest
from scipy.optimize import brentq

pytest.importorskip("pydrake", reason="Drake is not installed")
from biped.engines.sap.stepper import Stepper
from tests.engines.steppers import run_of

BALL = """<mujoco><worldbody><geom type="plane" size="0 0 1" solref="0.01 1"/>
  <body name="ball" pos="0 0 0.1"><freejoint/><geom size="0.1" mass="5" {ball}/></body></worldbody></mujoco>"""


def stepper_on(model, approximation="sap"):
    """What steps a ball; what else it wants of a robot it does not ask of spheres."""
    return Stepper(model, run_of("any/humanoid").robot, True, "ball", approximation=approximation)


def ball(more=""):
    """A ball of 5 kg that touches the ground."""
    return stepper_on(mujoco.MjModel.from_xml_string(BALL.format(ball=more)))


@pytest.mark.parametrize(("more", "time"), [
    ('solref="0.01 1"', 0.01),
    ('solref="0.02 1"', 0.015),  # MuJoCo's mean of the two
    ('solref="0.02 1" solmix="3"', 0.0175),
    ('solref="0.02 1" priority="1"', 0.02),
])  # fmt: skip
def test_penetration_at_rest_is_weight_over_stiffness(more, time):
    stepper = ball(more)
    for _ in range(400):
        contacts = stepper.step()
    assert 0.1 - stepper.q[2] == pytest.approx(9.81 * time**2, rel=1e-3)
    assert contacts[0].force == pytest.approx([0.0, 0.0, 5.0 * 9.81], rel=1e-6, abs=1e-6)


def test_contacts_begin_at_mujocos_margin():
    text = BALL.format(ball='solref="0.01 1" margin="0.003"').replace(
        '<geom type="plane"', '<geom margin="0.002" type="plane"'
    )
    model = mujoco.MjModel.from_xml_string(text)
    stepper, data = stepper_on(model), mujoco.MjData(model)
    for _ in range(600):
        stepper.step()
        mujoco.mj_step(model, data)
    assert stepper.q[2] == pytest.approx(0.105 - 9.81 * 0.01**2, abs=1e-6)
    assert data.qpos[2] == pytest.approx(0.105, abs=3e-4)


@pytest.mark.parametrize("ratio", [0.1, 0.4])
def test_a_ball_rebounds_as_its_damping_ratio_says(ratio):
    """The closed form of a damped spring that only pushes (T. Schwager, T. Pöschel, Granular Matter 9, 2007)."""
    text = BALL.format(ball=f'solref="0.01 {ratio}"').replace('solref="0.01 1"/>', f'solref="0.01 {ratio}"/>')
    option = '<mujoco><option timestep="1e-5" gravity="0 0 0"/>'
    model = mujoco.MjModel.from_xml_string(text.replace("<mujoco>", option))
    stepper = stepper_on(model)
    stepper.v[2] = -0.5
    for _ in range(4000):
        stepper.step()
    root = np.sqrt(1.0 - ratio**2)
    released = np.pi - np.arctan2(2.0 * ratio * root, 1.0 - 2.0 * ratio**2)
    assert stepper.v[2] / 0.5 == pytest.approx(np.exp(-ratio / root * released), rel=5e-3)


@pytest.mark.parametrize(("more", "friction"), [
    ('friction="0.3"', 1.0),  # the larger, as in MuJoCo: the ground has 1
    ('friction="0.3" priority="1"', 0.3),
    ('friction="1.4"', 1.4),
])  # fmt: skip
def test_a_sliding_ball_meets_the_friction_that_mujoco_gives_it(more, friction):
    stepper = ball(more)
    stepper.v[0], normal = 20.0, []  # too fast to roll
    for _ in range(100):
        contacts = stepper.step()
        normal += [one.force for one in contacts]
    x, _, z = np.array(normal).T
    assert -x[20:] == pytest.approx(friction * z[20:], rel=1e-3)


def block(time, ratio, friction, approximation, timestep, gravity=-9.81):
    """A ball of 5 kg that cannot roll."""
    contact = f'solref="{time} {ratio}" friction="{friction} 0 0"'
    text = f"""<mujoco><option timestep="{timestep}" gravity="0 0 {gravity}"/><worldbody>
      <geom type="plane" size="0 0 1" {contact}/><body name="ball" pos="0 0 0.1"><joint type="slide" axis="1 0 0"/>
      <joint type="slide" axis="0 0 1"/><geom size="0.1" mass="5" {contact}/></body></worldbody></mujoco>"""
    return stepper_on(mujoco.MjModel.from_xml_string(text), approximation)


@pytest.mark.parametrize("time", [0.004, 0.02])
def test_what_slides_is_lifted_unless_friction_lags(time):
    """One convex problem has what slides at v rise by friction · v; what lags has it stay where its weight presses."""
    rise = {}
    for approximation in ("sap", "lagged"):
        one = block(time, 1.0, 1.0, approximation, 0.001)
        one.q[1], one.v[0] = -9.81 * time**2, 2.0
        heights = []
        for _ in range(40):
            one.step()
            heights.append(one.q[1] + 9.81 * time**2)
        rise[approximation] = max(heights)
    assert one.v[0] == pytest.approx(2.0 - 9.81 * 0.04, abs=1e-3)
    assert rise["sap"] > 0.003
    assert abs(rise["lagged"]) < 1e-5


@pytest.mark.parametrize(("time", "ratio", "timestep"), [
    (0.01, 0.1, 1e-4), (0.01, 0.4, 1e-4), (0.02, 1.0, 1e-3), (0.02, 1.0, 1e-4), (0.004, 1.0, 1e-5),
])  # fmt: skip
def test_where_friction_lags_a_ball_that_lands_sliding_loses_what_coulomb_says(time, ratio, timestep):
    """Closed forms of Hunt's and Crossley's contact: v dv / (1 + d v) = -k x dx / m, and friction times its impulse."""
    one, landing, d = block(time, ratio, 0.4, "lagged", timestep, 0.0), 0.9, 2.0 * ratio / (9.81 * time)
    one.q[1], one.v[:] = 1e-4, (2.0, -landing)
    while (one.q[1] <= 1e-4 and one.v[1] < 0.0) or one.q[1] < 0.0:
        one.step()
    most = d * landing
    rest = brentq(lambda y: np.log1p(most) - y - most - 1.0 + np.exp(y), -2.0 - most, 0.0)  # log of 1 - d · leaving
    leaves = (1.0 - np.exp(rest)) / d
    assert one.v[1] == pytest.approx(leaves, rel=0.012)
    assert one.v[0] == pytest.approx(2.0 - 0.4 * (landing + leaves), abs=0.01)


def test_a_push_changes_the_momentum_by_its_impulse():
    stepper = ball()
    stepper.q[2], stepper.v[3:] = 3.0, [0.5, 1.0, -0.3]
    stepper.push(np.array([[80.0, -20.0, 30.0]]))
    for _ in range(50):
        assert stepper.step() == []
    assert 5.0 * stepper.v[:3] == pytest.approx([8.0, -2.0, 3.0 - 5.0 * 0.981], abs=1e-10)
    pushed = 0.5 * 5.0 * (stepper.v[:3] @ stepper.v[:3]) + 5.0 * 9.81 * (stepper.q[2] - 3.0)
    assert stepper.given == pytest.approx(pushed, abs=0.05)
