"""Joint torques that nobody modelled: their strength, how they change with the state, and what they do to a robot."""

from __future__ import annotations

import numpy as np
import pytest

from biped.base.errors import InputError
from biped.engines.mujoco import simulate
from biped.robot.unmodelled import RATE, torques_at, unmodelled_of
from biped.studies.run import plan_of
from tests.engines.test_mujoco import IDLE, law_of, named

STRENGTH = "truth.unmodelled.torque=0.1"


def torques(made, angles, rates):
    torques_at(made, np.array(angles), np.array(rates))
    return made.added.copy()


def test_strength_and_covariance_are_those_asked_for():
    plan, angle = plan_of("upright/own", [STRENGTH, "truth.unmodelled.angle=0.4"]), 0.4
    here, there = np.array([0.1, -0.3, 0.2, 0.0, -0.5, 0.1]), np.zeros(6)
    there[2] = angle  # one standard deviation of the covariance away
    found = []
    for seed in range(600):
        (made,) = unmodelled_of(plan.run_from(seed))
        still = np.zeros(6)
        found.append([torques(made, here, still), torques(made, here + there, still),
                      torques(made, here, there / RATE)])  # fmt: skip
    a, moved, faster = np.array(found).transpose(1, 0, 2) / 150.0
    assert np.sqrt((a**2).mean()) == pytest.approx(0.1, rel=0.05)
    for other in (moved, faster):
        assert (a * other).mean() / (a**2).mean() == pytest.approx(np.exp(-0.5), abs=0.05)
    assert abs((a[:, 0] * a[:, 1]).mean() / (a**2).mean()) < 0.15, "one joint's says nothing of another's"


def test_a_run_has_one_reality_and_twice_the_strength_is_twice_the_same():
    one, two = (plan_of("upright/own", [f"truth.unmodelled.torque={size}"]) for size in (0.1, 0.2))
    x, v = np.linspace(-0.5, 0.5, 6), np.linspace(1.0, -1.0, 6)
    (a,), (again,), (b,), (other,) = (
        unmodelled_of(plan.run_from(i)) for plan, i in ((one, 3), (one, 3), (two, 3), (one, 4))
    )
    assert (torques(a, x, v) == torques(again, x, v)).all()
    np.testing.assert_allclose(2.0 * torques(a, x, v), torques(b, x, v), rtol=1e-12)
    assert (torques(a, x, v) != torques(other, x, v)).all()


def test_seven_links_record_what_acts_within_the_limits():
    from biped.engines.planar import mujoco

    plan = plan_of("upright/own", ["truth.unmodelled.torque=0.5", "duration=0.3"])
    t = mujoco.simulate(plan.run_from(1))
    assert np.abs(t.u).max() <= 150.0
    none = mujoco.simulate(plan_of("upright/own", ["duration=0.3"]).run_from(1))
    (made,) = unmodelled_of(plan.run_from(1))
    # In the first tick both laws want the same.
    expected = np.clip(none.u[0] + torques(made, t.q[0, 3:], t.v[0, 3:]), -150.0, 150.0)
    np.testing.assert_allclose(t.u[0], expected, rtol=1e-9)


def test_a_robot_of_any_kind_moves_as_if_its_motors_did_it(tmp_path):
    changes = ("duration=0.1", "truth.unmodelled.torque=0.1")
    idle = law_of(tmp_path, IDLE.replace("return {}", "return np.zeros(19)"))
    run = plan_of(named("h1"), (idle, *changes)).run(0)
    (made,) = unmodelled_of(run)
    file = tmp_path / "reality.npz"
    np.savez(file, **made._asdict())
    beside = simulate(run)
    assert not beside.u.any()
    (tmp_path / "driven").mkdir()
    driven = law_of(
        tmp_path / "driven",
        f"""    def __init__(self, setup):
        self.robot, self.made = setup.robot, np.load("{file}")

    def torques(self, sensed):
        state = np.append(sensed.q[self.robot.places], sensed.v[self.robot.columns])
        return self.made["torques"] @ np.cos(self.made["frequencies"] @ state + self.made["phases"])
""",
    )
    motors = simulate(plan_of(named("h1"), (driven, "duration=0.1")).run(0))
    assert motors.u.any()
    still = simulate(plan_of(named("h1"), (idle, "duration=0.1")).run(0))
    np.testing.assert_allclose(beside.q, motors.q, atol=1e-7)
    assert np.abs(beside.q - still.q).max() > 1e-3


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        (["actuation.mode=generalized"], r"truth.unmodelled.torque: expected 0, or actuation.mode = 'joint'"),
        (["truth.unmodelled.torque=-1"], r"truth.unmodelled.torque"),
        (["truth.unmodelled.angel=0.1"], r"angel.*did you mean 'angle'"),
    ],
)
def test_what_makes_no_sense_is_refused_in_one_sentence(changes, words):
    with pytest.raises(InputError, match=words):
        plan_of("upright/own", [STRENGTH, *changes]).run(0)
