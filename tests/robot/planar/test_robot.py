"""The experimental robot: the numbers of Table 4.1, in both libraries, and what its description says of it."""

from __future__ import annotations

import mujoco
import numpy as np
import pinocchio
import pytest

from biped.base.files import folder
from biped.robot.planar.build import compile_foreign
from biped.robot.planar.description import description_at
from biped.robot.planar.model import tree_at
from biped.robot.planar.order import believed_model
from biped.robot.planar.topology import BASE, NQ, SHANK, THIGH
from biped.robot.planar.tree import Tree, true_tree
from biped.scenario.keys import Scenario, Truth
from biped.scenario.world import Ground

ROBOT = folder("models") / "robot.xml"
TREE = tree_at(ROBOT)
BODY = (0.185, 6.12, 0.0210)  # l_c [m] from the hip, m [kg], J_c [kg m²]
THIGHS, SHANKS, FEET = (0.147, 0.67, 0.0096), (0.140, 0.55, 0.0069), (0.36, 0.0007)
THIGH_LENGTH, SHANK_LENGTH = 0.295, 0.298
MOTOR, ROTOR = 0.84, 1.52e-5  # kg, kg m²
GEARS = (21, 12, 21)


def joined(*parts: tuple[float, float, float]) -> tuple[float, float, float]:
    """Mass, place and inertia of point masses and links on a line, given as (place, mass, inertia)."""
    mass = sum(m for _, m, _ in parts)
    centre = sum(x * m for x, m, _ in parts) / mass
    return mass, centre, sum(J + m * (x - centre) ** 2 for x, m, J in parts)


def test_links_are_table_4_1_with_the_motors_of_their_lower_joint():
    body = joined(BODY, (0.0, 2 * MOTOR, 0.0))
    thigh = joined(THIGHS, (THIGH_LENGTH, MOTOR, 0.0))
    shank = joined(SHANKS, (SHANK_LENGTH, MOTOR, 0.0))
    np.testing.assert_allclose(TREE.mass, [body[0], *[thigh[0], shank[0], FEET[0]] * 2], rtol=1e-12)
    np.testing.assert_allclose(TREE.inertia, [body[2], *[thigh[2], shank[2], FEET[1]] * 2], rtol=1e-12)
    np.testing.assert_allclose(TREE.joint[[*THIGH]], [[0.0, -body[1]]] * 2, atol=1e-13)
    np.testing.assert_allclose(TREE.joint[[*SHANK]], [[0.0, -THIGH_LENGTH]] * 2, atol=1e-13)
    np.testing.assert_allclose(TREE.joint[[3, 6]], [[0.0, -SHANK_LENGTH]] * 2, atol=1e-13)
    leg = [[0.0, -thigh[1]], [0.0, -shank[1]], [0.014, -0.035]]
    np.testing.assert_allclose(TREE.com, [[0.0, 0.0], *leg, *leg], atol=1e-13)
    np.testing.assert_allclose(TREE.point, [[0.137, -0.055], [-0.046, -0.055]] * 2, atol=1e-13)
    assert TREE.point[0, 0] - TREE.point[1, 0] == pytest.approx(0.183), "the foot's length"


def test_it_is_as_heavy_and_its_leg_as_long_as_printed():
    assert TREE.mass.sum() == pytest.approx(6.12 + 2 * (0.67 + 0.55 + 0.36) + 6 * 0.84, abs=1e-12)
    assert round(TREE.mass.sum(), 1) == 14.3
    assert TREE.leg == pytest.approx(0.648)
    assert round(0.53 / np.sqrt(9.81 * TREE.leg), 2) == 0.21, "the thesis's Froude number of 0.53 m/s"


def test_joints_have_reflected_inertia_and_the_damping_that_was_measured():
    np.testing.assert_allclose(TREE.armature, [0.0067, 0.0022, 0.0067] * 2)
    np.testing.assert_allclose(TREE.armature, np.square(GEARS * 2) * ROTOR, atol=5e-5)  # as printed
    np.testing.assert_allclose(TREE.damping, [0.13, 0.11, 0.05] * 2)


@pytest.mark.parametrize("slope", [0.0, 3.0])
def test_both_libraries_agree(slope):
    """M with reflected inertia and bias forces to 1e-12 of their scale in 200 random states."""
    model = compile_foreign(ROBOT, Scenario(model="robot", ground=Ground(slope=slope))).model
    data, theirs = mujoco.MjData(model), believed_model(ROBOT, slope)
    work, rng = theirs.createData(), np.random.default_rng(0)
    for q, v in zip(rng.uniform(-2.0, 2.0, (200, NQ)), rng.uniform(-5.0, 5.0, (200, NQ)), strict=True):
        data.qpos[:], data.qvel[:] = q, v
        mujoco.mj_forward(model, data)
        M = np.zeros((NQ, NQ))
        mujoco.mj_fullM(model, data, M)
        pinocchio.crba(theirs, work, q, pinocchio.Convention.WORLD)
        np.testing.assert_allclose(np.triu(work.M), np.triu(M), rtol=0, atol=1e-12 * np.abs(M).max())
        h = pinocchio.nonLinearEffects(theirs, work, q, v)
        np.testing.assert_allclose(h, data.qfrc_bias, rtol=0, atol=1e-12 * np.abs(h).max())


