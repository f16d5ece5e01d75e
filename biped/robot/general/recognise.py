"""What a model file is: base, feet, actuators; every fault at once, each with what to write."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import mujoco
import numpy as np

from biped.base.errors import InputError
from biped.base.files import label, nearest
from biped.robot.general.drives import drives_of
from biped.robot.general.facts import FootParts, General
from biped.robot.general.soles import FLAT, points_of
from biped.robot.general.spec import parsed
from biped.robot.safety import examine, packaged
from biped.robot.sizes import check_sizes
from biped.robot.trial import tried
from biped.scenario.robot import Described, Foot

_HINGE, _SLIDE, _FREE = mujoco.mjtJoint.mjJNT_HINGE, mujoco.mjtJoint.mjJNT_SLIDE, mujoco.mjtJoint.mjJNT_FREE
_STRAIGHT = 1e-6
FEET = 2


class Looked(NamedTuple):
    """What was found in a model file.

    Attributes:
        robot: What it is; None where faults leave nothing that could walk.
        faults: What is wrong, and what to write.
    """

    robot: General | None
    faults: tuple[str, ...]


def robot_of(path: Path, table: Described) -> General:
    """The robot in a model file.

    Raises:
        InputError: It is none: all that is wrong.
    """
    robot, faults = looked_at(path, table)
    if robot is None:
        many = f"{len(faults)} faults: " if len(faults) > 1 else ""
        raise InputError(f"{label(path)}: {many}{'; '.join(faults)}", "model")
    return robot


def looked_at(path: Path, table: Described) -> Looked:
    """What a model file is, and what is wrong with it.

    Raises:
        InputError: It is not a model at all.
    """
    return _looked_at(str(path), path.stat().st_mtime, table)


@lru_cache(maxsize=32)
def _looked_at(file: str, modified: float, table: Described) -> Looked:
    path = Path(file)
    if not packaged(path):
        examine(path)
        tried(label(path), lambda: _survives(path, table))
    return _recognised(path, parsed(path, table)[1], table)


def _survives(path: Path, table: Described) -> None:
    """What is done with a model file before anything is known of it, once."""
    _, model = parsed(path, table)
    check_sizes(model, label(path))
    mujoco.mj_step(model, mujoco.MjData(model))


def _recognised(path: Path, model: mujoco.MjModel, table: Described) -> Looked:
    faults: list[str] = []
    start = _start(model, table, faults)
    drives = drives_of(model, table, faults)
    ground = _ground(model, table, faults)
    base = _base(model, table, faults)
    if base is None or ground is None:
        return Looked(None, tuple(faults))
    number, columns, planar = base
    # A sole is seen where it lies flat: in the posture in which it has most points.
    tried_out: list[tuple[int, list[str], tuple[FootParts, ...], mujoco.MjData]] = []
    for data in _postures(model, start):
        found: list[str] = []
        feet = _feet(model, data, number, ground, table, found)
        tried_out.append((sum(len(foot.points) for foot in feet) - 1000 * len(found), found, feet, data))
    _, found, feet, data = max(tried_out, key=lambda one: one[0])
    faults += found
    if faults:
        return Looked(None, tuple(faults))
    turn = tried_out[0][3].xmat[number].reshape(3, 3)
    robot = General(
        name=path.stem,
        description=table.description,
        planar=planar,
        base=model.body(number).name,
        base_number=number,
        base_columns=columns,
        upright=tuple(turn[2].tolist()),
        forward=tuple(turn[0].tolist()),
        bodies=tuple(model.body(i).name for i in range(1, model.nbody)),
        masses=tuple(model.body_mass[1:].tolist()),
        q_names=_names(model, "q"),
        v_names=_names(model, "v"),
        drives=drives,
        feet=feet,
        ground=ground,
        leg=table.leg or _leg(model, data, number, feet[0], feet[1]),
        start=start,
        starts=tuple(model.key(i).name for i in range(model.nkey)),
        walked=table.walked,
        shown=table.shown,
    )
    return Looked(robot, ())


def _start(model: mujoco.MjModel, table: Described, faults: list[str]) -> str:
    """The keyframe to start from; empty if there is none."""
    keys = [model.key(i).name for i in range(model.nkey)]
    if table.start and table.start not in keys:
        hint = nearest(table.start, keys) if keys else "there are none: write <keyframe><key name=… qpos=…/></keyframe>"
        faults.append(f"start: no keyframe '{table.start}'; {hint}")
    return table.start or (keys[0] if keys else "")


def _postures(model: mujoco.MjModel, start: str) -> list[mujoco.MjData]:
    """The robot with all coordinates at zero, and at its start."""
    keys = [model.key(i).name for i in range(model.nkey)]
    out = [mujoco.MjData(model), *([mujoco.MjData(model)] if start in keys else [])]
    if start in keys:
        mujoco.mj_resetDataKeyframe(model, out[1], keys.index(start))
    for data in out:
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
    return out


def _ground(model: mujoco.MjModel, table: Described, faults: list[str]) -> int | None:
    planes = [g for g in range(model.ngeom) if model.geom_type[g] == mujoco.mjtGeom.mjGEOM_PLANE]
    if table.ground:
        planes = [g for g in range(model.ngeom) if model.geom(g).name == table.ground]
    if len(planes) != 1:
        names = ", ".join(model.geom(g).name or f"geom {g}" for g in planes)
        faults.append(f"ground: expected one plane of the world, got {names or f'no geom {table.ground!r}'}; write "
                      "[robot] ground = the name of its geom")  # fmt: skip
        return None
    (ground,) = planes
    level = abs(model.geom_pos[ground, 2]) < _STRAIGHT and np.abs(model.geom_quat[ground, 1:3]).max() < _STRAIGHT
    if model.geom_bodyid[ground] != 0 or model.geom_type[ground] != mujoco.mjtGeom.mjGEOM_PLANE or not level:
        faults.append(f"ground: geom '{model.geom(ground).name}': expected the level plane z = 0 of the world (a slope "
                      "is set in the scenario)")  # fmt: skip
        return None
    return ground


def _base(model: mujoco.MjModel, table: Described, faults: list[str]) -> tuple[int, tuple[int, ...], bool] | None:
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


def _feet(
    model: mujoco.MjModel, data: mujoco.MjData, base: int, ground: int, table: Described, faults: list[str]
) -> tuple[FootParts, ...]:
    touching = [g for g in range(model.ngeom) if model.geom_bodyid[g] > 0 and _touches(model, g, ground)]
    if not touching:
        faults.append("feet: no geom can touch the ground; expected contype and conaffinity that meet the ground's, or "
                      "<contact><pair geom1=… geom2=…/></contact>")  # fmt: skip
        return ()
    if not table.foot:
        groups = _lowest_bodies(model, data, base, touching)
        if len(groups) != FEET:
            names = ", ".join(model.body(group[0]).name for group in groups) or "none"
            faults.append(f"feet: expected two, recognised {len(groups)} ({names}); write [[robot.foot]] twice, each "
                          "with geoms, sites or bodies = […]")  # fmt: skip
            return ()
        parts = [(model.body(bodies[0]).name, [g for g in touching if model.geom_bodyid[g] in bodies], [])
                 for bodies in groups]  # fmt: skip
    else:
        if len(table.foot) != FEET:
            faults.append(f"feet: expected two tables [[robot.foot]], got {len(table.foot)}")
            return ()
        parts = [_named(model, i, foot, touching, faults) for i, foot in enumerate(table.foot)]
    return tuple(_foot(model, data, base, *part, faults) for part in parts)


def _touches(model: mujoco.MjModel, geom: int, ground: int) -> bool:
    """Whether a geom meets the ground."""
    pairs = {frozenset((int(model.pair_geom1[i]), int(model.pair_geom2[i]))) for i in range(model.npair)}
    a, b = (model.geom_contype[geom], model.geom_conaffinity[geom]), (
        model.geom_contype[ground], model.geom_conaffinity[ground])  # fmt: skip
    return bool(a[0] & b[1] or b[0] & a[1]) or frozenset((geom, ground)) in pairs


def _lowest_bodies(model: mujoco.MjModel, data: mujoco.MjData, base: int, touching: Sequence[int]) -> list[list[int]]:
    """Bodies that stand on the ground in the start, those on one chain together."""
    low = {}
    for geom in touching:
        body = int(model.geom_bodyid[geom])
        if body != base:
            low[body] = min(low.get(body, np.inf), float(points_of(model, data, geom)[:, 2].min()))
    if not low:
        return []
    height = float(data.subtree_com[base, 2]) - min(low.values())
    standing = sorted(body for body, z in low.items() if z < min(low.values()) + 0.1 * height)
    groups: list[list[int]] = []
    for body in standing:
        above = _above(model, body)
        home = next((group for group in groups if group[0] in above), None)
        groups.append([body]) if home is None else home.append(body)
    return groups


def _above(model: mujoco.MjModel, body: int) -> list[int]:
    """A body and all that it hangs on, outward first."""
    chain = []
    while body > 0:
        chain.append(body)
        body = int(model.body_parentid[body])
    return chain


def _named(
    model: mujoco.MjModel, i: int, foot: Foot, touching: Sequence[int], faults: list[str]
) -> tuple[str, list[int], list[int]]:
    """Name, geoms and sites of a foot that is described."""
    geoms, sites = [], []
    for key, names, count, kind in (
        ("geoms", foot.geoms, model.ngeom, model.geom),
        ("sites", foot.sites, model.nsite, model.site),
        ("bodies", foot.bodies, model.nbody, model.body),
    ):
        there = [kind(n).name for n in range(count)]
        for name in names:
            if name not in there:
                known = [one for one in there if one]
                faults.append(
                    f"foot[{i}].{key}: no {key[:-1].replace('bodie', 'body')} '{name}'; {nearest(name, known)}"
                )
                continue
            number = there.index(name)
            if key == "sites":
                sites.append(number)
            elif key == "bodies":
                geoms += [g for g in touching if model.geom_bodyid[g] == number]
            elif number in touching:
                geoms.append(number)
            else:
                faults.append(f"foot[{i}].geoms: '{name}' cannot touch the ground; expected contype and conaffinity "
                              "that meet the ground's, or a <pair>")  # fmt: skip
    bodies = {int(model.site_bodyid[site]) for site in sites}
    if sites and not geoms:
        geoms = [g for g in touching if model.geom_bodyid[g] in bodies]
    if not geoms and not any(f"foot[{i}]" in fault for fault in faults):
        faults.append(f"foot[{i}]: nothing of it touches the ground; write geoms, sites or bodies = […]")
    name = foot.name or (model.body(model.geom_bodyid[geoms[0]]).name if geoms else f"foot {i + 1}")
    return name, geoms, sites


def _foot(
    model: mujoco.MjModel, data: mujoco.MjData, base: int, name: str, geoms: list[int], sites: list[int],
    faults: list[str],
) -> FootParts:  # fmt: skip
    on, points = [], []
    if sites:
        on = [int(model.site_bodyid[site]) for site in sites]
        points = [tuple(model.site_pos[site].tolist()) for site in sites]
    else:
        places = [(int(model.geom_bodyid[g]), place) for g in geoms for place in points_of(model, data, g)]
        lowest = {body: min(place[2] for one, place in places if one == body) for body, _ in places}
        for body, place in places:
            if place[2] < lowest[body] + FLAT:  # of a foot of several geoms the sole counts
                on.append(body)
                turn = data.xmat[body].reshape(3, 3)
                points.append(tuple((turn.T @ (place - data.xpos[body])).tolist()))
    if base in on:
        faults.append(f"foot '{name}': is the base itself; write [[robot.foot]] with what stands on the ground")
    return FootParts(name=name, bodies=tuple(dict.fromkeys(on)), geoms=tuple(geoms), on=tuple(on), points=tuple(points))


def _leg(model: mujoco.MjModel, data: mujoco.MjData, base: int, foot: FootParts, other: FootParts) -> float:
    """[m] from hip to sole along the joints: the hip is the first joint that the other leg does not hang on."""
    shared = set(_above(model, other.bodies[0])) | {base}
    chain = [body for body in reversed(_above(model, foot.bodies[0])) if body not in shared]
    anchors = [data.xanchor[j] for body in chain
               for j in range(model.body_jntadr[body], model.body_jntadr[body] + model.body_jntnum[body])]  # fmt: skip
    if not anchors:
        return float(data.subtree_com[base, 2])
    sole = min(
        float((data.xpos[body] + data.xmat[body].reshape(3, 3) @ place)[2])
        for body, place in zip(foot.on, foot.points, strict=True)
    )
    along = sum(float(np.linalg.norm(b - a)) for a, b in pairwise(anchors))
    return along + float(anchors[-1][2]) - sole


def _names(model: mujoco.MjModel, which: str) -> tuple[str, ...]:
    """Of the numbers in q or v, joint by joint."""
    names: list[str] = []
    free = {"q": ("x", "y", "z", "qw", "qx", "qy", "qz"), "v": ("x", "y", "z", "wx", "wy", "wz")}[which]
    for j in range(model.njnt):
        name = model.joint(j).name
        match mujoco.mjtJoint(model.jnt_type[j]):
            case mujoco.mjtJoint.mjJNT_FREE:
                names += [f"{name}.{part}" for part in free]
            case mujoco.mjtJoint.mjJNT_BALL:
                names += [f"{name}.{part}" for part in free[3:]]
            case _:
                names.append(name)
    return tuple(names)
