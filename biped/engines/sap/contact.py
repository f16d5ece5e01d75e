"""Contacts of a plant of Drake's: parts of the robot and the ground, and each other, as MuJoCo's model says.

Drake finds one point between two shapes, on which a box would rock. What has edges therefore meets the ground at its
corners, and a capsule at its ends, as it does in MuJoCo; an edged foot at its contact points.
"""

# pyright: reportMissingImports=false
from __future__ import annotations

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
from biped.robot.robot import Robot

_POINT = 1e-6
"""[m] radius of the spheres that stand for points."""
_CORNERS = 32
"""Most vertices of a mesh that meet the ground: the outermost in so many directions."""
_KIND = mujoco.mjtGeom


class Meeting(NamedTuple):
    """Shapes that were built of geoms.

    Attributes:
        part: MuJoCo's geom that a shape of the robot stands for, by the shape's number; shapes that are ground have
            none.
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
        self._material = _material(m, robot)
        self._shapes: dict[tuple[int, bool], list[GeometryId]] = {}
        self._part: dict[GeometryId, int] = {}
        self._planes: list[tuple[int, FixedOffsetFrame]] = []

    def register(self, scenes: SceneGraph) -> Meeting:
        """Registers all shapes that meet anything, and lets only those meet that do in MuJoCo."""
        m = self._m
        pairs = list(_pairs(m))
        planes = m.geom_type == _KIND.mjGEOM_PLANE
        allow = []
        for a, b in pairs:
            first, second = (b, a) if planes[b] else (a, b)
            allow.append((self._of(first, planes[first]), self._of(second, planes[first])))
        plane_ids = [i for (geom, _), ids in self._shapes.items() if planes[geom] for i in ids]
        everything = GeometrySet([*plane_ids, *self._part])
        if allow:
            filters = CollisionFilterDeclaration().ExcludeWithin(everything)
            for one, other in allow:
                filters.AllowBetween(GeometrySet(one), GeometrySet(other))
            scenes.collision_filter_manager().Apply(filters)
        return Meeting({shape.get_value(): geom for shape, geom in self._part.items()}, self._planes)

    def _of(self, geom: int, on_ground: bool) -> list[GeometryId]:
        """The shapes of a geom, as it meets the ground or another part."""
        key = geom, on_ground
        if key not in self._shapes:
            if self._m.geom_type[geom] == _KIND.mjGEOM_PLANE:
                self._shapes[key] = [self._plane(geom)]
            else:
                self._shapes[key] = [self._part_of(geom, place, shape, i) for i, (place, shape)
                                     in enumerate(self._shapes_of(geom, on_ground))]  # fmt: skip
        return self._shapes[key]

    def _plane(self, geom: int) -> GeometryId:
        m, plant, name = self._m, self._plant, f"plane {geom}"
        place = pose(m.geom_pos[geom], m.geom_quat[geom])
        body = self._bodies[m.geom_bodyid[geom]]
        if not self._level:
            frame = plant.AddFrame(FixedOffsetFrame(f"{name} at", plant.world_frame(), place))
            body, place = plant.AddRigidBody(name), RigidTransform()
            plant.AddJoint(WeldJoint(name, frame, body.body_frame(), RigidTransform()))
            self._planes.append((geom, frame))
        return plant.RegisterCollisionGeometry(body, place, HalfSpace(), name, self._material)

    def _part_of(self, geom: int, place: RigidTransform, shape: Shape, number: int) -> GeometryId:
        body = self._bodies[self._m.geom_bodyid[geom]]
        out = self._plant.RegisterCollisionGeometry(
            body, place, shape, f"geom {geom}.{len(self._part)}.{number}", self._material
        )
        self._part[out] = geom
        return out

    def _shapes_of(self, geom: int, on_ground: bool) -> Iterator[tuple[RigidTransform, Shape]]:
        """Places in its body and shapes that stand for a geom."""
        m, kind = self._m, _KIND(self._m.geom_type[geom])
        place, size = pose(m.geom_pos[geom], m.geom_quat[geom]), m.geom_size[geom]
        if on_ground and kind in (_KIND.mjGEOM_BOX, _KIND.mjGEOM_CYLINDER, _KIND.mjGEOM_MESH):
            for foot in self._robot.feet:
                if geom in foot.geoms:
                    on = [p for body, p in zip(foot.on, foot.points, strict=True) if body == m.geom_bodyid[geom]]
                    yield from ((RigidTransform(np.array(p)), Sphere(_POINT)) for p in on)
                    return
            yield from ((place @ RigidTransform(corner), Sphere(_POINT)) for corner in _corners(m, geom))
            return
        match kind:
            case _KIND.mjGEOM_SPHERE:
                yield place, Sphere(size[0])
            case _KIND.mjGEOM_CAPSULE if on_ground:
                for end in (size[1], -size[1]):
                    yield place @ RigidTransform([0.0, 0.0, end]), Sphere(size[0])
            case _KIND.mjGEOM_CAPSULE:
                yield place, Capsule(size[0], 2.0 * size[1])
            case _KIND.mjGEOM_BOX:
                yield place, Box(2.0 * size)
            case _KIND.mjGEOM_CYLINDER:
                yield place, Cylinder(size[0], 2.0 * size[1])
            case _KIND.mjGEOM_ELLIPSOID:
                yield place, Ellipsoid(size)
            case _:
                yield place, Convex(_vertices(m, geom).T, m.geom(geom).name or "mesh")


def _material(m: mujoco.MjModel, robot: Robot) -> ProximityProperties:
    """The material of all shapes: two in series are as stiff and relax as fast as contacts with the ground do there.

    Drake's own relaxation time, a tenth of a second, is far too long for steps.
    """
    planes, mass = m.geom_type == _KIND.mjGEOM_PLANE, float(m.body_mass.sum())
    laid = [i for i in range(m.npair) if planes[m.pair_geom1[i]] or planes[m.pair_geom2[i]]]
    if laid:
        (time, ratio), friction = m.pair_solref[laid[0], :2], float(m.pair_friction[laid[0], 0])
    else:
        (time, ratio), friction = m.geom_solref[robot.ground, :2], float(m.geom_friction[robot.ground, 0])
    out = ProximityProperties()
    AddContactMaterial(point_stiffness=2.0 * mass / time**2, friction=CoulombFriction(friction, friction),
                       properties=out)  # fmt: skip
    out.AddProperty("material", "relaxation_time", ratio * time)
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


def _vertices(m: mujoco.MjModel, geom: int) -> np.ndarray:
    """(k, 3) [m] vertices of a mesh, in its geom's frame."""
    mesh = m.geom_dataid[geom]
    first, count = int(m.mesh_vertadr[mesh]), int(m.mesh_vertnum[mesh])
    return np.array(m.mesh_vert[first : first + count], dtype=float)


