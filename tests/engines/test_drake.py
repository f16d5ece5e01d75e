"""Drake as an engine: its equations against MuJoCo's and closed forms, its contacts, its audit, what it refuses."""

from __future__ import annotations

import builtins
from copy import copy

import mujoco
import numpy as np
import pinocchio
import pytest

from biped.base.errors import InputError
from biped.control.planar.estimator import ANGLE
from biped.ensemble.campaign import simulate
from biped.measure.metrics import assess
from biped.robot.planar.topology import KNEE, PITCH, Z
from biped.studies.run import plan_of

drake = pytest.importorskip("pydrake", reason="Drake is not installed")
from biped.engines.sap.stepper import Stepper  # noqa: E402
from tests.engines.steppers import disturbed, run_of, stepper_of  # noqa: E402

ROBOTS = ("upright/own", "robot/own", "spatial/own", "any/h1", "any/humanoid")


@pytest.mark.parametrize("name", ROBOTS)
def test_mass_matrix_and_bias_are_mujocos(name):
    stepper, _ = stepper_of(name)
    m = stepper.model
    data, c = mujoco.MjData(m), stepper.coordinates
    for seed in range(5):
        disturbed(stepper, seed)
        data.qpos[:], data.qvel[:] = stepper.q, stepper.v
        mujoco.mj_forward(m, data)
        theirs = np.empty((m.nv, m.nv))
        mujoco.mj_fullM(m, data, theirs)
        stepper.context.SetDiscreteState(c.state(stepper.q, stepper.v))
        ours = stepper.plant.CalcMassMatrix(stepper.context)
        # M of Drake's velocities from MuJoCo's, column by column.
        there = np.array([c.forces(row).copy() for row in theirs])
        there = np.array([c.forces(column).copy() for column in there.T]).T
        assert np.abs(ours - there).max() < 1e-12 * np.abs(there).max()


@pytest.mark.parametrize("name", ["upright/own", "spatial/own", "any/h1"])
def test_mass_matrix_is_pinocchios(name):
    """Built joint by joint from the same file, by neither MuJoCo's dynamics nor Drake's."""
    stepper, _ = stepper_of(name)
    theirs, columns = pinocchio_of(stepper.model)
    work, c = theirs.createData(), stepper.coordinates
    for seed in range(3):
        disturbed(stepper, seed)
        m, q, v = stepper.model, np.empty(theirs.nq), np.zeros((theirs.nv, stepper.model.nv))
        for j, (place, column) in columns.items():
            at, dof = m.jnt_qposadr[j], m.jnt_dofadr[j]
            if m.jnt_type[j] == mujoco.mjtJoint.mjJNT_FREE:
                q[place : place + 3] = stepper.q[at : at + 3]
                q[place + 3 : place + 7] = stepper.q[at + 3 : at + 7][ORDER]
                turn = np.empty(9)
                mujoco.mju_quat2Mat(turn, stepper.q[at + 3 : at + 7])
                v[column : column + 3, dof : dof + 3] = turn.reshape(3, 3).T  # MuJoCo's v of a base is the world's
                v[column + 3 : column + 6, dof + 3 : dof + 6] = np.eye(3)
            else:
                q[place], v[column, dof] = stepper.q[at] - m.qpos0[at], 1.0
        M = pinocchio.crba(theirs, work, q, pinocchio.Convention.LOCAL)
        M = v.T @ (np.triu(M) + np.triu(M, 1).T) @ v
        stepper.context.SetDiscreteState(c.state(stepper.q, stepper.v))
        ours = stepper.plant.CalcMassMatrix(stepper.context)
        there = np.array([c.forces(row).copy() for row in M])
        there = np.array([c.forces(column).copy() for column in there.T]).T
        assert np.abs(ours - there).max() < 1e-12 * np.abs(there).max()


ORDER = [1, 2, 3, 0]
"""Pinocchio's quaternions have their real part last."""


def pinocchio_of(m):
    """A compiled model as one of Pinocchio's, and the place in q and the column in v of each joint by its number."""
    out, columns, joint_of, place_of = pinocchio.Model(), {}, [0] * m.nbody, [pinocchio.SE3.Identity()] * m.nbody
    armature = []
    for b in range(1, m.nbody):
        parent, placed = joint_of[m.body_parentid[b]], se3(m.body_pos[b], m.body_quat[b])
        placed = place_of[m.body_parentid[b]] * placed
        for j in range(m.body_jntadr[b], m.body_jntadr[b] + m.body_jntnum[b]):
            if m.jnt_type[j] == mujoco.mjtJoint.mjJNT_FREE:
                kind, placed, at = pinocchio.JointModelFreeFlyer(), pinocchio.SE3.Identity(), np.zeros(3)
            elif m.jnt_type[j] == mujoco.mjtJoint.mjJNT_HINGE:
                kind, at = pinocchio.JointModelRevoluteUnaligned(m.jnt_axis[j]), m.jnt_pos[j]
            else:
                kind, at = pinocchio.JointModelPrismaticUnaligned(m.jnt_axis[j]), m.jnt_pos[j]
            shift = pinocchio.SE3(np.eye(3), np.array(at))
            columns[int(j)] = out.nq, out.nv
            parent = out.addJoint(parent, kind, placed * shift, f"joint {j}")
            armature += m.dof_armature[m.jnt_dofadr[j] : m.jnt_dofadr[j] + kind.nv].tolist()
            placed = shift.inverse()
        joint_of[b], place_of[b] = parent, placed
        turn = np.empty(9)
        mujoco.mju_quat2Mat(turn, m.body_iquat[b])
        R = turn.reshape(3, 3)
        inertia = pinocchio.Inertia(m.body_mass[b], m.body_ipos[b], R @ np.diag(m.body_inertia[b]) @ R.T)
        out.appendBodyToJoint(parent, inertia, placed)
    out.armature = np.array(armature)
    return out, columns