def motors_below() -> mujoco.MjModel:
    """The robot with every motor carried by the link below its joint instead of the one above."""
    spec = mujoco.MjSpec.from_file(str(ROBOT))

    def place(link: str, parts: tuple[float, float, float], ahead: float = 0.0) -> None:
        body = spec.body(link)
        body.mass, body.ipos = parts[0], [ahead, 0.0, parts[1]]
        body.inertia = [parts[2], parts[2], 1e-3]

    hip = joined(BODY, (0.0, 2 * MOTOR, 0.0))[1]
    place("torso", (BODY[1], BODY[0] - hip, BODY[2]))
    for side in ("right", "left"):
        mass, centre, inertia = joined(THIGHS, (0.0, MOTOR, 0.0))
        place(f"{side}_thigh", (mass, -centre, inertia))
        mass, centre, inertia = joined(SHANKS, (0.0, MOTOR, 0.0))
        place(f"{side}_shank", (mass, -centre, inertia))
        mass, share = FEET[0] + MOTOR, FEET[0] / (FEET[0] + MOTOR)
        inertia = FEET[1] + FEET[0] * MOTOR / mass * (0.014**2 + 0.035**2)
        place(f"{side}_foot", (mass, -0.035 * share, inertia), 0.014 * share)
    return spec.compile()


def test_which_link_carries_a_motor_changes_no_acceleration():
    above, below = compile_foreign(ROBOT, Scenario(model="robot")).model, motors_below()
    assert below.body_mass.sum() == pytest.approx(above.body_mass.sum(), abs=1e-12)
    assert not np.allclose(above.body_mass, below.body_mass)
    rng = np.random.default_rng(1)
    for _ in range(200):
        q, v, u = rng.uniform(-1.5, 1.5, NQ), rng.uniform(-5.0, 5.0, NQ), rng.uniform(-20.0, 20.0, NQ - BASE)
        q[1] = 5.0  # in the air
        found = []
        for model in (above, below):
            data = mujoco.MjData(model)
            data.qpos[:], data.qvel[:] = q, v
            data.qfrc_applied[BASE:] = u
            model.jnt_limited[:] = 0
            mujoco.mj_forward(model, data)
            found.append(data.qacc.copy())
        np.testing.assert_allclose(found[0], found[1], rtol=0, atol=1e-9 * np.abs(found[0]).max())


def test_what_was_a_humans_is_the_robots_in_units_of_weight_leg_and_froude_number():
    human, tree = description_at(folder("models") / "human.xml"), tree_at(folder("models") / "human.xml")
    robot, weight = description_at(ROBOT), TREE.mass.sum() / tree.mass.sum()
    length = TREE.leg / tree.leg
    ours, theirs = robot.scenario, human.scenario
    assert ours["actuation"]["release_force"] == pytest.approx(weight * theirs["actuation"]["release_force"], rel=2e-3)
    back, human_back = ours["backstep"], theirs["backstep"]
    assert back["k_d2"] == pytest.approx(weight * length * human_back["k_d2"], rel=2e-3)
    assert back["b_d2"] == pytest.approx(weight * length**1.5 * human_back["b_d2"], rel=2e-3)
    assert back["margin"] == pytest.approx(length * human_back["margin"], rel=1e-2)
    assert robot.walked.speed == pytest.approx(np.sqrt(length) * human.walked.speed, rel=2e-3)
    assert robot.walked.distance == pytest.approx(np.sqrt(length) * human.walked.distance, rel=2e-3)


def test_motors_are_what_their_data_sheet_makes_of_them():
    motor = description_at(ROBOT).motor
    assert motor is not None
    np.testing.assert_allclose(motor.stall[:3], [41.0, 23.0, 41.0], rtol=0.025)
    np.testing.assert_allclose(motor.free[:3], [38.0, 66.0, 38.0], rtol=0.01)
    np.testing.assert_allclose(motor.rated[:3], [3.0, 1.7, 3.0], rtol=0.02)
    # 7580 rpm without load, 2.42 N m held still: the sheet's own figures, of which the model knows neither.
    assert 24.0 / motor.torque_constant == pytest.approx(7580 * 2 * np.pi / 60, rel=2e-3)
    assert motor.torque_constant * 24.0 / motor.resistance == pytest.approx(2.42, rel=2e-3)


def test_a_mass_on_the_hips_axis_is_one_in_both_engines():
    truth = Truth(hip_mass=0.7)
    theirs = compile_foreign(ROBOT, Scenario(model="robot", truth=truth)).tree
    for ours, foreign in zip(true_tree(TREE, truth), theirs, strict=True):
        np.testing.assert_allclose(ours, foreign, atol=1e-12)
    assert theirs.mass.sum() == pytest.approx(TREE.mass.sum() + 0.7)
    # About the hip the torso's inertia is what it was.
    assert _about_hip(theirs) == pytest.approx(_about_hip(TREE))


def _about_hip(tree: Tree) -> float:
    arm = tree.com[0] - tree.joint[THIGH[0]]
    return float(tree.inertia[0] + tree.mass[0] * arm @ arm)
