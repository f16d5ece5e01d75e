"""Start postures: named ones of the model, or nine absolute coordinates, projected onto the ground.

The captions of the thesis are printed to two digits and one of them leaves a foot 14 mm in the air, so a start is
projected: the least change of the nine coordinates (angles, with the torso free to move) that puts the contacts it
names on the ground, no other point below it and no knee beyond its stop.
"""

from __future__ import annotations

import numpy as np

from biped.base.errors import InputError
from biped.robot.tree import ABSOLUTE_FROM_JOINT, POINTS, Tree, motion

_KNEES = (4, 7)
_STEPS = 50
_TOLERANCE = 1e-12
# [rad] A link that must turn by more makes another posture, not a settled one.
_FURTHEST = 0.5
# Metres of torso travel that weigh as much as a radian: moving the torso is how a posture is put down, so it is cheap.
_TRAVEL = 100.0


def _heights(tree: Tree, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Heights (4,) [m] of the points and their Jacobian (4, 9)."""
    jacobian = motion(tree, np.broadcast_to(q, (9, 9)), np.eye(9)).point_velocity[..., 1].T
    return motion(tree, q, np.zeros(9)).point[..., 1], jacobian


def project(tree: Tree, q: np.ndarray, contacts: tuple[str, ...]) -> np.ndarray:
    """The nearest posture that stands on the ground z = 0 with the named contacts.

    Args:
        tree: Lengths of the biped.
        q: (9,) joint coordinates [m, rad].
        contacts: Names of points that touch; none: the lowest point touches.

    Returns:
        (9,) joint coordinates: named points at height 0 to 1e-12 m, the others not below it, no knee overstretched.

    Raises:
        InputError: The contacts cannot all be reached without turning a link by more than half a radian.
    """
    q = np.array(q, dtype=float)
    if not contacts:
        q[1] -= _heights(tree, q)[0].min()
        return q
    printed = q.copy()
    touching = [POINTS.index(name) for name in contacts]
    weight = np.ones(9)
    weight[:2] = _TRAVEL
    step = np.linalg.inv(ABSOLUTE_FROM_JOINT) * weight
    low: set[int] = set()
    straight: set[int] = set()
    for _ in range(_STEPS):
        height, jacobian = _heights(tree, q)
        low |= {i for i in range(4) if i not in touching and height[i] < -_TOLERANCE}
        straight |= {j for j in _KNEES if q[j] > _TOLERANCE}
        points = touching + sorted(low)
        stops = sorted(straight)
        residual = np.concatenate([height[points], q[stops]])
        if np.abs(residual).max() < _TOLERANCE:
            if np.abs(ABSOLUTE_FROM_JOINT @ (q - printed))[2:].max() > _FURTHEST:
                break
            return q
        rows = np.vstack([jacobian[points], np.eye(9)[stops]])
        q -= step @ (np.linalg.pinv(rows @ step, rcond=1e-9) @ residual)
    raise InputError(
        f"start.contacts: the posture cannot be put on the ground with {', '.join(contacts)} touching; "
        "expected contacts that the legs can reach, or start.settle = false",
        "start.contacts",
    )