def _corners(m: mujoco.MjModel, geom: int) -> np.ndarray:
    """(k, 3) [m] points of an edged geom that may be the lowest, in its frame."""
    size = m.geom_size[geom]
    if m.geom_type[geom] == _KIND.mjGEOM_BOX:
        return np.array([[x, y, z] for x in (1, -1) for y in (1, -1) for z in (1, -1)]) * size
    if m.geom_type[geom] == _KIND.mjGEOM_CYLINDER:
        angle = np.arange(8) * np.pi / 4.0
        rim = np.stack([size[0] * np.cos(angle), size[0] * np.sin(angle)], axis=1)
        return np.concatenate([np.column_stack([rim, np.full(8, end)]) for end in (size[1], -size[1])])
    vertices, turn = _vertices(m, geom), np.arange(_CORNERS) * np.pi * (3.0 - np.sqrt(5.0))
    z = 1.0 - 2.0 * (np.arange(_CORNERS) + 0.5) / _CORNERS  # directions spread evenly over a sphere
    ways = np.stack([np.sqrt(1.0 - z * z) * np.cos(turn), np.sqrt(1.0 - z * z) * np.sin(turn), z], axis=1)
    return vertices[sorted(set(np.argmax(vertices @ ways.T, axis=0).tolist()))]
