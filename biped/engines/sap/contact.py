"""Contacts of a plant of Drake's: parts of the robot and the ground, and each other, as MuJoCo's model says.

Drake finds one point between two shapes, on which a box would rock. What has edges therefore meets the ground at its
corners, and a capsule at its ends, as it does in MuJoCo; an edged foot at its contact points.
"""

# pyright: reportMissingImports=false
from __future__ import annotations

import logging
from collections.abc import Iterator
from typing import NamedTuple

import mujoco
import numpy as np
from pydrake.geometry import (
    AddContactMaterial,
    Box,
    Capsule,
    CollisionFilterDeclaration,
    Convex,
    Cylinder,
    Ellipsoid,
    GeometryId,
    GeometrySet,
    HalfSpace,
    ProximityProperties,
    SceneGraph,
    Shape,
    Sphere,
)
from pydrake.math import RigidTransform
from pydrake.multibody.plant import CoulombFriction, MultibodyPlant
from pydrake.multibody.tree import FixedOffsetFrame, RigidBody, WeldJoint

from biped.engines.sap.tree import pose
from biped.robot.ground import GRAVITY
from biped.robot.parts import own_masses
from biped.robot.robot import Robot
from biped.robot.sole import mesh_vertices

_POINT = 1e-6
"""[m] radius of the spheres that stand for points."""
_ENDLESS = 1e200
"""So much that what is put in series with it stays what it is, to the last digit."""
_BLOCK = 200.0
"""[m] edges of the blocks whose tops are planes that move. A half-space that moves makes Drake crash after a second or
two: it keeps what moves in a tree of bounding boxes, and a half-space's box is endless."""
_CORNERS = 32
"""Most vertices of a mesh that meet the ground: the outermost in so many directions."""
_KIND = mujoco.mjtGeom


class Meeting(NamedTuple):
    """Shapes that were built of geoms.

    Attributes:
        part: MuJoCo's geom that a shape of the robot stands for where it meets the ground, by the shape's number;
            other shapes, which meet only each other, and shapes that are ground have none.
        planes: (geom, frame) of planes that are moved; none where the ground is level.
    """

    part: dict[int, int]
    planes: list[tuple[int, FixedOffsetFrame]]


