"""Any robot, moved by Drake; of seven links in a plane the law is the thesis's, of others it reads a MuJoCo state."""

from __future__ import annotations

from collections.abc import Callable
from copy import copy
from dataclasses import replace
from typing import Any

import mujoco
import numpy as np

from biped.base.jit import bound
from biped.engines.forces import Contacts, Solved, add_forces
from biped.engines.loop import drive
from biped.engines.planar.ground import lay, planes_of
from biped.engines.planar.plant import Physics, PlanarPlant
from biped.engines.plant import MujocoPlant
from biped.engines.sap.stepper import PointForce, Stepper
from biped.measure.trajectory import Trajectory
from biped.robot.columns import FORCE, STOP
from biped.robot.planar.topology import BASE, KNEE, N_STOPS, NQ
from biped.robot.robot import seven_links
from biped.robot.run import Run


def simulate_planar(run: Run) -> Trajectory:
    """Simulates a run; see `biped.engines.drake.simulate`."""
    s, ground = run.scenario, run.profile
    foreign = run.planar_model()
    order, robot = foreign.order, seven_links(run.robot)
    model = foreign.model if ground.level else copy(foreign.model)  # whose planes move
    # Of a tick of one step the log says all that its work is summed of.
    approximation = s.simulation.approximation
    stepper = Stepper(model, run.robot, ground.level, s.model, ledger=run.substeps > 1, approximation=approximation)
    mirror = None if ground.level else mujoco.MjData(model)
    planes = None if mirror is None else planes_of(model, mirror, robot, ground)
    q, v, joints = np.array(run.q), np.array(run.v), order.joints
    stepper.q[joints], stepper.v[joints] = q, v
    generalized = s.actuation.mode == "generalized"
    applied = np.zeros(NQ if generalized else NQ - BASE)
    acts = joints if generalized else joints[BASE:]
    limits = np.full(NQ, np.inf) if generalized else np.array(run.torque_limits)
    columns = {int(geom): 2 * point for point, geom in enumerate(order.points)}
    substeps, account, forces = run.substeps, np.zeros(run.ticks), np.zeros((model.nbody - 1, 3))
    share, nothing = 1.0 / substeps, [0.0] * (STOP - FORCE + N_STOPS)
    stops = [(STOP - FORCE + leg, int(joints[KNEE[leg]])) for leg in range(N_STOPS)]
    bounded = np.empty(applied.size)

    def push(pushes: np.ndarray) -> None:
        forces[:, [0, 2]] = pushes
        stepper.push(forces)

    def step(k: int, log: np.ndarray) -> None:
        means = nothing.copy()
        np.minimum(applied, limits, out=bounded)
        stepper.applied[acts] = np.maximum(bounded, -limits, out=bounded)
        stepper.work = stepper.given = 0.0
        for _ in range(substeps):
            if mirror is not None:
                mirror.qpos[:] = stepper.q
                mujoco.mj_kinematics(model, mirror)
                lay(planes, mirror.geom_xpos, order.points)
            for part, force, _ in stepper.step():
                at, (along, _, up) = columns[part], force.tolist()
                means[at] += share * along
                means[at + 1] += share * up
            if stepper.stopped:
                for column, joint in stops:
                    means[column] += share * stepper.stop[joint]
        log[k, FORCE : STOP + N_STOPS] = means
        account[k] = stepper.work
        q[:], v[:] = stepper.q[joints], stepper.v[joints]

    bodies = [model.body(i).name for i in range(1, model.nbody)]
    physics = Physics(foreign.tree, q, v, applied, bodies, push, step, None, dict)
    trajectory = drive(PlanarPlant(run, physics))
    return replace(trajectory, account=account[: len(trajectory)]) if substeps > 1 else trajectory


_MOST = 256
"""Contacts with the ground in a step."""


def simulate_any(run: Run) -> Any:
    """Simulates a run; see `biped.engines.drake.simulate`."""
    return drive(DrakePlant(run))