def se3(place, quaternion):
    turn = np.empty(9)
    mujoco.mju_quat2Mat(turn, quaternion)
    return pinocchio.SE3(turn.reshape(3, 3), np.array(place))


def test_free_flight_is_the_same_scheme_by_hand():
    stepper, _ = stepper_of("upright/own", "simulation.timestep=0.0001")
    disturbed(stepper, 1)
    m = stepper.model
    data = mujoco.MjData(m)
    q, v, M = stepper.q.copy(), stepper.v.copy(), np.empty((m.nv, m.nv))
    for _ in range(50):
        data.qpos[:], data.qvel[:] = q, v
        mujoco.mj_forward(m, data)
        mujoco.mj_fullM(m, data, M)
        v = v + m.opt.timestep * np.linalg.solve(M, -data.qfrc_bias)
        q = q + m.opt.timestep * v
        assert stepper.step() == []
    assert np.abs(stepper.q - q).max() < 1e-12
    assert np.abs(stepper.v - v).max() < 1e-11


def test_free_flight_converges_at_first_order():
    errors = []
    for timestep in (1e-3, 5e-4):
        stepper, _ = stepper_of("upright/own", f"simulation.timestep={timestep}")
        disturbed(stepper, 2)
        m = copy(stepper.model)  # which runs of the same scenario share
        m.opt.timestep, data = 1e-4, mujoco.MjData(m)
        m.opt.integrator = mujoco.mjtIntegrator.mjINT_RK4
        data.qpos[:], data.qvel[:] = stepper.q, stepper.v
        for _ in range(1000):
            mujoco.mj_step(m, data)
        for _ in range(round(0.1 / timestep)):
            stepper.step()
        errors.append(np.abs(stepper.q - data.qpos).max())
    assert errors[0] / errors[1] == pytest.approx(2.0, rel=0.05)


def test_a_knee_stop_holds_and_its_torque_is_found():
    stepper, _ = stepper_of("upright/own")
    disturbed(stepper, 4)
    stepper.v[:] = 0.0
    knee = KNEE[0]
    stepper.q[knee] = -0.01
    stepper.applied[knee] = 40.0  # towards the stop at 0
    torques = []
    for _ in range(200):
        stepper.step()
        torques.append(stepper.stop[knee])
    assert stepper.q[knee] < 1e-4
    assert stepper.q[knee] > -1e-3
    assert min(torques) < -10.0
    assert max(torques) <= 1e-9


def test_nothing_is_left_of_the_equations_of_motion_beside_the_stops(monkeypatch):
    left = []
    original = Stepper.residual

    def noted(self, columns):
        every = original(self, range(self.model.nv))
        left.append(np.delete(every, [column for _, _, column, *_ in self._stops]))
        return [every[i] for i in columns]

    monkeypatch.setattr(Stepper, "residual", noted)
    simulate(run_of("upright/own", "duration=1.0"))
    assert len(left) > 50
    assert np.abs(np.array(left)).max() < 1e-4  # of forces of 5 kN


@pytest.mark.parametrize("name", ["upright/own", "spatial/own", "any/h1"])
def test_energy_and_momentum_are_accounted_for(name):
    run = run_of(name, "duration=3.0")
    trajectory, numbers = assess(simulate(run), run.scenario.interval)
    assert trajectory.end == "completed"
    assert numbers["energy_residual"] < 1e-3
    assert numbers["momentum_residual"] < 1e-4
    assert numbers["verdict"] == "sound", numbers["doubt"]  # moments included
    weight = trajectory.mass * 9.81
    assert trajectory.ground_force[500:, 2].mean() == pytest.approx(weight, rel=0.05)


def test_what_is_left_of_the_energy_is_of_first_order_in_the_step():
    """It is the scheme's and not the ledger's: work by the step's own forces and mean velocity leaves out nothing."""
    left = []
    for rate in (1000, 2000):
        run = run_of(
            "upright/own", "duration=1.5", f"simulation.timestep={1 / rate}", f"simulation.control_rate={rate}"
        )
        left.append(assess(simulate(run), run.scenario.interval)[1]["energy_residual"])
    assert left[0] < 1e-3
    assert left[0] / left[1] == pytest.approx(2.0, rel=0.25)