class Builder:
    """Registers shapes with a plant.

    Args:
        plant: Not finished yet; changed.
        m: The model.
        bodies: The plant's, by MuJoCo's number.
        robot: What it is.
        level: Whether the ground is; otherwise planes are laid below the parts.
    """

    def __init__(self, plant: MultibodyPlant, m: mujoco.MjModel, bodies: list[RigidBody], robot: Robot, level: bool):
        self._plant, self._m, self._bodies, self._robot, self._level = plant, m, bodies, robot, level
        self._mass = float(own_masses(m, robot.base_number).sum())
        self._shapes: dict[tuple[int, bool], list[GeometryId]] = {}
        self._planes: list[tuple[int, FixedOffsetFrame]] = []

    def register(self, scenes: SceneGraph) -> Meeting:
        """Registers all shapes that meet anything, and lets only those meet that do in MuJoCo."""
        m = self._m
        logging.getLogger("drake").addFilter(_of_bodies_that_bend)
        pairs = list(_pairs(m))
        planes = m.geom_type == _KIND.mjGEOM_PLANE
        allow = []
        for a, b in pairs:
            first, second = (b, a) if planes[b] else (a, b)
            allow.append((self._of(first, first), self._of(second, first)))
        everything = GeometrySet([shape for shapes in self._shapes.values() for shape in shapes])
        if allow:
            filters = CollisionFilterDeclaration().ExcludeWithin(everything)
            for one, other in allow:
                filters.AllowBetween(GeometrySet(one), GeometrySet(other))
            scenes.collision_filter_manager().Apply(filters)
        part = {shape.get_value(): geom for (geom, on_ground), shapes in self._shapes.items()
                if on_ground and not planes[geom] for shape in shapes}  # fmt: skip
        return Meeting(part, self._planes)

    def _of(self, geom: int, other: int) -> list[GeometryId]:
        """The shapes of a geom, as it meets the ground or another part."""
        on_ground = bool(self._m.geom_type[other] == _KIND.mjGEOM_PLANE)
        key = geom, on_ground
        if key not in self._shapes:
            if self._m.geom_type[geom] == _KIND.mjGEOM_PLANE:
                self._shapes[key] = [self._plane(geom)]
            else:
                contact = contact_of(self._m, other, geom) if on_ground else contact_of(self._m, geom, geom)
                material = _material(self._mass, contact, on_ground)
                reach = _margin_of(self._m, other, geom) if on_ground else 0.0
                self._shapes[key] = [self._part_of(geom, place, shape, i, material) for i, (place, shape)
                                     in enumerate(self._shapes_of(geom, on_ground, reach))]  # fmt: skip
        return self._shapes[key]

    def _plane(self, geom: int) -> GeometryId:
        m, plant, name = self._m, self._plant, f"plane {geom}"
        place = pose(m.geom_pos[geom], m.geom_quat[geom])
        if self._level:
            body = self._bodies[m.geom_bodyid[geom]]
            return plant.RegisterCollisionGeometry(body, place, HalfSpace(), name, _ground())
        frame = plant.AddFrame(FixedOffsetFrame(f"{name} at", plant.world_frame(), place))
        body = plant.AddRigidBody(name)
        plant.AddJoint(WeldJoint(name, frame, body.body_frame(), RigidTransform()))
        self._planes.append((geom, frame))
        below = RigidTransform([0.0, 0.0, -0.5 * _BLOCK])
        return plant.RegisterCollisionGeometry(body, below, Box(_BLOCK, _BLOCK, _BLOCK), name, _ground())

    def _part_of(
        self, geom: int, place: RigidTransform, shape: Shape, number: int, material: ProximityProperties
    ) -> GeometryId:
        body = self._bodies[self._m.geom_bodyid[geom]]
        name = f"geom {geom}.{len(self._shapes)}.{number}"
        return self._plant.RegisterCollisionGeometry(body, place, shape, name, material)

    def _shapes_of(self, geom: int, on_ground: bool, reach: float) -> Iterator[tuple[RigidTransform, Shape]]:
        """Places in its body and shapes that stand for a geom, which on ground reach further by a contact's margin."""
        m, kind = self._m, _KIND(self._m.geom_type[geom])
        place, size = pose(m.geom_pos[geom], m.geom_quat[geom]), m.geom_size[geom]
        if on_ground and kind in (_KIND.mjGEOM_BOX, _KIND.mjGEOM_CYLINDER, _KIND.mjGEOM_MESH):
            for foot in self._robot.feet:
                if geom in foot.geoms:
                    on = [p for body, p in zip(foot.on, foot.points, strict=True) if body == m.geom_bodyid[geom]]
                    yield from ((RigidTransform(np.array(p)), Sphere(_POINT + reach)) for p in on)
                    return
            yield from ((place @ RigidTransform(corner), Sphere(_POINT + reach)) for corner in _corners(m, geom))
            return
        match kind:
            case _KIND.mjGEOM_SPHERE:
                yield place, Sphere(size[0] + reach)
            case _KIND.mjGEOM_CAPSULE if on_ground:
                for end in (size[1], -size[1]):
                    yield place @ RigidTransform([0.0, 0.0, end]), Sphere(size[0] + reach)
            case _KIND.mjGEOM_CAPSULE:
                yield place, Capsule(size[0], 2.0 * size[1])
            case _KIND.mjGEOM_BOX:
                yield place, Box(2.0 * size)
            case _KIND.mjGEOM_CYLINDER:
                yield place, Cylinder(size[0], 2.0 * size[1])
            case _KIND.mjGEOM_ELLIPSOID:
                yield place, Ellipsoid(size + reach)
            case _:
                yield place, Convex(mesh_vertices(m, geom).T, m.geom(geom).name or "mesh")


def _of_bodies_that_bend(record: logging.LogRecord) -> bool:
    """Whether a warning of Drake's is of something else than half-spaces that bodies which bend would not meet."""
    return "deformable" not in record.getMessage()


def contact_of(m: mujoco.MjModel, one: int, other: int) -> tuple[float, float, float]:
    """Contact time [s], damping ratio and friction between two geoms, by MuJoCo's rules; of one with itself its own."""
    if (pair := _pair_of(m, one, other)) is not None:
        (time, ratio), friction = m.pair_solref[pair, :2], float(m.pair_friction[pair, 0])
        return float(time), float(ratio), friction if m.pair_dim[pair] > 1 else 0.0
    first, second = m.geom_priority[one], m.geom_priority[other]
    if first != second:
        wins = one if first > second else other
        (time, ratio), friction, dim = m.geom_solref[wins, :2], m.geom_friction[wins, 0], m.geom_condim[wins]
    else:
        weights = np.maximum(m.geom_solmix[[one, other]], mujoco.mjMINVAL)
        time, ratio = weights / weights.sum() @ m.geom_solref[[one, other], :2]
        friction, dim = m.geom_friction[[one, other], 0].max(), m.geom_condim[[one, other]].max()
    return float(time), float(ratio), float(friction) if dim > 1 else 0.0


