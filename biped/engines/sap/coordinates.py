"""Coordinates and velocities as MuJoCo has them, and as a plant of Drake's has them.

They differ in their order and in a free base: Drake turns it by the world's axes and lists its orientation first.
"""

# pyright: reportMissingImports=false
from __future__ import annotations

import mujoco
import numpy as np
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import Joint

_FREE = mujoco.mjtJoint.mjJNT_FREE


class Coordinates:
    """Goes over from one to the other.

    Args:
        plant: Finished.
        m: The model that it was built from.
        joints: The plant's, by MuJoCo's number.
    """

    def __init__(self, plant: MultibodyPlant, m: mujoco.MjModel, joints: list[Joint]):
        self._nq = plant.num_positions()
        self._x = np.zeros(self._nq + plant.num_velocities())
        self._f = np.zeros(plant.num_velocities())
        plain = [j for j in range(m.njnt) if m.jnt_type[j] != _FREE]
        self._free = [
            (int(m.jnt_qposadr[j]), int(m.jnt_dofadr[j]), joints[j].position_start(), joints[j].velocity_start())
            for j in range(m.njnt) if m.jnt_type[j] == _FREE
        ]  # fmt: skip
        self.q, self.v = m.jnt_qposadr[plain].astype(int), m.jnt_dofadr[plain].astype(int)
        self.place = np.array([joints[j].position_start() for j in plain], dtype=int)
        self.column = np.array([joints[j].velocity_start() for j in plain], dtype=int)
        self._rate, self._reference = self._nq + self.column, m.qpos0[self.q]
        self._R = np.empty(9)

    def state(self, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """(nq + nv,) Drake's state; the same array at every call."""
        x = self._x
        x[self.place] = q[self.q] - self._reference
        x[self._rate] = v[self.v]
        for a, b, place, column in self._free:
            x[place : place + 4], x[place + 4 : place + 7] = q[a + 3 : a + 7], q[a : a + 3]
            at = self._nq + column
            x[at : at + 3], x[at + 3 : at + 6] = self._turn(q, a) @ v[b + 3 : b + 6], v[b : b + 3]
        return x

    def read(self, x: np.ndarray, q: np.ndarray, v: np.ndarray) -> None:
        """Writes MuJoCo's coordinates and velocities of a state of Drake's into q (nq,) and v (nv,)."""
        q[self.q] = x[self.place] + self._reference
        v[self.v] = x[self._rate]
        for a, b, place, column in self._free:
            q[a + 3 : a + 7] = x[place : place + 4] / np.sqrt(x[place : place + 4] @ x[place : place + 4])
            q[a : a + 3] = x[place + 4 : place + 7]
            at = self._nq + column
            v[b + 3 : b + 6], v[b : b + 3] = x[at : at + 3] @ self._turn(q, a), x[at + 3 : at + 6]

    def forces(self, q: np.ndarray, forces: np.ndarray) -> np.ndarray:
        """(nv,) generalized forces of Drake's from MuJoCo's; the same array at every call."""
        out = self._f
        out[self.column] = forces[self.v]
        for a, b, _, column in self._free:
            out[column : column + 3] = self._turn(q, a) @ forces[b + 3 : b + 6]
            out[column + 3 : column + 6] = forces[b : b + 3]
        return out

    def _turn(self, q: np.ndarray, a: int) -> np.ndarray:
        """(3, 3) orientation of the free body whose coordinates begin at a."""
        mujoco.mju_quat2Mat(self._R, q[a + 3 : a + 7])
        return self._R.reshape(3, 3)
