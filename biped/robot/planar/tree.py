"""The planar seven-link tree: lengths and masses as a model file says them and as they truly are, forward kinematics.

Links, coordinates and contact points are in the order of `biped.robot.planar.topology`. Vectors are (x, z), angles
counter-clockwise.
"""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from biped.base.errors import InputError
from biped.base.jit import entry_kernel
from biped.base.typed import convert
from biped.robot.planar.description import PlanarParts
from biped.robot.planar.kinematics import PLACES, TREE, forward
from biped.robot.planar.topology import (
    BASE,
    CHAINS,
    FOOT,
    N_LINKS,
    N_POINTS,
    NQ,
    PARENT,
    PITCH,
    POINT_LINK,
    SHANK,
    THIGH,
    TOE,
    TORSO,
    UPRIGHT,
    X,
    Z,
)
from biped.scenario.keys import Truth

if TYPE_CHECKING:
    import mujoco

# Rates of the absolute link angles from the joint rates (columns pitch … second ankle).
_ABSOLUTE = np.zeros((N_LINKS, N_LINKS))
for _chain in CHAINS:
    for _i, _link in enumerate(_chain):
        for _above in _chain[: _i + 1]:
            _ABSOLUTE[_link, _above] = 1.0

ABSOLUTE_FROM_JOINT = np.eye(NQ)
"""(9, 9): thesis velocities (x, y, θ, θ1 … θ6)˙ = ABSOLUTE_FROM_JOINT @ joint velocities."""
ABSOLUTE_FROM_JOINT[PITCH:, PITCH:] = _ABSOLUTE
ABSOLUTE_OFFSET = np.array([*(0.0,) * PITCH, *UPRIGHT]) * np.pi
"""(9,) [m, rad]: thesis coordinates at zero joint coordinates: upright, feet flat."""


class Tree(NamedTuple):
    """Lengths and masses of the biped, each in its link's frame.

    Attributes:
        joint: (7, 2) [m] position of each link's joint in its parent's frame (the torso's is zero).
        com: (7, 2) [m] centre of mass of each link.
        mass: (7,) [kg].
        inertia: (7,) [kg m²] about the centre of mass, around the hinge axis.
        armature: (6,) [kg m²] reflected actuator inertia of hip, knee, ankle; leg by leg.
        damping: (6,) [N m s/rad] viscous damping of the same joints.
        point: (4, 2) [m] toe and heel of each foot.
    """

    joint: np.ndarray
    com: np.ndarray
    mass: np.ndarray
    inertia: np.ndarray
    armature: np.ndarray
    damping: np.ndarray
    point: np.ndarray

    @property
    def leg(self) -> float:
        """Length of the straight leg from hip to sole [m], as in the Froude number."""
        return float(-self.joint[SHANK[0], 1] - self.joint[FOOT[0], 1] - self.point[TOE[0], 1])


def tree_of(model, name: str, robot: PlanarParts) -> Tree:
    """Reads the tree out of a compiled MuJoCo model.

    Args:
        model: An `mujoco.MjModel` with the links, joints and sites that the description names.
        name: What to call the model in an error.
        robot: The description.

    Raises:
        InputError: A body is turned out of the plane or its frame is rotated.
    """
    bodies = [model.body(link).id for link in robot.links]
    driven = [int(model.joint(joint).dofadr[0]) for joint in robot.joints[BASE:]]
    upright = np.array([1.0, 0.0, 0.0, 0.0])
    for link, body in zip(robot.links, bodies, strict=True):
        if np.abs(model.body_quat[body] - upright).max() > 1e-9:
            raise InputError(f"{name}: body '{link}': expected a frame parallel to the world's (no quat, euler)")
    inertia = []
    for body in bodies:
        turn = np.zeros(9)
        _quat_to_matrix(turn, model.body_iquat[body])
        rotation = turn.reshape(3, 3)
        inertia.append((rotation @ np.diag(model.body_inertia[body]) @ rotation.T)[1, 1])
    planar = [0, 2]
    return Tree(
        joint=np.array(model.body_pos[bodies][:, planar]) * (np.arange(N_LINKS) > TORSO)[:, None],
        com=np.array(model.body_ipos[bodies][:, planar]),
        mass=np.array(model.body_mass[bodies]),
        inertia=np.array(inertia),
        armature=np.array(model.dof_armature[driven]),
        damping=np.array(model.dof_damping[driven]),
        point=np.array(model.site_pos[[model.site(point).id for point in robot.points]][:, planar]),
    )


