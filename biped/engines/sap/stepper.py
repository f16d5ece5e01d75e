"""A plant of Drake's that is stepped in MuJoCo's coordinates, and what its contact solver found in a step.

Contacts, stops, dampers and servos are solved together and implicitly; everything else acts with its force at the
step's start. Positions follow with the velocity at its end, as in MuJoCo: this engine is independent in its contacts,
its stops and its code, and not in its integrator. Coordinates differ in their order and in a free base: Drake turns it
by the world's axes and lists its orientation first.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import sqrt
from typing import Any, NamedTuple

import mujoco
import numpy as np
from numpy.typing import ArrayLike
from pydrake.multibody.plant import AddMultibodyPlant, MultibodyPlant, MultibodyPlantConfig
from pydrake.multibody.tree import Joint, MultibodyForces
from pydrake.systems.framework import DiagramBuilder

from biped.engines.sap.contact import Builder
from biped.engines.sap.tree import JointTorques, add_tree, check_model, pose, stops_of
from biped.robot.robot import Robot

# pyright: reportMissingImports=false


_FREE = mujoco.mjtJoint.mjJNT_FREE


class Coordinates:
    """Goes over from one to the other.

    Args:
        plant: Finished.
        m: The model that it was built from.
        joints: The plant's, by MuJoCo's number.

    Attributes:
        q: Where hinges and slides are in MuJoCo's coordinates; a slice, where it can be one, since that costs less.
        v: Where they are in its velocities, likewise.
        column: Where they are in Drake's velocities, likewise.
        rates: (nv,) Drake's velocities in the latest `state`.
    """

    def __init__(self, plant: MultibodyPlant, m: mujoco.MjModel, joints: list[Joint]):
        nq, nv = plant.num_positions(), plant.num_velocities()
        self._x, self._f = np.zeros(nq + nv), np.zeros(nv)
        self.rates = self._x[nq:]
        plain = [j for j in range(m.njnt) if m.jnt_type[j] != _FREE]
        # Of each free joint: its places in q and v, in Drake's state and in its forces, and its orientation.
        self._free = [
            (*_parts(int(m.jnt_qposadr[j]), 3, 4), *_parts(int(m.jnt_dofadr[j]), 3, 3),
             *_parts(joints[j].position_start(), 4, 3), *_parts(nq + joints[j].velocity_start(), 3, 3),
             *_parts(joints[j].velocity_start(), 3, 3), np.empty((3, 3)))
            for j in range(m.njnt) if m.jnt_type[j] == _FREE
        ]  # fmt: skip
        self.q, self.v = _span(m.jnt_qposadr[plain]), _span(m.jnt_dofadr[plain])
        self.column = _span([joints[j].velocity_start() for j in plain])
        self._place = _span([joints[j].position_start() for j in plain])
        self._rate = _span([nq + joints[j].velocity_start() for j in plain])
        self._reference = m.qpos0[self.q]

    def state(self, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """(nq + nv,) Drake's state; the same array at every call."""
        x = self._x
        x[self._place] = q[self.q] - self._reference
        x[self._rate] = v[self.v]
        for place, turn, speed, spin, turned, placed, spinning, moving, _, _, R in self._free:
            mujoco.mju_quat2Mat(R.ravel(), q[turn])
            x[turned], x[placed], x[spinning], x[moving] = q[turn], q[place], R @ v[spin], v[speed]
        return x

    def read(self, x: np.ndarray, q: np.ndarray, v: np.ndarray) -> None:
        """Writes MuJoCo's coordinates and velocities of a state of Drake's into q (nq,) and v (nv,)."""
        q[self.q] = x[self._place] + self._reference
        v[self.v] = x[self._rate]
        for place, turn, speed, spin, turned, placed, spinning, moving, _, _, R in self._free:
            quaternion = x[turned]
            q[turn] = quaternion / sqrt(quaternion @ quaternion)
            q[place] = x[placed]
            mujoco.mju_quat2Mat(R.ravel(), q[turn])
            v[spin], v[speed] = x[spinning] @ R, x[moving]

    def forces(self, forces: np.ndarray) -> np.ndarray:
        """(nv,) Drake's generalized forces from MuJoCo's, in the latest `state`; the same array at every call."""
        out = self._f
        out[self.column] = forces[self.v]
        for _, _, speed, spin, _, _, _, _, moment, force, R in self._free:
            out[moment], out[force] = R @ forces[spin], forces[speed]
        return out


def _parts(start: int, one: int, other: int) -> tuple[slice, slice]:
    """Two slices, one after the other."""
    return slice(start, start + one), slice(start + one, start + one + other)


def _span(index: ArrayLike) -> Any:
    """An index array as a slice, if it counts up one by one."""
    out = np.array(index, dtype=int)
    consecutive = len(out) and np.array_equal(out, np.arange(out[0], out[0] + len(out)))
    return slice(int(out[0]), int(out[-1]) + 1) if consecutive else out


# pyright: reportMissingImports=false


_NEAR = 1e-6
"""[m, rad] from a stop within which it may push, whatever the speed."""


