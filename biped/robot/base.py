"""A robot's base, the ground it stands on, and what a file has beside both that a run cannot account for."""

import mujoco
import numpy as np

from biped.base.files import nearest
from biped.robot.gravity import GRAVITY
from biped.robot.legs import above
from biped.robot.soles import pairs_of, touches
from biped.scenario.robot import Described

_HINGE, _SLIDE, _FREE = mujoco.mjtJoint.mjJNT_HINGE, mujoco.mjtJoint.mjJNT_SLIDE, mujoco.mjtJoint.mjJNT_FREE
_STRAIGHT = 1e-6
_GRAVITY = 0.02
"""[m/s²] by which a file's gravity may differ."""


def ground_of(model: mujoco.MjModel, table: Described, faults: list[str]) -> int | None:
    """Number of the geom of the level plane; None, with a fault, where it is not clear."""
    planes = [g for g in range(model.ngeom) if model.geom_type[g] == mujoco.mjtGeom.mjGEOM_PLANE]
    if table.ground:
        planes = [g for g in range(model.ngeom) if model.geom(g).name == table.ground]
    level = [g for g in planes if _level(model, g)]
    if len(level) == len(planes) > 1:
        planes = level[:1]  # those of the same height touch nothing: `other_planes`
    if len(planes) != 1:
        names = ", ".join(model.geom(g).name or f"geom {g}" for g in planes)
        faults.append(f"ground: expected one plane of the world, got {names or f'no geom {table.ground!r}'}; write "
                      "[robot] ground = the name of its geom")  # fmt: skip
        return None
    (ground,) = planes
    if not _level(model, ground):
        faults.append(f"ground: geom '{model.geom(ground).name}': expected the level plane z = 0 of the world (a slope "
                      "is set in the scenario)")  # fmt: skip
        return None
    return ground


def _level(model: mujoco.MjModel, geom: int) -> bool:
    """Whether a geom is a plane z = 0 that nothing moves, of the world or of a body that is fixed to it."""
    if model.body_weldid[model.geom_bodyid[geom]] != 0 or model.geom_type[geom] != mujoco.mjtGeom.mjGEOM_PLANE:
        return False
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    return bool(abs(data.geom_xpos[geom, 2]) < _STRAIGHT and data.geom_xmat[geom, 8] > 1.0 - _STRAIGHT)


def other_planes(model: mujoco.MjModel, ground: int) -> list[int]:
    """Level planes of the ground's height beside it: a foot must not stand on two of them at once."""
    return [g for g in range(model.ngeom) if g != ground and _level(model, g)]


def base_of(model: mujoco.MjModel, table: Described, faults: list[str]) -> tuple[int, tuple[int, ...], bool] | None:
    """Number of the base, where its coordinates stand in v, whether it is planar."""
    roots = [b for b in range(1, model.nbody) if model.body_parentid[b] == 0]
    wanted = table.base.body
    if wanted:
        names = [model.body(b).name for b in range(1, model.nbody)]
        if wanted not in names:
            faults.append(f"base.body: no body '{wanted}'; {nearest(wanted, names)}")
            return None
        roots = [names.index(wanted) + 1]
    found = [(b, *moved) for b in roots if (moved := _moved(model, b)) is not None]
    if len(found) == 1:
        return found[0]
    if found:
        names = ", ".join(model.body(b).name for b, *_ in found)
        faults.append(f"base: several bodies move freely ({names}); write [robot.base] body = …")
    else:
        first = f"body '{model.body(roots[0]).name}'" if roots else "a body"
        faults.append(f"base: nothing moves freely; write <freejoint/> in {first}, or in the plane slides along x and "
                      "z and a hinge about y")  # fmt: skip
    return None


def _moved(model: mujoco.MjModel, body: int) -> tuple[tuple[int, ...], bool] | None:
    """Where the coordinates of a base stand in v, and whether it is planar; None if the body is none."""
    if model.body_parentid[body] != 0:
        return None
    joints = range(model.body_jntadr[body], model.body_jntadr[body] + model.body_jntnum[body])
    kinds = [mujoco.mjtJoint(model.jnt_type[j]) for j in joints]
    if kinds == [_FREE]:
        first = int(model.jnt_dofadr[joints[0]])
        return tuple(range(first, first + 6)), False
    places: dict[str, int] = {}
    for joint, kind in zip(joints, kinds, strict=True):
        axis = model.jnt_axis[joint]
        if kind == _SLIDE and axis[0] > 1.0 - _STRAIGHT:
            places["x"] = int(model.jnt_dofadr[joint])
        elif kind == _SLIDE and axis[2] > 1.0 - _STRAIGHT:
            places["z"] = int(model.jnt_dofadr[joint])
        elif kind == _HINGE and abs(axis[1]) > 1.0 - _STRAIGHT:
            places["pitch"] = int(model.jnt_dofadr[joint])
    if len(joints) == 3 and len(places) == 3:
        return (places["x"], places["z"], places["pitch"]), True
    return None


def physics_of(model: mujoco.MjModel, faults: list[str]) -> None:
    """Notes what a file asks of the physics that a run does not do."""
    gravity = model.opt.gravity
    if np.abs(gravity - [0.0, 0.0, -GRAVITY]).max() > _GRAVITY:
        faults.append(f"option: gravity {' '.join(f'{one:g}' for one in gravity)}: expected 0 0 {-GRAVITY}; a slope is "
                      "set in the scenario")  # fmt: skip


def surroundings(model: mujoco.MjModel, base: int, ground: int, faults: list[str]) -> None:
    """Notes what a file has beside robot and ground that the robot could meet: nothing of it is accounted for."""
    pairs = pairs_of(model)
    own = [g for g in range(model.ngeom) if belongs(model, int(model.geom_bodyid[g]), base)]
    others = [b for b in range(1, model.nbody)
              if not belongs(model, b, base) and any(model.body_dofnum[one] for one in above(model, b))]  # fmt: skip
    for body in others:
        faults.append(f"body '{model.body(body).name}': moves, and is no part of what hangs on the base "
                      f"'{model.body(base).name}'; expected the robot alone")  # fmt: skip
    for geom in range(model.ngeom):
        body = int(model.geom_bodyid[geom])
        if geom == ground or _level(model, geom) or belongs(model, body, base) or body in others:
            continue
        if any(touches(model, pairs, one, geom) for one in own):
            name = f"'{model.geom(geom).name}'" if model.geom(geom).name else str(geom)
            faults.append(
                f"geom {name} of '{model.body(body).name}': the robot can touch it, but it is not the ground; expected "
                "one level plane (uneven ground is set in the scenario); of others contype and conaffinity 0"
            )


def belongs(model: mujoco.MjModel, body: int, base: int) -> bool:
    """Whether a body hangs on the base, or is it."""
    return base in above(model, body)