def _quat_to_matrix(out: np.ndarray, quat: np.ndarray) -> None:
    import mujoco

    mujoco.mju_quat2Mat(out, quat)


def absolute(q: np.ndarray) -> np.ndarray:
    """Thesis coordinates (…, 9) (x, y, θ, θ1 … θ6) [m, rad] of joint coordinates q (…, 9)."""
    return q @ ABSOLUTE_FROM_JOINT.T + ABSOLUTE_OFFSET


def from_absolute(q: np.ndarray) -> np.ndarray:
    """Joint coordinates (…, 9) of thesis coordinates q (…, 9) [m, rad]."""
    return np.linalg.solve(ABSOLUTE_FROM_JOINT, (q - ABSOLUTE_OFFSET)[..., None])[..., 0]


class Motion(NamedTuple):
    """Where the links are and how they move; the first axes are those of the coordinates.

    Attributes:
        joint: (…, 7, 2) [m] joint positions (the torso's is its frame's origin).
        com: (…, 7, 2) [m] centres of mass.
        com_velocity: (…, 7, 2) [m/s].
        point: (…, 4, 2) [m] toes and heels.
        point_velocity: (…, 4, 2) [m/s].
        angle: (…, 7) [rad] link angles from the upright, straight configuration.
        rate: (…, 7) [rad/s].
    """

    joint: np.ndarray
    com: np.ndarray
    com_velocity: np.ndarray
    point: np.ndarray
    point_velocity: np.ndarray
    angle: np.ndarray
    rate: np.ndarray


def motion(tree: Tree, q: np.ndarray, v: np.ndarray) -> Motion:
    """Forward kinematics of any number of configurations at once.

    Args:
        tree: The biped.
        q: (…, 9) joint coordinates [m, rad].
        v: (…, 9) joint velocities [m/s, rad/s].
    """
    shape = np.broadcast_shapes(q.shape, v.shape)[:-1]
    rows = int(np.prod(shape))
    flat_q = np.ascontiguousarray(np.broadcast_to(q, (*shape, NQ)).reshape(rows, NQ), dtype=float)
    flat_v = np.ascontiguousarray(np.broadcast_to(v, (*shape, NQ)).reshape(rows, NQ), dtype=float)
    parts = [np.empty((rows, *size)) for size in (*((N_LINKS, 2),) * 3, *((N_POINTS, 2),) * 2, *((N_LINKS,),) * 2)]
    record = np.zeros(1, TREE)
    for name, value in tree._asdict().items():
        record[name] = value
    _forward(record, flat_q, flat_v, np.zeros(1, PLACES), *parts)
    return Motion(*(part.reshape(*shape, *part.shape[1:]) for part in parts))


@entry_kernel
def _forward(tree, q, v, work, joint, com, com_velocity, point, point_velocity, angle, rate):
    """Fills the arrays of `Motion`, row by row."""
    at = work[0]
    for row in range(q.shape[0]):
        forward(tree[0], q[row], v[row], q[row, X], q[row, Z], at)
        for k in range(N_LINKS):
            angle[row, k], rate[row, k] = at["angle"][k], at["rate"][k]
            for axis in range(2):
                joint[row, k, axis] = at["joint"][k, axis]
                com[row, k, axis] = at["com"][k, axis]
                com_velocity[row, k, axis] = at["com_velocity"][k, axis]
        for i in range(N_POINTS):
            for axis in range(2):
                point[row, i, axis] = at["point"][i, axis]
                point_velocity[row, i, axis] = at["point_velocity"][i, axis]


Pair = tuple[float, float]


class SevenLinks(PlanarParts, frozen=True, kw_only=True, dict=True):
    """A torso with two legs of three links.

    Attributes:
        joint: [m] position of each link's joint in its parent's frame.
        com: [m] centre of mass of each link.
        mass: [kg] of each link.
        inertia: [kg m²] of each link about its centre of mass.
        armature: [kg m²] reflected actuator inertia of hip, knee, ankle; leg by leg.
        damping: [N m s/rad] viscous damping of the same joints.
        point: [m] toe and heel of each foot.
    """

    joint: tuple[Pair, ...]
    com: tuple[Pair, ...]
    mass: tuple[float, ...]
    inertia: tuple[float, ...]
    armature: tuple[float, ...]
    damping: tuple[float, ...]
    point: tuple[Pair, ...]

    @cached_property
    def tree(self) -> Tree:
        """The numbers as arrays, which are not to be written to."""
        return Tree(**{name: np.array(getattr(self, name), dtype=float) for name in Tree._fields})


