"""A plant of Drake's that is stepped in MuJoCo's coordinates, and what its contact solver found in a step.

Contacts, stops, dampers and servos are solved together and implicitly (SAP); everything else acts with its force at the
step's start. Positions follow with the velocity at its end, as in MuJoCo: this engine is independent in its contacts,
its stops and its code, and not in its integrator.
"""

# pyright: reportMissingImports=false
from __future__ import annotations

from typing import NamedTuple

import mujoco
import numpy as np
from pydrake.multibody.plant import AddMultibodyPlant, MultibodyPlantConfig
from pydrake.systems.framework import DiagramBuilder

from biped.engines.sap.contact import Builder
from biped.engines.sap.coordinates import Coordinates
from biped.engines.sap.joints import JointTorques
from biped.engines.sap.refused import check_model
from biped.engines.sap.tree import add_tree, pose
from biped.robot.robot import Robot

_NEAR = 1e-6
"""[m, rad] from a stop within which it may push, whatever the speed."""


class PointForce(NamedTuple):
    """The ground's force at a contact in the latest step.

    Attributes:
        part: MuJoCo's number of the robot's geom.
        place: (3,) [m].
        force: (3,) [N] of the ground.
    """

    part: int
    place: np.ndarray
    force: np.ndarray


class Stepper:
    """The physics of a run.

    Args:
        m: The model, compiled for the run.
        robot: What it is.
        level: Whether the ground is level.
        name: What the scenario calls the model.

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

    def __init__(self, m: mujoco.MjModel, robot: Robot, level: bool, name: str):
        check_model(m, name)
        self.model, self._dt = m, float(m.opt.timestep)
        builder = DiagramBuilder()
        config = MultibodyPlantConfig(
            time_step=self._dt, use_sampled_output_ports=False, contact_model="point",
            discrete_contact_approximation="sap", adjacent_bodies_collision_filters=False,
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
        self._nq = plant.num_positions()
        self._before, self._mean, self._given = (np.zeros(plant.num_velocities()) for _ in range(3))
        port = plant.get_applied_generalized_force_input_port()
        self._fixed = port.FixValue(context, np.zeros(plant.num_velocities()))
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
                        *m.jnt_range[j].tolist()) for j in np.flatnonzero(m.jnt_limited)]  # fmt: skip
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
        plant, context, c, m = self.plant, self.context, self.coordinates, self.model
        state, before, step, given = c.state(self.q, self.v), self._before, self._mean, self._given
        before[:] = state[self._nq :]
        context.SetDiscreteState(state)  # without it Drake steps on the forces of the step before
        if measured:
            self.energy = self._energy()
        for geom, frame in self._meeting.planes:
            frame.SetPoseInParentFrame(context, pose(m.geom_pos[geom], m.geom_quat[geom]))
        given[:] = c.forces(self.q, self.applied)
        for body, force in self._pushes:
            given += force @ self._jacobian(body)
        acting = given.copy()
        if self._sprung:
            acting[c.column] -= self._stiffness * (self.q[c.q] - self._rest)
        self._fixed.GetMutableData().get_mutable_value().SetFromVector(acting)
        if self._joints.any:
            self._joints.command(self.target)
        after = plant.EvalUniquePeriodicDiscreteUpdate(context).get_vector().get_value()
        now = after[self._nq :]
        touching = self._contact_forces.Eval(context)
        np.add(before, now, step)
        step *= 0.5 * self._dt
        if self._joints.any:
            self._joints.read(context, now, self.torque)
            given += self._joints.servo
            self.work += float(self._joints.friction @ step)
        self.given += (done := float(given @ step))
        self.work += done + float(touching @ step)
        if self._find_stops(after, before, acting, touching):
            self.work += float(self._stop_forces @ step)
        if self._damped:
            self.work -= float((self._damping * now) @ step)
        out = self._ground_contacts()
        c.read(after, self.q, self.v)
        return out

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

    def _find_stops(self, after: np.ndarray, before: np.ndarray, acting: np.ndarray, touching: np.ndarray) -> bool:
        """Finds the stops' forces, which are in no port of Drake's: what is left of the equations of motion.

        Returns:
            Whether any stop pushes.
        """
        places, rates, dt, pushing = self.q.tolist(), after.tolist(), self._dt, []
        for q, v, column, low, high in self._stops:
            now = places[q]
            then = now + dt * rates[self._nq + column]
            if min(then - low, high - then) <= max(0.6 * min(now - low, high - now), _NEAR):
                pushing.append((v, column))
        if self.stopped:
            self._stop_forces[:] = self.stop[:] = 0.0
        self.stopped = bool(pushing)
        if pushing:
            left = self.residual(after, before, acting, touching)
            for v, column in pushing:
                self.stop[v] = self._stop_forces[column] = left[column]
        return self.stopped

    def residual(self, after: np.ndarray, before: np.ndarray, acting: np.ndarray, touching: np.ndarray) -> np.ndarray:
        """(nv,) what M Δv/Δt + C v − τ_g leaves after all that has a port: stops, and otherwise nothing.

        Args:
            after: (nq + nv,) state at the end of the step.
            before: (nv,) velocities at its start.
            acting: (nv,) generalized forces that were applied.
            touching: (nv,) of contacts.
        """
        plant, context = self.plant, self.context
        now = after[len(after) - len(before) :]
        M = plant.CalcMassMatrix(context)
        bias = plant.CalcBiasTerm(context) - plant.CalcGravityGeneralizedForces(context)
        out = M @ ((now - before) / self._dt) + bias - acting - touching + self._damping * now
        return out - self._joints.servo - self._joints.friction

    def _ground_contacts(self) -> list[PointForce]:
        found, part, out = self._contacts.Eval(self.context), self._meeting.part, []
        for i in range(found.num_point_pair_contacts()):
            info = found.point_pair_contact_info(i)
            pair = info.point_pair()
            first, second = part.get(pair.id_A.get_value()), part.get(pair.id_B.get_value())
            if first is None and second is not None:  # the ground is no part of the robot
                out.append(PointForce(second, info.contact_point(), info.contact_force()))
            elif first is not None and second is None:
                out.append(PointForce(first, info.contact_point(), -info.contact_force()))
        return out
