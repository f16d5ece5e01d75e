"""The energy of seven links in any configurations, written down apart from the package's own pass over rows."""

from __future__ import annotations

import numpy as np

from biped.robot.ground import gravity
from biped.robot.planar.topology import BASE
from biped.robot.planar.tree import Tree, motion


def energy(tree: Tree, q: np.ndarray, v: np.ndarray, slope: float) -> np.ndarray:
    """Kinetic and potential energy [J] of configurations (…, 9)."""
    m = motion(tree, q, v)
    kinetic = 0.5 * (tree.mass * (m.com_velocity**2).sum(axis=-1)).sum(axis=-1)
    kinetic += 0.5 * (tree.inertia * m.rate**2).sum(axis=-1) + 0.5 * (tree.armature * v[..., BASE:] ** 2).sum(axis=-1)
    potential = -(tree.mass * (m.com @ np.array(gravity(slope)))).sum(axis=-1)
    return kinetic + potential
