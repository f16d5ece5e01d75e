"""The walker's model: two libraries, one file, and the numbers of Table 3.1."""

from __future__ import annotations

import mujoco
import numpy as np
import pinocchio
import pytest

from biped.base.files import folder
from biped.engines.planar import mujoco as engine
from biped.ensemble.plan import Plan
from biped.robot.ground import gravity
from biped.robot.planar.build import compile_foreign
from biped.robot.planar.description import description_at
from biped.robot.planar.model import posture_of, tree_at
from biped.robot.planar.order import believed_model
from biped.robot.planar.tree import (
    ABSOLUTE_FROM_JOINT,
    ABSOLUTE_OFFSET,
    absolute,
    from_absolute,
    motion,
    true_tree,
)
from biped.scenario.keys import Scenario, Simulation, Start, Truth
from biped.scenario.world import Ground

HUMAN = folder("models") / "human.xml"
TREE = tree_at(HUMAN)
ROBOT = description_at(HUMAN)
HEIGHT, MASS = 1.8, 75.0
TABLE_3_1 = {  # l/L, l_c/l, m/M, r/l
    "torso": (0.288, 0.626, 0.678, 0.496),
    "thigh": (0.245, 0.433, 0.100, 0.323),
    "shank": (0.246, 0.433, 0.0465, 0.302),
    "foot": (0.152, 0.25, 0.0145, 0.475),
}


def configurations(count: int, seed: int = 0):
    rng = np.random.default_rng(seed)
    return rng.uniform(-2.0, 2.0, (count, 9)), rng.uniform(-5.0, 5.0, (count, 9))


@pytest.mark.parametrize("slope", [0.0, 5.0])
def test_both_libraries_agree(slope):
    """M, bias forces and point Jacobians to 1e-12 of their scale on 200 random configurations."""
    model = compile_foreign(HUMAN, Scenario(ground=Ground(slope=slope))).model
    data = mujoco.MjData(model)
    theirs = believed_model(HUMAN, slope)
    work = theirs.createData()
    for q, v in zip(*configurations(200), strict=True):
        data.qpos[:], data.qvel[:] = q, v
        mujoco.mj_forward(model, data)
        M = np.zeros((9, 9))
        mujoco.mj_fullM(model, data, M)
        pinocchio.crba(theirs, work, q, pinocchio.Convention.WORLD)
        np.testing.assert_allclose(np.triu(work.M), np.triu(M), rtol=0, atol=1e-12 * np.abs(M).max())
        h = pinocchio.nonLinearEffects(theirs, work, q, v)
        np.testing.assert_allclose(h, data.qfrc_bias, rtol=0, atol=1e-12 * np.abs(h).max())
        pinocchio.computeJointJacobians(theirs, work, q)
        pinocchio.updateFramePlacements(theirs, work)
        for point in ROBOT.points:
            J = np.zeros((3, 9))
            mujoco.mj_jacSite(model, data, J, None, model.site(point).id)
            frame = theirs.getFrameId(point)
            mine = pinocchio.getFrameJacobian(theirs, work, frame, pinocchio.LOCAL_WORLD_ALIGNED)[:3]
            np.testing.assert_allclose(mine, J, rtol=0, atol=1e-12 * np.abs(J).max())
            np.testing.assert_allclose(work.oMf[frame].translation, data.site(point).xpos, rtol=0, atol=1e-12)


def test_forward_kinematics_against_mujoco():
    model = compile_foreign(HUMAN, Scenario()).model
    data = mujoco.MjData(model)
    q, v = configurations(50, 1)
    whole = motion(TREE, q, v)
    for k in range(50):
        data.qpos[:], data.qvel[:] = q[k], v[k]
        mujoco.mj_forward(model, data)
        mujoco.mj_subtreeVel(model, data)
        centre = (TREE.mass[:, None] * whole.com[k]).sum(0) / TREE.mass.sum()
        speed = (TREE.mass[:, None] * whole.com_velocity[k]).sum(0) / TREE.mass.sum()
        np.testing.assert_allclose(centre, data.subtree_com[1, [0, 2]], atol=1e-12)
        np.testing.assert_allclose(speed, data.subtree_linvel[1, [0, 2]], atol=1e-11)
        for i, point in enumerate(ROBOT.points):
            J = np.zeros((3, 9))
            mujoco.mj_jacSite(model, data, J, None, model.site(point).id)
            np.testing.assert_allclose(whole.point[k, i], data.site(point).xpos[[0, 2]], atol=1e-12)
            np.testing.assert_allclose(whole.point_velocity[k, i], (J @ v[k])[[0, 2]], atol=1e-11)
        for i, link in enumerate(ROBOT.links):
            np.testing.assert_allclose(whole.com[k, i], data.body(link).xipos[[0, 2]], atol=1e-12)
            spin = np.zeros(6)
            mujoco.mj_objectVelocity(model, data, mujoco.mjtObj.mjOBJ_BODY, model.body(link).id, spin, 0)
            np.testing.assert_allclose(whole.rate[k, i], -spin[1], atol=1e-11)


