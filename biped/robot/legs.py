"""Chains of bodies between the base and a foot: what a leg consists of, and how long it is."""

from collections.abc import Sequence
from itertools import pairwise

import mujoco
import numpy as np

from biped.robot.robot import FootParts

_HINGE = mujoco.mjtJoint.mjJNT_HINGE
_PITCHES = 0.7
"""Share of a hinge's axis along y from which it turns in the plane of walking."""


def above(model: mujoco.MjModel, body: int) -> list[int]:
    """A body and all that it hangs on, outward first."""
    chain = []
    while body > 0:
        chain.append(body)
        body = int(model.body_parentid[body])
    return chain


def _joints_on(model: mujoco.MjModel, bodies: Sequence[int]) -> list[int]:
    """Joints of bodies, in their order."""
    return [j for body in bodies
            for j in range(model.body_jntadr[body], model.body_jntadr[body] + model.body_jntnum[body])]  # fmt: skip


def pitching(model: mujoco.MjModel, data: mujoco.MjData, base: int, foot: int) -> tuple[int, ...]:
    """The last three joints between base and foot that turn about y, outward."""
    chain = [body for body in reversed(above(model, foot)) if body != base]
    legs = [j for j in _joints_on(model, chain) if model.jnt_type[j] == _HINGE and abs(data.xaxis[j, 1]) > _PITCHES]
    children = {int(model.body_parentid[b]) for b in range(1, model.nbody)}
    shared = [j for j in legs if _branches(model, int(model.jnt_bodyid[j]), children)]
    return tuple(j for j in legs if j not in shared)[-3:]


def _branches(model: mujoco.MjModel, body: int, parents: set[int]) -> bool:
    """Whether more than one chain hangs on a body: it belongs to the trunk."""
    while body in parents:
        below = [b for b in range(1, model.nbody) if model.body_parentid[b] == body]
        if len(below) > 1:
            return True
        (body,) = below
    return False


def places_of(data: mujoco.MjData, foot: FootParts) -> np.ndarray:
    """(k, 3) [m] contact points of a foot; of data with kinematics."""
    return np.array([
        data.xpos[body] + data.xmat[body].reshape(3, 3) @ place
        for body, place in zip(foot.on, foot.points, strict=True)
    ])  # fmt: skip


def leg_length(model: mujoco.MjModel, data: mujoco.MjData, base: int, foot: FootParts, other: FootParts) -> float:
    """[m] from hip to sole along the joints: the hip is the first joint that the other leg does not hang on."""
    shared = set(above(model, other.bodies[0])) | {base}
    chain = [body for body in reversed(above(model, foot.bodies[0])) if body not in shared]
    anchors = [data.xanchor[j] for j in _joints_on(model, chain)]
    if not anchors:
        return float(data.subtree_com[base, 2])
    sole = float(places_of(data, foot)[:, 2].min())
    along = sum(float(np.linalg.norm(b - a)) for a, b in pairwise(anchors))
    return along + float(anchors[-1][2]) - sole
