"""Parts of a robot in a model file: its base and the ground below it, its legs, where its feet touch, its actuators."""

from collections.abc import Sequence
from itertools import pairwise

import mujoco
import numpy as np

from biped.base.files import nearest
from biped.base.typed import LARGEST
from biped.robot.ground import GRAVITY
from biped.robot.robot import Drive, FootParts, Robot
from biped.scenario.robot import Described

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


def contact_points(data: mujoco.MjData, robot: Robot) -> np.ndarray:
    """(P, 3) [m] contact points; of data with kinematics."""
    return np.concatenate([places_of(data, foot) for foot in robot.feet])


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


def pairs_of(model: mujoco.MjModel) -> set[frozenset[int]]:
    """Geoms that the file says meet."""
    return {frozenset((int(model.pair_geom1[i]), int(model.pair_geom2[i]))) for i in range(model.npair)}


def touches(model: mujoco.MjModel, pairs: set[frozenset[int]], geom: int, ground: int) -> bool:
    """Whether a geom meets the ground: as one of the file's pairs, or by what it is if its body is not excluded."""
    a, b = (model.geom_contype[geom], model.geom_conaffinity[geom]), (
        model.geom_contype[ground], model.geom_conaffinity[ground])  # fmt: skip
    if frozenset((geom, ground)) in pairs:
        return True
    low, high = sorted(int(model.geom_bodyid[one]) for one in (geom, ground))
    return bool(a[0] & b[1] or b[0] & a[1]) and (low << 16) + high not in model.exclude_signature


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


def base_places(model: mujoco.MjModel, robot: Robot) -> list[int]:
    """Where the coordinates of the base's place stand in q: along x, y and z, in the plane along x and z."""
    first = int(model.jnt_qposadr[model.body_jntadr[robot.base_number]])
    if not robot.planar:
        return [first, first + 1, first + 2]
    return [int(model.jnt_qposadr[model.dof_jntid[column]]) for column in robot.moving_columns]


def height_of(model: mujoco.MjModel, robot: Robot) -> int:
    """Which coordinate lifts the base."""
    return base_places(model, robot)[-1]


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


def own_masses(model: mujoco.MjModel, base: int) -> np.ndarray:
    """(bodies,) [kg] masses by number, of what stands beside the robot none."""
    ours = [number > 0 and belongs(model, number, base) for number in range(model.nbody)]
    return np.where(ours, model.body_mass, 0.0)


_EVEN = 1e-6
"""Share of a range by which its ends may differ."""

MOST_GEAR = 1e6
"""Of an actuator; a motor with a gearbox of 100 has 100."""


def drives_of(model: mujoco.MjModel, table: Described, faults: list[str]) -> tuple[Drive, ...]:
    """The actuators that a law commands.

    Args:
        model: The compiled model.
        table: What is said of the robot.
        faults: What is wrong is added here.
    """
    there = [model.actuator(i).name for i in range(model.nu)]
    wanted = list(table.actuators.names) or there
    if not wanted:
        faults.append("actuators: none; write <actuator><motor joint=…/></actuator> for each joint that is driven")
    found = []
    for name in wanted:
        if name not in there:
            faults.append(f"actuators.names: '{name}' is no actuator of the file; {nearest(name, there)}")
            continue
        drive = _drive(model, there.index(name), table, faults)
        if drive is not None:
            found.append(drive)
    driven = [drive.joint for drive in found]
    for joint in sorted({joint for joint in driven if driven.count(joint) > 1}):
        faults.append(f"actuators: joint '{joint}' has several; write [robot.actuators] names = […] with one for each")
    return tuple(found)


