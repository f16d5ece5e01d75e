"""Forces of the ground, as MuJoCo's solver found them, on the contact points that are nearest to where they act."""

from __future__ import annotations

from typing import NamedTuple

import mujoco
import numpy as np

from biped.robot.general.facts import General

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
    """

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData, robot: General):
        self._model, self._data = model, data
        self._ground, self._of_foot = robot.ground, robot.of_foot
        self._foot_of_body = np.full(model.nbody, -1)
        for number, foot in enumerate(robot.feet):
            for geom in foot.geoms:
                self._foot_of_body[model.geom_bodyid[geom]] = number
        self._near = [np.flatnonzero(self._of_foot == foot) for foot in range(len(robot.feet))]
        self._pyramidal = model.opt.cone == _PYRAMIDAL

    def touching(self, points: np.ndarray) -> np.ndarray:
        """(P,) whether each contact point, at points (P, 3) [m], is the nearest to a contact."""
        out = np.zeros(len(points), dtype=bool)
        contact = self._data.contact
        if len(contact.dist):
            for point, _ in self._assigned(contact, points, contact.dist <= 0.0):
                out[point] = True
        return out

    def forces(self, points: np.ndarray) -> Forces:
        """Forces of the latest step, on points (P, 3) [m] as they were in it."""
        point, total = np.zeros((len(points), 3)), np.zeros(3)
        contact = self._data.contact
        if not len(contact.dist):
            return Forces(point, total)
        force = self._contact_forces(contact)
        geoms = contact.geom
        side = np.where(geoms[:, 0] == self._ground, 1.0, np.where(geoms[:, 1] == self._ground, -1.0, 0.0))
        force *= side[:, None]
        total = force.sum(axis=0)
        for number, i in self._assigned(contact, points, contact.efc_address >= 0):
            point[number] += force[i]
        return Forces(point, total)

    def _assigned(self, contact, points: np.ndarray, counts: np.ndarray) -> list[tuple[int, int]]:
        """(contact point, contact) of every contact of a foot with the ground that counts."""
        found = []
        geoms, places = contact.geom, contact.pos
        for i in np.flatnonzero(counts & (geoms == self._ground).any(axis=1)):
            first, second = geoms[i]
            foot = self._foot_of_body[self._model.geom_bodyid[second if first == self._ground else first]]
            if foot >= 0:
                near = self._near[foot]
                found.append((int(near[np.argmin(((points[near] - places[i]) ** 2).sum(axis=1))]), int(i)))
        return found

    def _contact_forces(self, contact) -> np.ndarray:
        """(ncon, 3) [N] on each contact's second geom."""
        n = len(contact.dist)
        local = np.zeros((n, 3))
        if self._pyramidal:
            one = np.empty(6)
            for i in range(n):
                mujoco.mj_contactForce(self._model, self._data, i, one)
                local[i] = one[:3]
        else:
            rows, sizes, forces = contact.efc_address, np.minimum(contact.dim, 3), self._data.efc_force
            for i in range(n):
                if rows[i] >= 0:
                    local[i, : sizes[i]] = forces[rows[i] : rows[i] + sizes[i]]
        return np.einsum("nij,ni->nj", contact.frame.reshape(-1, 3, 3), local)