def test_total_mass():
    assert TREE.mass.sum() == pytest.approx(75.0, abs=1e-12)
    assert sum(inertia.mass for inertia in believed_model(HUMAN, 0.0).inertias) == pytest.approx(75.0, abs=1e-9)


def test_numbers_follow_from_table_3_1():
    torso = TABLE_3_1["torso"]
    hip_below = torso[1] * torso[0] * HEIGHT
    thigh, shank, foot = (TABLE_3_1[name][0] * HEIGHT for name in ("thigh", "shank", "foot"))
    np.testing.assert_allclose(TREE.joint[[1, 4]], [[0.0, -hip_below]] * 2, atol=1e-12)
    np.testing.assert_allclose(TREE.joint[[2, 5]], [[0.0, -thigh]] * 2, atol=1e-12)
    np.testing.assert_allclose(TREE.joint[[3, 6]], [[0.0, -shank]] * 2, atol=1e-12)
    sole = 0.039 * HEIGHT
    np.testing.assert_allclose(TREE.point, [[0.75 * foot, -sole], [-0.25 * foot, -sole]] * 2, atol=1e-12)
    np.testing.assert_allclose(TREE.com[0], 0.0, atol=1e-12)
    np.testing.assert_allclose(TREE.com[[3, 6]], [[0.25 * foot, -sole / 2]] * 2, atol=1e-12)
    for i, link in enumerate(ROBOT.links):
        length, centre, mass, radius = TABLE_3_1[link.rpartition("_")[2]]
        length *= HEIGHT
        assert TREE.mass[i] == pytest.approx(mass * MASS, rel=1e-12)
        assert TREE.inertia[i] == pytest.approx(
            mass * MASS * (radius * length) ** 2, abs=5e-11
        )  # printed to ten decimals
        if link.endswith(("thigh", "shank")):
            np.testing.assert_allclose(TREE.com[i], [0.0, -centre * length], atol=1e-12)
    np.testing.assert_array_equal(TREE.armature, 0.0)


CAPTIONS = {
    "heel_toe": [0, 1.27, 1.57, 1.82, 1.78, 0.20, 1.31, 1.04, -0.35],  # Fig 3.4
    "flat": [0, 1.24, 1.50, 1.86, 1.86, 0.00, 1.23, 1.23, 0.00],  # Fig 3.5
    "single": [0, 1.25, 1.30, 1.75, 1.75, 0.00, 1.20, 1.20, 0.00],  # Fig 3.6
}
STANDS_ON = {"heel_toe": {"right_heel", "left_toe"}, "flat": set(ROBOT.points), "single": {"right_toe", "right_heel"}}


@pytest.mark.parametrize("name", CAPTIONS)
def test_start_postures_are_those_of_the_captions(name):
    q, contacts = posture_of(HUMAN, name)
    np.testing.assert_allclose(absolute(q), CAPTIONS[name], atol=1e-12)
    np.testing.assert_allclose(from_absolute(np.array(CAPTIONS[name])), q, atol=1e-12)
    assert set(contacts) == STANDS_ON[name]