def test_same_bytes_twice():
    run = run_of("upright/own", "duration=0.7")
    assert simulate(run).log.tobytes() == simulate(run).log.tobytes()


@pytest.mark.parametrize("change", ["ground.slope=3.0", "ground.steps={rise=0.01,run=0.5}"])
def test_ground_that_is_not_level(change):
    run = run_of("upright/own", change, "duration=4.0")
    trajectory = simulate(run)
    assert trajectory.end == "completed"
    assert trajectory.x[-1] > 1.0
    lowest = trajectory.above.min()
    assert -0.02 < lowest < 0.001


@pytest.mark.parametrize(("name", "changes"), [
    ("upright/own", ("truth.mass=[1.1,1,1,1,1,1,1]",)), ("upright/own", ("truth.joint_damping=2.0",)),
    ("upright/own", ("sensors.delay=0.004",)), ("upright/own", ("actuation.lag=0.005",)),
    ("any/h1", ("truth.strength=0.9",)), ("any/h1", ("actuation.delay=0.003",)),
    ("any/h1_walk", ("truth.joint_friction=2.0",)), ("any/h1_walk", ("truth.armature=0.05",)),
])  # fmt: skip
def test_the_truth_and_what_is_between_it_and_the_law_act_as_in_mujoco(name, changes):
    """Each of them leads the robot away from where it would be, in both engines to nearly the same place."""
    short, moved = ("duration=0.3", "window={start=0.1, end=0.3}", "push=[]", "randomise={}"), []
    for engine in ("mujoco", "drake"):
        plain, other = (simulate(plan_of(name, [*short, f"engine={engine}", *more]).run(0)).q[:120]
                        for more in ((), changes))  # fmt: skip
        moved.append(other - plain)
    there, here = moved
    assert np.linalg.norm(there) > 1e-4
    assert np.linalg.norm(here - there) < 0.3 * np.linalg.norm(there)


def test_an_estimator_infers_the_torsos_angle_from_drakes_contacts():
    sensors = ("estimator={}", "sensors.encoders={}", "sensors.gyro={}", "sensors.switches={}")
    trajectory = simulate(run_of("upright/own", "duration=0.6", "window={start=0.1, end=0.6}", *sensors))
    assert trajectory.end == "completed"
    missed = trajectory.inferred[10:, ANGLE] - trajectory.q[10:, PITCH]
    assert np.ptp(trajectory.q[10:, PITCH]) > np.radians(3.0)
    assert np.abs(missed).max() < np.radians(0.1)


def test_slow_control_is_accounted_for_by_the_engines_own_steps():
    run = run_of("upright/own", "simulation.control_rate=500", "duration=2.0")
    trajectory = simulate(run)
    assert trajectory.account is not None
    assert trajectory.account.shape == trajectory.time.shape


MODEL = """<mujoco><worldbody><geom type="plane" size="0 0 1"/>
  <body pos="0 0 1"><freejoint/><geom size="0.1" mass="5"/>
    <body pos="0 0.1 -0.3"><joint name="a" {joint}/><geom type="sphere" size="0.05" mass="1"/></body>
    <body pos="0 -0.1 -0.3"><joint name="b" axis="0 1 0"/><geom type="sphere" size="0.05" mass="1"/></body>
  </body></worldbody>{more}</mujoco>"""


@pytest.mark.parametrize(("joint", "more", "word"), [
    ('type="ball"', "", "ball joint 'a'"),
    ('axis="0 1 0"', '<equality><joint joint1="a" joint2="b"/></equality>', "equality constraints"),
    ('axis="0 1 0"', '<option density="1.2"/>', "air or water"),
    ('axis="0 1 0"', '<option><flag limit="disable"/></option>', r"disabled parts of the physics \(limit\)"),
])  # fmt: skip
def test_what_drake_has_not_is_refused_by_name(joint, more, word):
    from biped.engines.sap.tree import check_model

    with pytest.raises(InputError, match=word):
        check_model(mujoco.MjModel.from_xml_string(MODEL.format(joint=joint, more=more)), "it")


def test_without_drake_one_sentence_says_what_to_install(monkeypatch):
    original = builtins.__import__

    def none(name, *rest, **more):
        if name.partition(".")[0] == "pydrake":
            raise ModuleNotFoundError("No module named 'pydrake'", name="pydrake")
        return original(name, *rest, **more)

    run = run_of("upright/own", "duration=0.5")
    monkeypatch.setattr(builtins, "__import__", none)
    with pytest.raises(InputError, match=r"pip install drake"):
        simulate(run)


def test_a_seat_is_refused():
    with pytest.raises(InputError, match=r"ground\.seat\.height"):
        run_of("upright/own", "ground.seat.height=0.4")


def test_height_of_the_walker_is_that_of_mujoco_in_the_first_steps():
    run = run_of("upright/own", "duration=0.05")
    other = plan_of("upright/own", ["duration=0.05"]).run(0)
    assert np.abs(simulate(run).q[:, Z] - simulate(other).q[:, Z]).max() < 1e-4
