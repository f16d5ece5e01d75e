"""Seven links in a plane, moved by Drake."""

from __future__ import annotations

from copy import copy
from dataclasses import replace

import mujoco
import numpy as np

from biped.engines.loop import drive
from biped.engines.planar.planes import lay, planes_of
from biped.engines.planar.plant import Physics, PlanarPlant
from biped.engines.sap.stepper import Stepper
from biped.measure.columns import FORCE, STOP
from biped.measure.trajectory import Trajectory
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
    stepper = Stepper(model, run.robot, ground.level, s.model, ledger=run.substeps > 1)
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