def test_points_are_where_the_thesis_says():
    """hip = (x, y) - 0.626 l1 u(θ), knee = hip - l2 u(θ1), … with the caption of Fig 3.4."""
    x = np.array(CAPTIONS["heel_toe"])

    def u(t):
        return np.array([np.cos(t), np.sin(t)])

    def n(t):
        return np.array([-np.sin(t), np.cos(t)])

    hip = x[:2] - 0.626 * 0.288 * HEIGHT * u(x[2])
    foot, sole = 0.152 * HEIGHT, 0.039 * HEIGHT
    expected = []
    for thigh, shank, sole_angle in (x[3:6], x[6:9]):
        ankle = hip - 0.245 * HEIGHT * u(thigh) - 0.246 * HEIGHT * u(shank)
        expected.append(ankle + 0.75 * foot * u(sole_angle) - sole * n(sole_angle))
        expected.append(ankle - 0.25 * foot * u(sole_angle) - sole * n(sole_angle))
    there = motion(TREE, from_absolute(x), np.zeros(9)).point
    np.testing.assert_allclose(there, expected, atol=1e-12)
    assert abs(there[1, 1]) < 3e-3, "the heel of the front foot is on the ground to the caption's two digits"
    assert abs(there[2, 1]) < 3e-3, "and the toe of the back foot"


def test_absolute_coordinates_are_the_joint_definitions():
    """Hip θ1 - θ, knee θ2 - θ1, ankle θ3 - θ2 + π/2."""
    rng = np.random.default_rng(0)
    x = rng.normal(size=9)
    theta, t1, t2, t3, t4, t5, t6 = x[2:]
    half = np.pi / 2
    expected = [*x[:2], theta - half, t1 - theta, t2 - t1, t3 - t2 + half, t4 - theta, t5 - t4, t6 - t5 + half]
    np.testing.assert_allclose(from_absolute(x), expected, atol=1e-12)
    np.testing.assert_allclose(ABSOLUTE_FROM_JOINT @ np.array(expected) + ABSOLUTE_OFFSET, x, atol=1e-12)


def test_gravity_on_a_slope():
    assert gravity(0.0) == pytest.approx((0.0, -9.81))
    assert np.hypot(*gravity(5.0)) == pytest.approx(9.81)
    assert gravity(5.0)[0] < 0.0, "uphill is forward: gravity pulls back"


def test_visuals_cost_nothing_in_the_physics():
    """The model with and without what is only looked at moves the same, bit for bit."""
    ends = []
    for visuals in (False, True):
        model = compile_foreign(HUMAN, Scenario(), visuals).model
        data = mujoco.MjData(model)
        data.qpos[:] = Plan(Scenario(start=Start(posture="single"))).run(0).q
        for _ in range(300):
            data.ctrl[:] = [5.0, -3.0, 2.0, -5.0, -4.0, 1.0]
            mujoco.mj_step(model, data)
        ends.append((model.ngeom, data.qpos.copy(), data.qvel.copy()))
    assert ends[0][0] == 5 < ends[1][0]
    np.testing.assert_array_equal(ends[0][1], ends[1][1])
    np.testing.assert_array_equal(ends[0][2], ends[1][2])


def test_scenario_reaches_the_compiled_model():
    s = Scenario(ground=Ground(slope=3.0, friction=0.7, contact_time=0.01), simulation=Simulation(timestep=5e-4))
    model = compile_foreign(HUMAN, s).model
    np.testing.assert_allclose(model.opt.gravity, [gravity(3.0)[0], 0.0, gravity(3.0)[1]])
    assert model.opt.timestep == 5e-4
    np.testing.assert_array_equal(model.pair_friction[:, 0], 0.7)
    np.testing.assert_array_equal(model.pair_solref[:, 0], 0.01)
    assert model.opt.jacobian == mujoco.mjtJacobian.mjJAC_DENSE
    assert model.nsensor == 0


def test_a_different_truth_moves_the_engine_but_not_the_controller():
    truth = Truth(mass=(1.1, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0), length=(1.0, 1.05, 1.0, 1.0, 1.0, 1.0, 1.0))
    s = Scenario(truth=truth, duration=0.05)
    true = compile_foreign(HUMAN, s).tree
    np.testing.assert_allclose(true.mass, TREE.mass * np.array(truth.mass))
    for mine, theirs in zip(true_tree(TREE, truth), true, strict=True):
        np.testing.assert_allclose(mine, theirs, atol=1e-9)
    assert true.joint[2, 1] == pytest.approx(1.05 * TREE.joint[2, 1])
    run = Plan(s).run(0)
    assert engine.simulate(run).tree.mass[0] == pytest.approx(1.1 * 50.85)
    assert believed_model(run.model, 0.0).inertias[1].mass == pytest.approx(50.85)
