"""Recognises the robot in a model file: base, feet, actuators; every fault at once, each with what to write."""

from collections.abc import Mapping, Sequence
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

import mujoco
import numpy as np

from biped.base.errors import InputError
from biped.base.files import label, nearest
from biped.robot import parts
from biped.robot.holding import holds
from biped.robot.robot import FootParts, Robot
from biped.robot.safety import examine, packaged, tried
from biped.robot.sole import FLAT, points_of
from biped.robot.spec import check_sizes, parsed
from biped.scenario.robot import Described, Foot

FEET = 2


class Looked(NamedTuple):
    """A robot that was found in a model file, or its faults.

    Attributes:
        robot: What it is; None where faults leave nothing that could walk.
        faults: What is wrong, and what to write.
        notes: What of the file was left out, without harm.
    """

    robot: Robot | None
    faults: tuple[str, ...]
    notes: tuple[str, ...] = ()


def robot_of(path: Path, table: Described) -> Robot:
    """The robot in a model file.

    Raises:
        InputError: It is none: all that is wrong.
    """
    robot, faults, _ = looked_at(path, table)
    if robot is None:
        many = f"{len(faults)} faults: " if len(faults) > 1 else ""
        raise InputError(f"{label(path)}: {many}{'; '.join(faults)}", "model")
    return robot