class DrakePlant(MujocoPlant):
    """The plant of a run (`biped.engines.loop.Plant`).

    Args:
        run: The run.
    """

    def __init__(self, run: Run):
        super().__init__(run)
        self.split = True  # nothing of MuJoCo's is integrated
        s, level = run.scenario, run.profile.level
        approximation = s.simulation.approximation
        self.stepper = stepper = Stepper(self.model, run.robot, level, s.model, approximation=approximation)
        stepper.q[:], stepper.v[:] = run.q, run.v
        self._energy, _ = self.columns["energy"]

    def push(self, forces: np.ndarray) -> None:
        """Has forces (bodies, 3) [N] act."""
        super().push(forces)
        self.stepper.push(forces)

    def _compiled(self) -> None:
        return None

    def _stepping(self) -> Callable[[int], None]:
        stepper, data, robot, state, uneven = self.stepper, self.data, self.robot, self.state, self.uneven
        generalized, direct, columns = self.command == "generalized", self.command == "torque", robot.columns
        found = _Found(self.contacts.now())
        forces, total, acting = np.zeros_like(state.point), np.zeros(6), np.zeros(6)
        model, com = self.model, data.subtree_com[robot.base_number]
        target = data.qfrc_applied if generalized else data.ctrl
        spare = np.zeros((len(forces) + 2, 3)), np.zeros(6)
        add = bound(add_forces, state.point, state.foot, *found.first(2), False, com, *spare, forces, total)
        driven = self.model.actuator_trnid[:, 0]
        torque, limited = np.zeros(len(robot.drives)), self.model.actuator_ctrllimited
        least, most = np.where(limited, self.model.actuator_ctrlrange.T, [[-np.inf], [np.inf]])
        substeps = self.run.substeps

        def step(k: int) -> None:
            forces[:], total[:], torque[:], acting[:] = 0.0, 0.0, 0.0, 0.0
            stepper.applied[:] = data.qfrc_applied
            if direct:
                stepper.applied[columns] += data.ctrl
            elif not generalized:
                np.minimum(np.maximum(data.ctrl, least), most, out=stepper.target)
            stepper.work = stepper.given = 0.0
            for substep in range(substeps):
                if substep:
                    data.qpos[:] = stepper.q
                    mujoco.mj_kinematics(model, data)
                    mujoco.mj_comPos(model, data)  # which moments are about
                    if uneven is not None:
                        uneven.lay()
                touching = found.of(stepper.step(measured=substep == 0))
                add(state.point, state.foot, *touching, False, com, *spare, forces, total)
                self._declare(target, acting)
                if not generalized:
                    np.add(torque, data.ctrl if direct else stepper.torque[driven], torque)
                if substep == 0:
                    self.log[k, self._energy] = stepper.energy
            data.qpos[:], data.qvel[:] = stepper.q, stepper.v
            self.log_step(k, forces, total[:3], torque, (stepper.work, stepper.given))
            self.outside[k, 3:] = (total + acting) / substeps

        return step


class _Found:
    """Drake's contacts as the kernel takes them that adds up the ground's forces.

    Args:
        example: Contacts of MuJoCo's, which say which geoms are ground and of which foot the others are.
    """

    def __init__(self, example: Contacts):
        # Laid out as MuJoCo's arrays are, with gaps between their rows.
        self._geoms, self._place = np.zeros((_MOST, 4), np.int32)[:, ::2], np.zeros((_MOST, 6))[:, ::2]
        self._gap, self._size = np.zeros((_MOST, 2))[:, 0], np.full((_MOST, 2), 3, np.int32)[:, 0]
        self._force, self._row = np.zeros(3 * _MOST), np.zeros((_MOST, 2), np.int32)[:, 0]
        self._axes, self._friction = np.zeros((_MOST, 18))[:, ::2], np.zeros((_MOST, 10))[:, ::2]
        self._row[:], self._axes[:] = 3 * np.arange(_MOST), np.eye(3).ravel()
        self._ground, self._foot = example.is_ground, example.foot
        self._geoms[:, 0] = int(np.flatnonzero(self._ground)[0])

    def of(self, contacts: list[PointForce]) -> tuple[Contacts, Solved]:
        """Contacts and their forces, along the world's axes."""
        for i, contact in enumerate(contacts):
            self._geoms[i, 1], self._place[i] = contact.part, contact.place
            self._force[3 * i : 3 * i + 3] = contact.force
        return self.first(len(contacts))

    def first(self, n: int) -> tuple[Contacts, Solved]:
        """The first n; an example for compiling has two, since numpy calls arrays of fewer laid out without gaps."""
        return (
            Contacts(self._geoms[:n], self._place[:n], self._gap[:n], self._gap[:n], self._ground, self._foot),
            Solved(self._force, self._row[:n], self._size[:n], self._axes[:n], self._friction[:n]),
        )
