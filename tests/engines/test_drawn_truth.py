"""How a robot differs from its file, drawn run by run: each key against its closed form in what is stepped."""

from __future__ import annotations

import numpy as np
import pytest

from biped.base.errors import InputError
from biped.engines.actuators import Latency
from biped.engines.mujoco import simulate
from biped.robot.build import Servo, compiled
from biped.studies.run import plan_of
from tests.engines.test_mujoco import IDLE, law_of, named

DRAW = "randomise.draw={%s}"


def models(*changes: str, servos: float | None = None):
    """What is stepped with changes of the scenario and without."""
    plans = plan_of(named("h1"), changes), plan_of(named("h1"), ())
    servo = None if servos is None else (Servo(servos, 0.1 * servos, 50.0),) * 19
    return [compiled(one.run(0).model, one.scenario, "torque" if servo is None else "position", servo) for one in plans]


def test_masses_centres_friction_and_rotors():
    part = "truth.part=[{name='torso', mass=1.2, shift=[0.02, 0.0, -0.01]}, {name='left_foot', mass=0.5}]"
    true, file = models(part, "truth.joint_friction=0.7", "truth.armature=0.03")
    mass = {"torso": 1.2, "left_foot": 0.5}
    factors = [mass.get(file.body(i).name, 1.0) for i in range(file.nbody)]
    np.testing.assert_allclose(true.body_mass, file.body_mass * factors, rtol=1e-12)
    torso = file.body("torso").id
    np.testing.assert_allclose(true.body_ipos[torso] - file.body_ipos[torso], [0.02, 0.0, -0.01], atol=1e-12)
    np.testing.assert_allclose(true.dof_frictionloss, file.dof_frictionloss + np.repeat([0.0, 0.7], [6, 19]))
    np.testing.assert_allclose(true.dof_armature, file.dof_armature + np.repeat([0.0, 0.03], [6, 19]))


def test_servos_are_as_stiff_damped_and_strong_as_drawn():
    true, file = models("truth.strength=0.8", "truth.servo_stiffness=1.5", "truth.servo_damping=0.5", servos=60.0)
    np.testing.assert_allclose(true.actuator_gainprm[:, 0], 0.8 * 1.5 * file.actuator_gainprm[:, 0])
    np.testing.assert_allclose(true.actuator_biasprm[:, 1], 0.8 * 1.5 * file.actuator_biasprm[:, 1])
    np.testing.assert_allclose(true.actuator_biasprm[:, 2], 0.8 * 0.5 * file.actuator_biasprm[:, 2])
    np.testing.assert_allclose(true.actuator_forcerange, 0.8 * file.actuator_forcerange)
    with pytest.raises(InputError, match=r"truth.servo_damping: expected 1: the law commands torque"):
        models("truth.servo_damping=0.5")


def test_weak_motors_do_a_share_of_what_is_commanded_and_of_their_limit(tmp_path):
    law = law_of(tmp_path, IDLE.format("np.append(np.full(18, 10.0), 1e3)"))
    t = simulate(plan_of(named("h1"), (law, "truth.strength=0.7", "duration=0.005")).run(0))
    np.testing.assert_allclose(t.u, np.tile([7.0] * 18 + [0.7 * 18.0], (5, 1)))


def test_every_run_draws_its_own():
    plan = plan_of(named("h1"), ("randomise.runs=3", DRAW % '"truth.strength"={uniform=[0.8, 1.2]}, '
                                 '"actuation.delay"={uniform=[0.0, 0.02]}'))  # fmt: skip
    truths = [plan.run(i).scenario.truth.strength for i in range(3)]
    assert len(set(truths)) == 3
    assert all(0.8 <= one <= 1.2 for one in truths)
    assert len({plan.run(i).scenario.actuation.delay for i in range(3)}) == 3


def test_joints_lose_a_factor_of_what_the_file_says():
    true, file = models("truth.joint_losses=0.5", "truth.joint_damping=0.2", "truth.joint_friction=0.7")
    legs = slice(6, None)
    assert (file.dof_damping[legs] > 0.0).all()
    np.testing.assert_allclose(true.dof_damping[legs], 0.5 * (file.dof_damping[legs] + 0.2))
    np.testing.assert_allclose(true.dof_frictionloss[legs], 0.5 * (file.dof_frictionloss[legs] + 0.7))


def test_masses_are_drawn_for_every_run():
    """Each body's, within the share; the law's robot is the file's; the same run has the same masses."""
    plan, plain = plan_of("any/h1", ("randomise={runs=3, masses=0.1}",)), plan_of("any/h1", ("randomise={}",)).run(0)
    runs = [plan.run(i) for i in range(3)]
    factors = np.array([run.true_robot.masses for run in runs]) / plain.robot.masses
    assert np.abs(factors - 1.0).max() <= 0.1 + 1e-12
    assert np.abs(factors - 1.0).max() > 0.08
    assert len(np.unique(factors.round(12))) == factors.size
    assert runs[1].robot.masses == plain.robot.masses
    np.testing.assert_array_equal(plan.run(2).true_robot.masses, runs[2].true_robot.masses)


@pytest.mark.parametrize("name", ["any/h1", "level_normal"])
def test_a_push_in_weights_of_the_robot(name):
    force = [0.1] if name == "level_normal" else [0.1, -0.05]
    run = plan_of(
        name,
        (
            "randomise={}",
            f"push=[{{at=0.1, duration=0.1, force={[*force, 0.0]}, of='weight'}}]",
        ),
    ).run(0)
    weight = 9.81 * sum(run.robot.masses)
    assert run.scenario.push[0].force == pytest.approx([*(weight * one for one in force), 0.0], rel=1e-3)
    assert run.scenario.push[0].of == "si"


COUNTING = """    def __init__(self, setup):
        self.k = -1
    def torques(self, sensed):
        self.k += 1
        return np.full(19, 0.1 * self.k)
"""


def test_a_delay_of_three_ticks(tmp_path):
    """What is commanded first acts until the second arrives."""
    t = simulate(plan_of(named("h1"), (law_of(tmp_path, COUNTING), "actuation.delay=0.003", "duration=0.01")).run(0))
    np.testing.assert_allclose(t.u[:, 0], [0.1 * max(0, k - 3) for k in range(10)], atol=1e-12)


def test_a_delay_that_is_drawn_every_tick():
    """Between two and seven ticks, each as likely, and in order."""
    run = plan_of(named("h1"), ("actuation.delay=0.002", "actuation.delay_jitter=0.005")).run(0)
    latency = Latency(run)
    now = np.array([latency.pass_on(k, np.array([float(k)]))[0] for k in range(4000)])
    late = (np.arange(4000) - now)[10:]
    assert (np.diff(now) >= 0.0).all()
    # A later command that arrives by now replaces an earlier one: P(late <= 2 + j) = 1 - (1 - (j+1)/6) ... (1 - 1/6).
    still = np.cumprod(1.0 - np.arange(1, 7) / 6.0)
    for j in range(6):
        assert np.mean(late <= 2 + j) == pytest.approx(1.0 - still[j], abs=0.03)
    assert (late >= 2).all()


def test_seven_links_have_none_of_it():
    for change in (
        "truth.strength=0.8",
        "actuation.delay=0.002",
        "truth.armature=1.1",
        "truth.joint_losses=0.9",
        "randomise={masses=0.1}",
    ):
        with pytest.raises(InputError, match="belongs to robots of any kind"):
            plan_of("level_normal", (change,))