def looked_at(path: Path, table: Described) -> Looked:
    """Recognises the robot in a model file, or finds what is wrong with it.

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
    notes: list[str] = []
    model = parsed(path, table, notes)[1]
    found = _recognised(path, model, table)
    if found.robot is not None and (idle := parts.other_planes(model, found.robot.ground)):
        names = ", ".join(f"'{model.geom(g).name or g}'" for g in idle)
        notes.append(f"ground: '{model.geom(found.robot.ground).name}'; level planes of the same height touch nothing: "
                     f"{names}")  # fmt: skip
    return found._replace(notes=tuple(notes))


def _survives(path: Path, table: Described) -> None:
    """Does once all that is done with a model file before anything is known of it."""
    _, model = parsed(path, table)
    check_sizes(model, label(path))
    mujoco.mj_step(model, mujoco.MjData(model))


def _recognised(path: Path, model: mujoco.MjModel, table: Described) -> Looked:
    faults: list[str] = []
    start = _start(model, table, faults)
    parts.physics_of(model, faults)
    drives = parts.drives_of(model, table, faults)
    ground = parts.ground_of(model, table, faults)
    base = parts.base_of(model, table, faults)
    faults += holds(model, () if base is None else base[1])
    if base is None or ground is None:
        return Looked(None, tuple(faults))
    number, columns, planar = base
    parts.surroundings(model, number, ground, faults)
    # A sole is seen where it lies flat: in the posture in which it has most points, the flattest of such.
    tried_out: list[tuple[tuple[int, float], list[str], tuple[FootParts, ...], mujoco.MjData]] = []
    for data in _postures(model, start):
        found: list[str] = []
        feet = _feet(model, data, number, ground, table, found)
        number_of_points = sum(len(foot.points) for foot in feet) - 1000 * len(found)
        uneven = max((float(np.ptp(parts.places_of(data, foot)[:, 2])) for foot in feet if foot.points), default=0.0)
        tried_out.append(((number_of_points, -round(uneven, 3)), found, feet, data))
    _, found, feet, data = max(tried_out, key=lambda one: one[0])
    faults += found
    if faults:
        return Looked(None, tuple(faults))
    turn = tried_out[0][3].xmat[number].reshape(3, 3)
    robot = Robot(
        name=path.stem,
        description=table.description,
        planar=planar,
        base=model.body(number).name,
        base_number=number,
        base_columns=columns,
        upright=tuple(turn[2].tolist()),
        forward=tuple(turn[0].tolist()),
        top=_top(model, tried_out[0][3], number),
        bodies=tuple(model.body(i).name for i in range(1, model.nbody)),
        masses=tuple(parts.own_masses(model, number)[1:].tolist()),
        q_names=_names(model, "q"),
        v_names=_names(model, "v"),
        drives=drives,
        feet=feet,
        ground=ground,
        leg=table.leg or parts.leg_length(model, data, number, feet[0], feet[1]),
        start=start,
        starts=tuple(model.key(i).name for i in range(model.nkey)),
        walked=table.walked,
        shown=table.shown,
        trunk=model.body(_trunk(model, number)).name,
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


def _feet(
    model: mujoco.MjModel, data: mujoco.MjData, base: int, ground: int, table: Described, faults: list[str]
) -> tuple[FootParts, ...]:
    pairs = parts.pairs_of(model)
    ours = [g for g in range(model.ngeom) if parts.belongs(model, int(model.geom_bodyid[g]), base)]
    touching = [g for g in ours if parts.touches(model, pairs, g, ground)]
    if not touching:
        faults.append("feet: no geom can touch the ground; expected contype and conaffinity that meet the ground's, or "
                      "<contact><pair geom1=… geom2=…/></contact>")  # fmt: skip
        return ()
    if not table.foot:
        low = _lowest_points(model, data, base, touching)
        groups = _lowest_bodies(model, low)
        if len(groups) != FEET:
            names = ", ".join(model.body(group[0]).name for group in groups) or "none"
            faults.append(f"feet: expected two, recognised {len(groups)} ({names}){_next_above(model, low, groups)}; "
                          "write [[robot.foot]] twice, each with geoms, sites or bodies = […]")  # fmt: skip
            return ()
        groups.sort(key=lambda group: float(data.xpos[group[0], 1]))  # the right one first
        feet = [(model.body(bodies[0]).name, [g for g in touching if model.geom_bodyid[g] in bodies], [])
                for bodies in groups]  # fmt: skip
    else:
        if len(table.foot) != FEET:
            faults.append(f"feet: expected two tables [[robot.foot]], got {len(table.foot)}")
            return ()
        feet = [_named(model, i, foot, touching, faults) for i, foot in enumerate(table.foot)]
        if feet[0][0] == feet[1][0]:
            faults.append(f"robot.foot[1].name: expected another name than that of the first foot, '{feet[0][0]}'")
        if both := set(feet[0][1]) & set(feet[1][1]):
            faults.append(f"robot.foot[1]: geom '{model.geom(min(both)).name}' is part of the first foot too; expected "
                          "each geom in one foot")  # fmt: skip
    return tuple(_foot(model, data, base, *foot, faults) for foot in feet)


def _lowest_points(model: mujoco.MjModel, data: mujoco.MjData, base: int, touching: Sequence[int]) -> dict[int, float]:
    """[m] how low bodies reach that can touch the ground, without the base."""
    low: dict[int, float] = {}
    for geom in touching:
        body = int(model.geom_bodyid[geom])
        if body != base:
            low[body] = min(low.get(body, np.inf), float(points_of(model, data, geom)[:, 2].min()))
    return low


def _lowest_bodies(model: mujoco.MjModel, low: Mapping[int, float]) -> list[list[int]]:
    """Bodies that stand on the ground in the start, those on one chain together."""
    standing = sorted(body for body, z in low.items() if z < min(low.values()) + 0.5 * FLAT)
    groups: list[list[int]] = []
    for body in standing:
        chain = parts.above(model, body)
        home = next((group for group in groups if group[0] in chain), None)
        groups.append([body]) if home is None else home.append(body)
    return groups


def _next_above(model: mujoco.MjModel, low: Mapping[int, float], groups: Sequence[Sequence[int]]) -> str:
    """Says how far the other leg hangs above the ground where one foot alone is on it: legs differ, or it is lifted."""
    if len(groups) != 1:
        return ""
    first = groups[0][0]
    others = [body for body in low if first not in parts.above(model, body) and body not in parts.above(model, first)]
    if not others:
        return ""
    body = min(others, key=low.__getitem__)
    higher = low[body] - min(low.values())
    return f", and of the other leg '{model.body(body).name}' is lowest, {higher:.3g} m above it in the start"


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
            if len(geoms) == 1 or place[2] < lowest[body] + FLAT:  # of a foot of several geoms the sole counts
                on.append(body)
                turn = data.xmat[body].reshape(3, 3)
                points.append(tuple((turn.T @ (place - data.xpos[body])).tolist()))
    if base in on:
        faults.append(f"foot '{name}': is the base itself; write [[robot.foot]] with what stands on the ground")
    joints = parts.pitching(model, data, base, on[0]) if on else ()
    return FootParts(
        name=name, bodies=tuple(dict.fromkeys(on)), geoms=tuple(geoms), on=tuple(on), points=tuple(points),
        joints=joints, pitching=tuple(model.joint(j).name for j in joints),
    )  # fmt: skip


def _trunk(model: mujoco.MjModel, base: int) -> int:
    """The base, or of one without mass (the root link of many a URDF) the heaviest body that is fixed to it."""
    if model.body_mass[base] > 0.0:
        return base
    return int(np.argmax(np.where(model.body_weldid == base, model.body_mass, 0.0)))


def _top(model: mujoco.MjModel, data: mujoco.MjData, base: int) -> tuple[float, float, float]:
    """Above the base's frame, as high as anything of the robot with its coordinates at zero."""
    high = max(
        float(data.geom_xpos[g, 2] + model.geom_rbound[g])
        for g in range(model.ngeom)
        if parts.belongs(model, int(model.geom_bodyid[g]), base)
    )
    up = high - float(data.xpos[base, 2])
    x, y, z = (up * data.xmat[base].reshape(3, 3)[2]).tolist()
    return x, y, z


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
