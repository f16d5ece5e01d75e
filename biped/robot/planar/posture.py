"""Start postures: named ones of the model, or nine absolute coordinates, projected onto the ground.

The captions of the thesis are printed to two digits and one of them leaves a foot 14 mm in the air, so a start is
projected: the least change of the nine coordinates (angles, with the torso free to move) that puts the contacts it
names on the ground, no other point below it and no knee beyond its stop.
"""

from pathlib import Path

import numpy as np

from biped.base.errors import InputError, safe
from biped.base.files import nearest
from biped.robot.planar.model import posture_of
from biped.robot.planar.topology import KNEE, N_ANGLES, N_POINTS, NQ, PITCH, Z
from biped.robot.planar.tree import ABSOLUTE_FROM_JOINT, SevenLinks, Tree, absolute, from_absolute, motion, true_tree
from biped.scenario.keys import GIVES_WAY, Scenario, Start

MOST_STARTS = 256
"""Most start postures that are remembered at a time."""
_STEPS = 50
_TOLERANCE = 1e-12
# [rad] A link that must turn by more makes another posture, not a settled one.
_FURTHEST = 0.5
# Metres of torso travel that weigh as much as a radian: moving the torso is how a posture is put down, so it is cheap.
_TRAVEL = 100.0


def _heights(tree: Tree, q: np.ndarray) -> np.ndarray:
    """Heights (4,) [m] of the points."""
    return motion(tree, q, np.zeros(NQ)).point[..., 1]


def _jacobian(tree: Tree, q: np.ndarray) -> np.ndarray:
    """Of the heights, (4, 9)."""
    return motion(tree, np.broadcast_to(q, (NQ, NQ)), np.eye(NQ)).point_velocity[..., 1].T


def project(tree: Tree, q: np.ndarray, contacts: tuple[str, ...], points: tuple[str, ...]) -> np.ndarray:
    """The nearest posture that stands on the ground z = 0 with the named contacts.

    Args:
        tree: Lengths of the biped.
        q: (9,) joint coordinates [m, rad].
        contacts: Names of points that touch; none: the lowest point touches.
        points: Names of the robot's points.

    Returns:
        (9,) joint coordinates: named points at height 0 to 1e-12 m, the others not below it, no knee overstretched.

    Raises:
        InputError: The contacts cannot all be reached without turning a link by more than half a radian.
    """
    q = np.array(q, dtype=float)
    if not contacts:
        q[Z] -= _heights(tree, q).min()
        return q
    printed = q.copy()
    touching = [points.index(name) for name in contacts]
    weight = np.ones(NQ)
    weight[: Z + 1] = _TRAVEL
    step = np.linalg.inv(ABSOLUTE_FROM_JOINT) * weight
    low: set[int] = set()
    straight: set[int] = set()
    for _ in range(_STEPS):
        height = _heights(tree, q)
        low |= {i for i in range(N_POINTS) if i not in touching and height[i] < -_TOLERANCE}
        straight |= {j for j in KNEE if q[j] > _TOLERANCE}
        standing = touching + sorted(low)
        stops = sorted(straight)
        residual = np.concatenate([height[standing], q[stops]])
        if np.abs(residual).max() < _TOLERANCE:
            if np.abs(ABSOLUTE_FROM_JOINT @ (q - printed))[Z + 1 :].max() > _FURTHEST:
                break
            return q
        rows = np.vstack([_jacobian(tree, q)[standing], np.eye(NQ)[stops]])
        try:
            q -= step @ (np.linalg.pinv(rows @ step, rcond=1e-9) @ residual)
        except np.linalg.LinAlgError:  # lengths beyond all measure
            break
    raise InputError(
        f"start.contacts: the posture cannot be put on the ground with {', '.join(contacts)} touching; "
        "expected contacts that the legs can reach, or start.settle = false",
        "start.contacts",
    )


class PlanarStarts:
    """Start postures of seven links in a plane; each is projected once.

    Args:
        path: The model file.
        links: The seven links in it.
    """

    def __init__(self, path: Path, links: SevenLinks):
        self._path, self._links = path, links
        self._settled: dict[tuple[Start, tuple[float, ...]], np.ndarray] = {}

    def start(self, s: Scenario, noise: np.random.Generator | None) -> tuple[np.ndarray, np.ndarray]:
        """Joint coordinates (9,) and velocities (9,) that a run starts with.

        Args:
            s: Its scenario.
            noise: Draws the deviations of its angles; None: there are none.

        Raises:
            InputError: There is no such keyframe, or the biped cannot stand so.
        """
        q = self._posture(s)
        if noise is not None:
            knees, turned = [*KNEE], absolute(q)
            turned[PITCH:] += s.start.jitter * noise.standard_normal(N_ANGLES)
            most = np.maximum(q[knees], GIVES_WAY)
            q = from_absolute(turned)
            q[knees] = np.minimum(q[knees], most)
            if s.start.settle:
                q = project(true_tree(self._links.tree, s.truth), q, (), self._links.points)
        return q, np.linalg.solve(ABSOLUTE_FROM_JOINT, np.array(s.start.v))

    def foremost(self, s: Scenario) -> float:
        """[m] the foremost contact point of the start without deviations."""
        tree = true_tree(self._links.tree, s.truth)
        return float(motion(tree, self._posture(s), np.zeros(NQ)).point[..., 0].max())

    def _posture(self, s: Scenario) -> np.ndarray:
        start, points = s.start, self._links.points
        key = start, s.truth.length
        if key not in self._settled:
            if start.q is not None:
                q, contacts = from_absolute(np.array(start.q)), ()
            else:
                q, contacts = posture_of(self._path, start.posture)
            contacts = contacts if start.contacts is None else start.contacts
            for name in contacts:
                if name not in points:
                    raise InputError(
                        f"start.contacts: '{safe(name)}' is no contact point; {nearest(name, list(points))}",
                        "start.contacts",
                    )
            if len(self._settled) >= MOST_STARTS:
                self._settled.clear()
            tree = true_tree(self._links.tree, s.truth)
            self._settled[key] = project(tree, q, contacts, points) if start.settle else q
        return self._settled[key]
