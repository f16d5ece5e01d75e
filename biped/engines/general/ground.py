"""Forces of the ground, as MuJoCo's solver found them, on the contact points that are nearest to where they act."""

from __future__ import annotations

from typing import NamedTuple

import mujoco
import numpy as np

from biped.robot.robot import Robot

_PYRAMIDAL = int(mujoco.mjtCone.mjCONE_PYRAMIDAL)


class Forces(NamedTuple):
    """Of one step.

    Attributes:
        point: (P, 3) [N] on the contact points.
        total: (3,) [N] on the robot, its feet or other parts.
    """

    point: np.ndarray
    total: np.ndarray


class Ground:
    """Reads contacts with the ground.

    Args:
        model: What is stepped.
        data: Its state.
        robot: What it is.
        planes: Numbers of the geoms that are ground, where it is not level.
    """

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData, robot: Robot, planes: np.ndarray | None = None):
        self._model, self._data = model, data
        self._ground = np.zeros(model.ngeom, dtype=bool)
        self._ground[robot.ground if planes is None else planes] = True
        of_body = np.full(model.nbody, -1)
        for number, foot in enumerate(robot.feet):
            # Where the ground is not level geoms have other numbers than in the file.
            on = foot.bodies if planes is not None else [model.geom_bodyid[geom] for geom in foot.geoms]
            of_body[list(on)] = number
        self._foot = of_body[model.geom_bodyid]
        self._other = np.array([robot.of_foot != foot for foot in range(len(robot.feet))])
        self._pyramidal = model.opt.cone == _PYRAMIDAL
        self._at = self._nearest = np.empty(0, dtype=int)

    def touching(self, points: np.ndarray) -> np.ndarray:
        """(P,) whether each contact point, at points (P, 3) [m], is the nearest to a contact of its foot."""
        out = np.zeros(len(points), dtype=bool)
        contact = self._data.contact
        geoms = contact.geom
        ground = self._ground[geoms]
        feet = np.where(ground[:, 0], self._foot[geoms[:, 1]],
                        np.where(ground[:, 1], self._foot[geoms[:, 0]], -1))  # fmt: skip
        self._at = np.flatnonzero(feet >= 0)
        away = ((contact.pos[self._at, None] - points) ** 2).sum(axis=2)
        away[self._other[feet[self._at]]] = np.inf
        self._nearest = away.argmin(axis=1)
        out[self._nearest[contact.dist[self._at] <= 0.0]] = True
        return out

    def forces(self, size: int) -> Forces:
        """Forces of the latest step on so many points; `touching` was asked for it."""
        point, total = np.zeros((size, 3)), np.zeros(3)
        contact = self._data.contact
        count = len(contact.dist)
        if count:
            local, geoms = self._local(contact, count), contact.geom
            ground = self._ground[geoms]
            side = ground[:, 0] * 1.0 - ground[:, 1]
            force = side[:, None] * (local[:, None] @ contact.frame.reshape(-1, 3, 3))[:, 0]
            total = force.sum(axis=0)
            np.add.at(point, self._nearest, force[self._at])
        return Forces(point, total)

    def _local(self, contact, count: int) -> np.ndarray:
        """(count, 3) [N] on each contact's second geom, in the contact's frame."""
        local = np.zeros((count, 3))
        if self._pyramidal:
            one = np.empty(6)
            for i in range(count):
                mujoco.mj_contactForce(self._model, self._data, i, one)
                local[i] = one[:3]
        else:
            rows, forces = contact.efc_address, self._data.efc_force
            for i, size in enumerate(np.minimum(contact.dim, 3)):
                if rows[i] >= 0:
                    local[i, :size] = forces[rows[i] : rows[i] + size]
        return local