def _drive(model: mujoco.MjModel, i: int, table: Described, faults: list[str]) -> Drive | None:
    name, gear = model.actuator(i).name, float(model.actuator_gear[i, 0])
    if mujoco.mjtTrn(model.actuator_trntype[i]) not in (mujoco.mjtTrn.mjTRN_JOINT, mujoco.mjtTrn.mjTRN_JOINTINPARENT):
        faults.append(f"actuator '{name}': expected one on a joint (joint=…), not on a tendon, a site or a body")
        return None
    joint = int(model.actuator_trnid[i, 0])
    if mujoco.mjtJoint(model.jnt_type[joint]) not in (mujoco.mjtJoint.mjJNT_HINGE, mujoco.mjtJoint.mjJNT_SLIDE):
        faults.append(f"actuator '{name}': joint '{model.joint(joint).name}': expected a hinge or a slide")
        return None
    if model.actuator_dyntype[i] != mujoco.mjtDyn.mjDYN_NONE:
        faults.append(f"actuator '{name}': has a state of its own (muscle, filter, integrator); expected none: write "
                      "<motor>, <position> or <velocity>, and a lag as actuation.lag")  # fmt: skip
        return None
    kind = _kind(model, i)
    if kind is None:
        faults.append(f"actuator '{name}': neither torque, position nor velocity; write <motor>, <position> or "
                      "<velocity>")  # fmt: skip
        return None
    if model.actuator_history[i, 0] > 0:
        faults.append(f"actuator '{name}': has a delay of its own; expected none: write a lag as actuation.lag")
        return None
    if abs(gear) > MOST_GEAR:
        faults.append(f"actuator '{name}': gear {gear:g}: expected at most {MOST_GEAR:g}")
        return None
    if gear == 0.0:
        faults.append(f"actuator '{name}': gear 0 moves nothing; expected another")
        return None
    servo = gear * gear * float(model.actuator_gainprm[i, 0]) if kind != "torque" else 0.0
    damping = -(gear * gear) * float(model.actuator_biasprm[i, 2])
    low, high = sorted((model.actuator_ctrlrange[i] / gear).tolist())
    return Drive(
        name=name,
        joint=model.joint(joint).name,
        kind=kind,
        limit=_limit(model, i, joint, kind, gear, faults),
        place=int(model.jnt_qposadr[joint]),
        column=int(model.jnt_dofadr[joint]),
        turns=_turns(model, joint),
        stiffness=servo if kind == "position" else table.actuators.stiffness,
        damping=damping if kind != "torque" else table.actuators.damping,
        span=(low, high) if kind == "position" and model.actuator_ctrllimited[i] else None,
    )


def _turns(model: mujoco.MjModel, joint: int) -> int:
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    along = float(data.xaxis[joint, 1])
    return 0 if abs(along) < 0.7 or model.jnt_type[joint] != mujoco.mjtJoint.mjJNT_HINGE else (1 if along < 0 else -1)


def _kind(model: mujoco.MjModel, i: int) -> str | None:
    gain, bias = model.actuator_gainprm[i], model.actuator_biasprm[i]
    if model.actuator_gaintype[i] != mujoco.mjtGain.mjGAIN_FIXED or gain[0] == 0.0:
        return None
    if model.actuator_biastype[i] == mujoco.mjtBias.mjBIAS_NONE:
        return "torque"
    if model.actuator_biastype[i] != mujoco.mjtBias.mjBIAS_AFFINE or bias[0] != 0.0:
        return None
    if bias[1] == -gain[0]:
        return "position"
    return "velocity" if bias[1] == 0.0 and bias[2] == -gain[0] else None


def _limit(model: mujoco.MjModel, i: int, joint: int, kind: str, gear: float, faults: list[str]) -> float:
    """[N m] at the joint: the least of what actuator, joint and, of a motor, the control's range say."""
    limits, gain = [LARGEST], abs(gear * float(model.actuator_gainprm[i, 0]))
    for what, limited, span, factor in (
        ("forcerange", model.actuator_forcelimited[i], model.actuator_forcerange[i], abs(gear)),
        ("actuatorfrcrange of its joint", model.jnt_actfrclimited[joint], model.jnt_actfrcrange[joint], 1.0),
        ("ctrlrange", kind == "torque" and model.actuator_ctrllimited[i], model.actuator_ctrlrange[i], gain),
    ):
        if limited:
            low, high = (float(end) for end in span)
            if abs(low + high) > _EVEN * (high - low):
                faults.append(f"actuator '{model.actuator(i).name}': {what} {low:g} {high:g}: expected as much one way "
                              "as the other: a law's torques have one limit")  # fmt: skip
            limits.append(factor * max(-low, high))
    return min(limits)
