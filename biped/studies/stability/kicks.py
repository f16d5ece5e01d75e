"""Disturbances of a section state that a walker can have.

A point that stands on the ground keeps its height and velocity, a knee at its stop keeps angle and rate, and the right
heel stays on the section: a foot pressed into the ground would be answered by a force that no disturbance of a walker
makes, and a state off the section is no section state. What is left are the directions in which states differ.
"""

import numpy as np

from biped.base.errors import RunError
from biped.robot.planar.topology import KNEE, N_POINTS, NQ, PITCH, X, Z
from biped.robot.planar.tree import ABSOLUTE_FROM_JOINT, motion
from biped.studies.stability.section import RIGHT_HEEL, PoincareSection

LEAN, SPEED = PITCH, NQ + X
"""Torso's angle and forward velocity among the 18 absolute coordinates and velocities."""

# [rad] from its stop within which a knee is held.
_STRAIGHT = 0.01
_DIFFERENCE = 1e-6
_STEPS = 20
_TOLERANCE = 1e-12
_RANK = 1e-8
# Natural units of torso height that weigh as much as a radian: the torso goes where the legs carry it.
_TRAVEL = 100.0


class Kicks:
    """Disturbances of one section state.

    Args:
        section: The section.
        z: (17,) the state.

    Attributes:
        basis: (17, r) orthonormal admissible directions, natural units.
    """

    def __init__(self, section: PoincareSection, z: np.ndarray):
        self.section, self.z = section, z
        whole = section.whole(z)
        height = motion(section.tree, whole[:NQ], whole[NQ:]).point[:, 1]
        touching = height < section.run.scenario.sensing.contact_height
        self._points = [i for i in range(N_POINTS) if touching[i] and i != RIGHT_HEEL]
        self._knees = [j for j in KNEE if whole[j] > -_STRAIGHT]
        self._kept = self._values(z)
        rows = self._rows(z)
        _, s, directions = np.linalg.svd(rows)
        self.basis = directions[int((s > _RANK * s[0]).sum()) :].T

    def _values(self, z: np.ndarray) -> np.ndarray:
        """Invariants (…, m) of states (…, 17)."""
        whole = self.section.whole(z)
        moved = motion(self.section.tree, whole[..., :NQ], whole[..., NQ:])
        unit = self.section.unit
        held = [moved.point[..., RIGHT_HEEL, 1:] / unit[0]]
        held += [moved.point[..., i, 1:] / unit[0] for i in self._points]
        held += [moved.point_velocity[..., i, :] / unit[SPEED] for i in self._points]
        held += [whole[..., [j, NQ + j]] / unit[[j, NQ + j]] for j in self._knees]
        return np.concatenate(held, axis=-1)

    def _rows(self, z: np.ndarray) -> np.ndarray:
        """Derivative (m, 17) of what stays as it is."""
        e = _DIFFERENCE * np.eye(2 * NQ - 1)
        return ((self._values(z + e) - self._values(z - e)) / (2.0 * _DIFFERENCE)).T

    def along(self, direction: np.ndarray, size: float) -> np.ndarray:
        """The state moved by `size` along basis @ direction, direction (r,) of any length, and put back in place."""
        direction = self.basis @ direction
        return self._placed(self.z + size * direction / np.linalg.norm(direction), {})

    def random(self, size: float, rng: np.random.Generator) -> np.ndarray:
        """The state moved by normal numbers of standard deviation `size` in every admissible direction."""
        return self._placed(self.z + self.basis @ (size * rng.standard_normal(self.basis.shape[1])), {})

    def moved(self, lean: float, speed: float) -> np.ndarray:
        """The state with the torso leaning further forward and moving faster, all else as near as can be.

        Args:
            lean: [rad].
            speed: [m/s].

        Raises:
            RunError: The legs cannot follow.
        """
        absolute = self._absolute(self.z)
        wanted = {LEAN: absolute[LEAN] - lean, SPEED: absolute[SPEED] + speed / self.section.unit[SPEED]}
        return self._placed(self.z, wanted)

    def _absolute(self, z: np.ndarray) -> np.ndarray:
        """Absolute coordinates and velocities (18,) of a state, natural units."""
        whole = np.concatenate([[0.0], z])
        return np.concatenate([ABSOLUTE_FROM_JOINT @ whole[:NQ], ABSOLUTE_FROM_JOINT @ whole[NQ:]])

    def _placed(self, z: np.ndarray, wanted: dict[int, float]) -> np.ndarray:
        """The nearest state, by absolute angles and rates, with what is kept and what is wanted."""
        turn = np.zeros((2 * NQ, 2 * NQ))
        turn[:NQ, :NQ] = turn[NQ:, NQ:] = ABSOLUTE_FROM_JOINT
        weight = np.ones(2 * NQ)
        weight[[Z, NQ + X, NQ + Z]] = _TRAVEL
        step = (np.linalg.inv(turn) * weight)[1:, 1:]
        names = list(wanted)
        for _ in range(_STEPS):
            off = np.concatenate([self._values(z) - self._kept, self._absolute(z)[names] - list(wanted.values())])
            if np.abs(off).max() < _TOLERANCE:
                return z
            rows = np.vstack([self._rows(z), turn[names][:, 1:]])
            z = z - step @ (np.linalg.pinv(rows @ step, rcond=_RANK) @ off)
        raise RunError("the legs cannot follow this disturbance with the standing foot in place")