class PointForce(NamedTuple):
    """The ground's force at a contact in the latest step.

    Attributes:
        part: MuJoCo's number of the robot's geom.
        force: (3,) [N] of the ground.
        found: Drake's own record of it.
    """

    part: int
    force: np.ndarray
    found: Any

    @property
    def place(self) -> np.ndarray:
        """(3,) [m], read from Drake's record where somebody asks for it."""
        return self.found.contact_point()


class Stepper:
    """The physics of a run.

    Args:
        m: The model, compiled for the run.
        robot: What it is.
        level: Whether the ground is level.
        name: What the scenario calls the model.
        ledger: Whether work is summed.
        approximation: Drake's of contacts, `simulation.approximation`.

    Attributes:
        q: (nq,) coordinates, as MuJoCo has them.
        v: (nv,) velocities, likewise.
        applied: (nv,) generalized forces that act, likewise.
        target: (nu,) what actuators that are servos are told.
        torque: (njnt,) torques of servos at their joints in the latest step.
        stop: (nv,) forces of the stops in it.
        stopped: Whether there were any.
        work: [J] of everything but gravity and springs, summed until it is set back.
        given: [J] of actuators and pushes alone, likewise.
        energy: [J] at the start of the latest step that was measured.

    Raises:
        InputError: The model has what Drake has not.
    """

    def __init__(
        self, m: mujoco.MjModel, robot: Robot, level: bool, name: str, ledger: bool = True, approximation: str = "sap"
    ):
        check_model(m, name)
        self._ledger = ledger
        self.model, self._dt = m, float(m.opt.timestep)
        builder = DiagramBuilder()
        config = MultibodyPlantConfig(
            time_step=self._dt, use_sampled_output_ports=False, contact_model="point",
            discrete_contact_approximation=approximation, adjacent_bodies_collision_filters=False,
        )  # fmt: skip
        self.plant, scenes = AddMultibodyPlant(config, builder)
        plant, tree = self.plant, add_tree(self.plant, m)
        shapes = Builder(plant, m, tree.bodies, robot, level)
        self._meeting = shapes.register(scenes)
        plant.Finalize()
        self._diagram = builder.Build()
        self._root = self._diagram.CreateDefaultContext()
        self.context = context = plant.GetMyMutableContextFromRoot(self._root)
        self._bodies, self.coordinates = tree.bodies, Coordinates(plant, m, tree.joints)
        self.q, self.v, self.applied = np.array(m.qpos0), np.zeros(m.nv), np.zeros(m.nv)
        self.target, self.torque, self.stop = np.zeros(m.nu), np.zeros(m.njnt), np.zeros(m.nv)
        self.work = self.given = self.energy = 0.0
        self._pushes: list[tuple[int, np.ndarray]] = []
        nq, nv = plant.num_positions(), plant.num_velocities()
        self._mean = np.zeros(nv)
        # Drake's own arrays, of the forces that it reads and of the state that it finds.
        self._port = plant.get_applied_generalized_force_input_port().FixValue(context, np.zeros(nv))
        self._acting = self._port.GetMutableData().get_mutable_value().get_mutable_value()
        self._after = self._now = np.zeros(0)
        self._velocities = slice(nq, nq + nv)
        self._contacts = plant.get_contact_results_output_port()
        instance = tree.bodies[1].model_instance()
        self._contact_forces = plant.get_generalized_contact_forces_output_port(instance)
        self._joints = JointTorques(plant, m, tree, context)
        self._springs()
        damping = m.dof_damping if m.dof_damping.ndim == 1 else m.dof_damping[:, 0]
        self._damping = np.zeros(plant.num_velocities())
        self._damping[self.coordinates.column] = damping[self.coordinates.v]
        self._damped = bool(self._damping.any())
        # Of each joint with stops: its places in q, in v and in Drake's velocities, and its range.
        self._stops = [(int(m.jnt_qposadr[j]), int(m.jnt_dofadr[j]), tree.joints[j].velocity_start(),
                        *stops_of(m, j).tolist()) for j in np.flatnonzero(m.jnt_limited).tolist()]  # fmt: skip
        self._weight = MultibodyForces(plant)
        self.stopped, self._stop_forces = False, np.zeros(plant.num_velocities())
        context.SetDiscreteState(self.coordinates.state(self.q, self.v))

    def _springs(self) -> None:
        m, c = self.model, self.coordinates
        stiffness = m.jnt_stiffness if m.jnt_stiffness.ndim == 1 else m.jnt_stiffness[:, 0]
        self._stiffness, self._rest = stiffness[m.dof_jntid[c.v]], m.qpos_spring[c.q]
        self._sprung = bool(self._stiffness.any())

    def push(self, forces: np.ndarray) -> None:
        """Has forces (nbody - 1, 3) [N] act at the bodies' centres of mass from now on."""
        self._pushes = [(int(b) + 1, np.array(forces[b])) for b in np.flatnonzero(np.any(forces, axis=1))]

    def step(self, measured: bool = False) -> list[PointForce]:
        """Takes a step; returns its contacts with the ground.

        Args:
            measured: Whether `energy` is to be that of its start.
        """
        context, c, joints, acting = self.context, self.coordinates, self._joints, self._acting
        context.SetDiscreteState(c.state(self.q, self.v))  # without it Drake steps on the forces of the step before
        if measured:
            self.energy = self._energy()
        for geom, frame in self._meeting.planes:
            frame.SetPoseInParentFrame(context, pose(self.model.geom_pos[geom], self.model.geom_quat[geom]))
        given = c.forces(self.applied)
        for body, force in self._pushes:
            given += force @ self._jacobian(body)
        self.act(given)
        if self._sprung:
            acting[c.column] -= self._stiffness * (self.q[c.q] - self._rest)
        if joints.any:
            joints.command(self.target)
        update = self.plant.EvalUniquePeriodicDiscreteUpdate(context)
        if not self._after.size:
            self._after = update.get_vector().get_value()  # which is where it finds every later one, too
            self._now = self._after[self._velocities]
        now = self._now
        if joints.any:
            joints.read(context, now, self.torque)
        self._find_stops()
        if self._ledger:
            self._sum_work(given)
        out = self._ground_contacts()
        c.read(self._after, self.q, self.v)
        return out

    def _sum_work(self, given: np.ndarray) -> None:
        """Adds the work of the step, of which `given` are the generalized forces that were applied."""
        joints, now = self._joints, self._now
        step = np.add(self.coordinates.rates, now, self._mean)
        step *= 0.5 * self._dt
        if joints.any:
            given += joints.servo
            self.work += joints.friction.dot(step)
        self.given += (done := given.dot(step))
        self.work += done + self._contact_forces.Eval(self.context).dot(step)
        if self.stopped:
            self.work += self._stop_forces.dot(step)
        if self._damped:
            self.work -= (self._damping * now).dot(step)

    def act(self, forces: np.ndarray) -> None:
        """Has generalized forces (nv,) of Drake's act in its next step."""
        self._port.GetMutableData()  # without it Drake does not know that they change
        self._acting[:] = forces

    def _energy(self) -> float:
        """[J] kinetic, potential, and of springs, at the context's state, by Drake's own M."""
        out = self.plant.CalcKineticEnergy(self.context) + self.plant.CalcPotentialEnergy(self.context)
        if self._sprung:
            out += 0.5 * float(self._stiffness @ (self.q[self.coordinates.q] - self._rest) ** 2)
        return float(out)

    def _jacobian(self, body: int) -> np.ndarray:
        """(3, nv) of a body's centre of mass."""
        from pydrake.multibody.tree import JacobianWrtVariable

        plant, world = self.plant, self.plant.world_frame()
        return plant.CalcJacobianTranslationalVelocity(
            self.context, JacobianWrtVariable.kV, self._bodies[body].body_frame(), self.model.body_ipos[body],
            world, world,
        )  # fmt: skip

    def _find_stops(self) -> None:
        """Finds the stops' forces, which are in no port of Drake's: what is left of the equations of motion."""
        places, rates, dt, pushing = self.q.tolist(), self._now.tolist(), self._dt, []
        for q, v, column, low, high in self._stops:
            now = places[q]
            then = now + dt * rates[column]
            # Without min and max, whose calls would cost more than all the rest.
            before = now - low if now - low < high - now else high - now
            after = then - low if then - low < high - then else high - then
            if after <= _NEAR or after <= 0.6 * before:
                pushing.append((v, column))
        if self.stopped:
            self._stop_forces[:] = self.stop[:] = 0.0
        self.stopped = bool(pushing)
        if pushing:
            for (v, column), force in zip(pushing, self.residual([column for _, column in pushing]), strict=True):
                self.stop[v] = self._stop_forces[column] = force

    def residual(self, columns: Sequence[int]) -> list[float]:
        """Left of M Δv/Δt + C v − τ_g after all that has a port, in the latest step: forces of stops and nothing else.

        Args:
            columns: Numbers of Drake's velocities.
        """
        plant, context, now, acting, joints = self.plant, self.context, self._now, self._acting, self._joints
        plant.CalcForceElementsContribution(context, self._weight)
        needed = plant.CalcInverseDynamics(context, (now - self.coordinates.rates) / self._dt, self._weight)
        touching, damping = self._contact_forces.Eval(context), self._damping
        servo, friction = joints.servo, joints.friction
        return [needed[i] - acting[i] - touching[i] + damping[i] * now[i] - servo[i] - friction[i] for i in columns]

    def _ground_contacts(self) -> list[PointForce]:
        """The ground's contacts in the latest step, read with few calls, each of which costs a microsecond or two."""
        results, part, out = self._contacts.Eval(self.context), self._meeting.part, []
        for i in range(results.num_point_pair_contacts()):
            found = results.point_pair_contact_info(i)
            pair = found.point_pair()
            if (geom := part.get(pair.id_B.get_value())) is not None:
                out.append(PointForce(geom, found.contact_force(), found))
            elif (geom := part.get(pair.id_A.get_value())) is not None:
                out.append(PointForce(geom, -found.contact_force(), found))
        return out
