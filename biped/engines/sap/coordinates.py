"""Coordinates and velocities as MuJoCo has them, and as a plant of Drake's has them.

They differ in their order and in a free base: Drake turns it by the world's axes and lists its orientation first.
"""

# pyright: reportMissingImports=false
from __future__ import annotations

from math import sqrt
from typing import Any

import mujoco
import numpy as np
from numpy.typing import ArrayLike
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import Joint

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