def _margin_of(m: mujoco.MjModel, one: int, other: int) -> float:
    """[m] between two geoms at which they begin to push each other, by MuJoCo's rules."""
    pair = _pair_of(m, one, other)
    return float(m.geom_margin[one] + m.geom_margin[other] if pair is None else m.pair_margin[pair])


def _pair_of(m: mujoco.MjModel, one: int, other: int) -> int | None:
    """The explicit pair of two geoms; None if the model has none."""
    wanted = {one, other}
    return next((i for i in range(m.npair) if {int(m.pair_geom1[i]), int(m.pair_geom2[i])} == wanted), None)


def _material(mass: float, contact: tuple[float, float, float], on_ground: bool) -> ProximityProperties:
    """The material of a part: that of its contacts with the ground, which adds nothing; or half of those with its like.

    Drake puts two stiffnesses in series, adds up times of relaxation, and takes the harmonic mean of frictions. Its own
    time of relaxation, a tenth of a second, is far too long for steps. The approximation `lagged` reads Hunt's and
    Crossley's dissipation instead: with it a contact that bears the robot's weight is damped by the same rate.
    """
    time, ratio, friction = contact
    share, half = (1.0, 0.5 * friction) if on_ground else (2.0, friction)
    out = ProximityProperties()
    AddContactMaterial(
        dissipation=2.0 * ratio / (GRAVITY * time), point_stiffness=share * mass / time**2,
        friction=CoulombFriction(half, half), properties=out,
    )  # fmt: skip
    out.AddProperty("material", "relaxation_time", 2.0 / share * ratio * time)
    return out


def _ground() -> ProximityProperties:
    """The material of ground that leaves contacts what parts say of them: endlessly stiff and rough."""
    out = ProximityProperties()
    AddContactMaterial(point_stiffness=_ENDLESS, friction=CoulombFriction(_ENDLESS, _ENDLESS), properties=out)
    out.AddProperty("material", "relaxation_time", 0.0)
    return out


def _pairs(m: mujoco.MjModel) -> Iterator[tuple[int, int]]:
    """Pairs of geoms that meet in MuJoCo: those that the file lists, and those that its filters let through."""
    listed = {frozenset((int(m.pair_geom1[i]), int(m.pair_geom2[i]))) for i in range(m.npair)}
    apart = {int(signature) for signature in m.exclude_signature}
    body, weld, kind, affinity = m.geom_bodyid, m.body_weldid, m.geom_contype, m.geom_conaffinity
    for a in range(m.ngeom):
        for b in range(a + 1, m.ngeom):
            if frozenset((a, b)) in listed:
                yield a, b
                continue
            if not (kind[a] & affinity[b] or kind[b] & affinity[a]):
                continue
            one, other = int(weld[body[a]]), int(weld[body[b]])
            if one == other or (min(body[a], body[b]) << 16) + max(body[a], body[b]) in apart:
                continue
            above, below = (int(weld[m.body_parentid[w]]) for w in (one, other))
            if one and other and (above == other or below == one):
                continue  # a parent and its child
            yield a, b


def _corners(m: mujoco.MjModel, geom: int) -> np.ndarray:
    """(k, 3) [m] points of an edged geom that may be the lowest, in its frame."""
    size = m.geom_size[geom]
    if m.geom_type[geom] == _KIND.mjGEOM_BOX:
        return np.array([[x, y, z] for x in (1, -1) for y in (1, -1) for z in (1, -1)]) * size
    if m.geom_type[geom] == _KIND.mjGEOM_CYLINDER:
        angle = np.arange(8) * np.pi / 4.0
        rim = np.stack([size[0] * np.cos(angle), size[0] * np.sin(angle)], axis=1)
        return np.concatenate([np.column_stack([rim, np.full(8, end)]) for end in (size[1], -size[1])])
    vertices, turn = mesh_vertices(m, geom), np.arange(_CORNERS) * np.pi * (3.0 - np.sqrt(5.0))
    z = 1.0 - 2.0 * (np.arange(_CORNERS) + 0.5) / _CORNERS  # directions spread evenly over a sphere
    ways = np.stack([np.sqrt(1.0 - z * z) * np.cos(turn), np.sqrt(1.0 - z * z) * np.sin(turn), z], axis=1)
    return vertices[sorted(set(np.argmax(vertices @ ways.T, axis=0).tolist()))]
