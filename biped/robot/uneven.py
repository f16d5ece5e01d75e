"""A model for ground that is not level: every part of a robot that may touch it gets a plane of its own.

A foot of boxes, cylinders or meshes touches at its contact points, and where it is a capsule at that one's two ends;
any other part as it is, with the plane below its middle. Planes are laid along the line of the ground before every
step (`biped.engines.uneven`).
"""

from typing import NamedTuple

import mujoco
import numpy as np

from biped.robot.planar.build import plane_below
from biped.robot.robot import Robot
from biped.robot.soles import pairs_of, touches

_POINT = 1e-6
"""[m] radius of the spheres that stand for points."""
_LAST_GROUP = 5
"""Geoms of which nobody sees."""
_EDGED = (mujoco.mjtGeom.mjGEOM_BOX, mujoco.mjtGeom.mjGEOM_CYLINDER, mujoco.mjtGeom.mjGEOM_MESH)
_PLANE, _SPHERE = mujoco.mjtGeom.mjGEOM_PLANE, mujoco.mjtGeom.mjGEOM_SPHERE


class _Ball(NamedTuple):
    """A sphere that touches for a part: its body, place there [m] and radius [m]."""

    body: int
    place: tuple[float, ...]
    radius: float


def give_planes(spec: mujoco.MjSpec, robot: Robot) -> None:
    """Adds the planes and the pairs that meet, and takes the level plane out of contact; nobody sees any of it.

    Args:
        spec: The completed file, with the names that `name_geoms` gave; changed.
        robot: What it is.
    """
    model = spec.compile()
    pairs = pairs_of(model)
    own = {i: (int(model.pair_geom1[i]), int(model.pair_geom2[i])) for i in range(model.npair)}
    of_file = {(set(both) - {robot.ground}).pop(): i for i, both in own.items() if robot.ground in both}
    feet = {geom for foot in robot.feet for geom in foot.geoms}
    touching = [g for g in range(model.ngeom)
                if model.geom_bodyid[g] > 0 and touches(model, pairs, g, robot.ground)]  # fmt: skip
    parts = [model.geom(g).name for g in touching if g not in feet]
    sizes = [int(model.pair_dim[of_file[g]]) if g in of_file else int(model.geom_condim[robot.ground])
             for g in touching]  # fmt: skip
    for foot in robot.feet:
        edged = any(model.geom_type[g] in _EDGED for g in foot.geoms)
        balls = [_Ball(body, place, _POINT) for body, place in zip(foot.on, foot.points, strict=True)] if edged else []
        for geom in () if edged else foot.geoms:
            if model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_CAPSULE:
                balls += _ends(model, geom)
            else:
                parts.append(model.geom(geom).name)
        for number, ball in enumerate(balls):
            name = f"{foot.name}, point {number}"
            spec.body(model.body(ball.body).name).add_geom(
                name=name, type=_SPHERE, size=[ball.radius, 0.0, 0.0], pos=list(ball.place), mass=0.0, contype=0,
                conaffinity=0, group=_LAST_GROUP,
            )  # fmt: skip
            parts.append(name)
    level = model.geom(robot.ground).name
    for pair in [pair for pair in spec.pairs if level in (pair.geomname1, pair.geomname2)]:
        spec.delete(pair)
    for part in parts:
        plane = spec.worldbody.add_geom(name=plane_below(part), type=_PLANE, size=[0.0, 0.0, 0.05], contype=0,
                                        conaffinity=0, group=_LAST_GROUP)  # fmt: skip
        friction = model.geom_friction[robot.ground]
        spec.add_pair(geomname1=plane.name, geomname2=part, condim=max(3, *sizes),
                      friction=[friction[0], friction[0], *friction[[1, 2, 2]]],
                      solimp=list(model.geom_solimp[robot.ground]))  # fmt: skip
    ground = next(geom for geom in spec.geoms if geom.name == level)
    ground.contype = ground.conaffinity = 0


def pairs_with_planes(model: mujoco.MjModel) -> np.ndarray:
    """Numbers of the pairs of a part and the plane below it."""
    first, second = model.pair_geom1, model.pair_geom2
    return np.array([
        i for i in range(model.npair) if model.geom(first[i]).name == plane_below(model.geom(second[i]).name)
    ], dtype=int)  # fmt: skip


def name_geoms(spec: mujoco.MjSpec) -> None:
    """Gives geoms without a name one."""
    for number, geom in enumerate(spec.geoms):
        if not geom.name:
            geom.name = f"geom_{number}"


def _ends(model: mujoco.MjModel, geom: int) -> list[_Ball]:
    """The two ends of a capsule."""
    turn = np.empty(9)
    mujoco.mju_quat2Mat(turn, model.geom_quat[geom])
    along = model.geom_size[geom, 1] * turn.reshape(3, 3)[:, 2]
    return [_Ball(int(model.geom_bodyid[geom]), tuple((model.geom_pos[geom] + sign * along).tolist()),
                  float(model.geom_size[geom, 0])) for sign in (1.0, -1.0)]  # fmt: skip
