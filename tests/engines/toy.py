"""A toy engine, as an example: seven links that fly, without ground, by semi-implicit Euler and MuJoCo's M alone.

It is all that an engine must be: a module with `simulate(run)`. The test beside it enters it in the list of engines.
"""

from __future__ import annotations

import mujoco
import numpy as np

from biped.engines.loop import drive
from biped.engines.planar.plant import Physics, PlanarPlant
from biped.measure.trajectory import Trajectory
from biped.robot.planar.build import compile_foreign
from biped.robot.planar.topology import BASE, NQ
from biped.robot.run import Run


def simulate(run: Run) -> Trajectory:
    """Simulates a run of seven links, which nothing holds."""
    foreign = compile_foreign(run.model, run.scenario)
    model, joints, data = foreign.model, foreign.order.joints, mujoco.MjData(foreign.model)
    q, v, applied = np.array(run.q), np.array(run.v), np.zeros(NQ - BASE)
    M, force, period = np.empty((NQ, NQ)), np.zeros(NQ), run.scenario.simulation.timestep

    def push(forces: np.ndarray) -> None:
        """Nobody can push it."""

    def step(k: int, log: np.ndarray) -> None:
        """Moves it through tick k; the ground's forces in the log stay zero."""
        for _ in range(run.substeps):
            data.qpos[joints], data.qvel[joints] = q, v
            mujoco.mj_fwdPosition(model, data)
            mujoco.mj_fwdVelocity(model, data)
            mujoco.mj_fullM(model, data, M)
            force[joints[BASE:]] = applied
            v[:] += period * np.linalg.solve(M, force - data.qfrc_bias)[joints]
            q[:] += period * v

    bodies = [model.body(i).name for i in range(1, model.nbody)]
    return drive(PlanarPlant(run, Physics(foreign.tree, q, v, applied, bodies, push, step, None, dict)))
