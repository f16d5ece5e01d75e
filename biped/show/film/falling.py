"""Falls are drawn to their end: a robot whose run ended in one drops with its motors off while the clip goes on."""

from copy import copy

import mujoco
import numpy as np

from biped.measure.trajectory import Trajectory

_SLOWED = 1.0
"""[N m s/rad] of joints without power."""


def fallen(run: Trajectory, model: mujoco.MjModel, q: np.ndarray, seconds: float) -> np.ndarray:
    """The coordinates of a robot that drops from where its run ended.

    Args:
        run: Its finite rows.
        model: What it is drawn with; it is not changed.
        q: (n, nq) its coordinates as the model has them.
        seconds: [s] for how long.

    Returns:
        (m, nq) its coordinates at every further tick.
    """
    limp = copy(model)
    limp.opt.timestep, steps = run.tick, round(seconds / run.tick)
    # Every part meets the ground, and no part another one: what is drawn may overlap at the joints.
    own, floor = limp.geom_bodyid > 0, limp.geom_type == mujoco.mjtGeom.mjGEOM_PLANE.value
    limp.geom_contype[:], limp.geom_conaffinity[:] = own, floor
    limp.geom_condim[:] = 3
    limp.dof_damping[:] = np.maximum(limp.dof_damping, np.where(limp.dof_bodyid > 1, _SLOWED, 0.0))
    data = mujoco.MjData(limp)
    back = min(10, len(q) - 1)
    data.qpos[:] = q[-1]
    if back:
        mujoco.mj_differentiatePos(limp, data.qvel, back * run.tick, q[-1 - back], q[-1])
    out = np.empty((steps, limp.nq))
    for row in out:
        mujoco.mj_step(limp, data)
        row[:] = data.qpos
    return out