def seven_links_of(parts: PlanarParts, tree: Tree) -> SevenLinks:
    """The seven links of these names and these numbers."""
    numbers = {name: value.tolist() for name, value in tree._asdict().items()}
    named = {name: getattr(parts, name) for name in PlanarParts.__struct_fields__}
    return convert(named | numbers, SevenLinks)


LEAST_INERTIA = 1e-12
"""[kg, kg m²] A link with less cannot be simulated: MuJoCo refuses 1e-15."""


def check_solid(truth: Truth, parts: PlanarParts, tree: Tree) -> None:
    """Makes sure that every link of the biped that walks has a mass and an inertia.

    Raises:
        InputError: One has less than can be simulated.
    """
    true = true_tree(tree, truth)
    for link, mass, inertia in zip(parts.links, true.mass, true.inertia, strict=True):
        if min(mass, inertia) < LEAST_INERTIA:
            raise InputError(
                f"truth: {link}: expected a mass and a moment of inertia of at least {LEAST_INERTIA:g}, got "
                f"{mass:.3g} kg and {inertia:.3g} kg m²", "truth",
            )  # fmt: skip


def true_tree(tree: Tree, truth: Truth) -> Tree:
    """Lengths and masses of the biped that walks, given those of the model file."""
    if truth == Truth():
        return tree
    mass, length = np.array(truth.mass), np.array(truth.length)
    parent = length[list(PARENT)]
    scaled = tree._replace(
        joint=tree.joint * parent[:, None],
        com=tree.com * length[:, None],
        mass=tree.mass * mass,
        inertia=tree.inertia * mass * length**2 * np.array(truth.inertia),
        damping=tree.damping + truth.joint_damping,
        point=tree.point * length[list(POINT_LINK)][:, None],
    )
    return scaled if truth.hip_mass == 0.0 else _with_hip_mass(scaled, truth.hip_mass)


def _with_hip_mass(tree: Tree, hip: float) -> Tree:
    """The tree whose torso carries a point mass [kg] on the hip's axis too."""
    own, at = float(tree.mass[TORSO]), tree.joint[THIGH[0]] - tree.com[TORSO]
    com, mass, inertia = np.array(tree.com), np.array(tree.mass), np.array(tree.inertia)
    mass[TORSO] = own + hip
    com[TORSO] += hip / (own + hip) * at
    inertia[TORSO] += own * hip / (own + hip) * float(at @ at)
    return tree._replace(com=com, mass=mass, inertia=inertia)


def apply_truth(spec: mujoco.MjSpec, truth: Truth, robot: PlanarParts) -> None:
    """Scales masses, inertias and lengths in a parsed model, in place."""
    for i, link in enumerate(robot.links):
        body = spec.body(link)
        length = truth.length[i]
        body.mass *= truth.mass[i]
        body.inertia = body.inertia * (truth.mass[i] * length**2 * truth.inertia[i])
        body.ipos = body.ipos * length
        for part in [*body.sites, *body.geoms, *body.bodies]:
            part.pos = part.pos * length
        for geom in body.geoms:
            geom.fromto = geom.fromto * length
    if truth.hip_mass > 0.0:
        torso, hip = spec.body(robot.base.link), spec.body(robot.leg[0].links[0])
        total = torso.mass + truth.hip_mass
        at = np.array([hip.pos[0], 0.0, hip.pos[2]]) - torso.ipos
        torso.inertia = torso.inertia + torso.mass * truth.hip_mass / total * np.array(
            [at[2] ** 2, at @ at, at[0] ** 2]
        )
        torso.ipos = torso.ipos + truth.hip_mass / total * at
        torso.mass = total
    for joint in robot.joints[BASE:]:
        # MuJoCo 4 keeps a polynomial in the rate: linear, quadratic and cubic coefficient.
        spec.joint(joint).damping = spec.joint(joint).damping + np.array([truth.joint_damping, 0.0, 0.0])
