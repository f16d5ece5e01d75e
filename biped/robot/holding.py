"""Parts of a model file that hold or drive a robot from outside: a biped has its actuators and the ground, no more.

Each is named, with what it is and what is expected. `biped.measure.momentum` needs no such list: it finds in a run
whatever else acts.
"""

from collections.abc import Iterator, Sequence

import mujoco
import numpy as np

_JOINT = (mujoco.mjtTrn.mjTRN_JOINT, mujoco.mjtTrn.mjTRN_JOINTINPARENT)
_NEEDED = ("CONSTRAINT", "CONTACT", "DAMPER", "GRAVITY", "ACTUATION")
"""Parts of the physics that no file may take away."""


def holds(model: mujoco.MjModel, base: Sequence[int]) -> list[str]:
    """Names what holds or drives a robot from outside.

    Args:
        model: The model file.
        base: Columns of v in which the base moves.

    Returns:
        A sentence for each part, and what is expected.
    """
    return [*_of_joints(model, base), *_of_actuators(model, base), *_of_equalities(model, base),
            *_of_tendons(model, base), *_of_options(model), *_of_bodies(model)]  # fmt: skip


_AS_FREE = [*[mujoco.mjtJoint.mjJNT_SLIDE] * 3, mujoco.mjtJoint.mjJNT_BALL]
_SMALL = 1e-9


def free_bases(spec: mujoco.MjSpec, notes: list[str]) -> None:
    """Turns three slides along x, y and z and a ball, by which the base of some files moves, into a free joint.

    Velocities are the same, and so are coordinates, but that a slide counts from where the body stands in the file.

    Args:
        spec: The parsed file, which is changed.
        notes: What is changed is added here.

    Raises:
        ValueError: MuJoCo cannot compile the file.
    """
    found = [body for body in spec.bodies if [joint.type for joint in body.joints] == _AS_FREE]
    if not found:
        return
    needed = {one.target for one in spec.actuators} | {one.objname for one in spec.sensors}
    model = spec.copy().compile()
    for body in found:
        joints = list(body.joints)
        number = list(spec.bodies).index(body)
        if any(joint.name and joint.name in needed for joint in joints) or not _moves_freely(model, number):
            continue
        first = int(model.jnt_qposadr[model.body_jntadr[number]])
        for key, qpos in zip(spec.keys, model.key_qpos, strict=True):
            qpos[first : first + 3] += model.body_pos[number]
            key.qpos = qpos
        for joint in joints:
            spec.delete(joint)
        body.add_freejoint()
        notes.append(f"base: three slides and a ball of body '{body.name}' are taken for a free joint")


def _moves_freely(model: mujoco.MjModel, body: int) -> bool:
    """Whether three slides and a ball move a body of the world as a free joint would."""
    joints = slice(model.body_jntadr[body], model.body_jntadr[body] + len(_AS_FREE))
    first = model.jnt_qposadr[joints][0]
    return bool(
        model.body_parentid[body] == 0
        and np.abs(model.body_quat[body] - (1.0, 0.0, 0.0, 0.0)).max() < _SMALL
        and np.abs(model.jnt_axis[joints][:3] - np.eye(3)).max() < _SMALL
        and not model.jnt_limited[joints].any()
        and not model.jnt_pos[joints].any()
        and not model.qpos0[first : first + 3].any()
    )


def let_go(spec: mujoco.MjSpec, notes: list[str]) -> None:
    """Takes damping, friction and armature off free joints, which files have by mistake: their defaults say so.

    Args:
        spec: The parsed file, which is changed.
        notes: What is taken off is added here.
    """
    for joint in spec.joints:
        if joint.type != mujoco.mjtJoint.mjJNT_FREE:
            continue
        found = {"damping": float(np.abs(joint.damping).max()), "frictionloss": float(joint.frictionloss),
                 "armature": float(joint.armature), "stiffness": float(np.abs(joint.stiffness).max())}  # fmt: skip
        parts = [f"{what} {value:g}" for what, value in found.items() if value]
        if parts:
            joint.damping, joint.stiffness = np.zeros_like(joint.damping), np.zeros_like(joint.stiffness)
            joint.frictionloss = joint.armature = 0.0
            notes.append(f"joint '{joint.name}' of the base: {', '.join(parts)} left out: nobody holds the base")


def unknown_at_home(model: mujoco.MjModel, base: Sequence[int]) -> list[str]:
    """Names parts inside a robot that the home engine has no equations for: it would leave them out.

    Args:
        model: The model file of seven links.
        base: As of `holds`.
    """
    out = []
    for dof in sorted(set(range(model.nv)) - set(base)):
        joint = int(model.dof_jntid[dof])
        found = {
            "stiffness": bool(model.jnt_stiffness[joint] or np.any(model.jnt_stiffnesspoly[joint])),
            "frictionloss": bool(model.dof_frictionloss[dof]),
            "damping that is not linear": bool(model.dof_dampingpoly[dof].any()),
        }
        out += [f"joint '{model.joint(joint).name}': {what}" for what, there in found.items() if there]
    out += [f"equality '{model.equality(i).name or i}'" for i in range(model.neq)]
    return out + [f"tendon '{model.tendon(i).name or i}'" for i in range(model.ntendon)]


def _of_joints(model: mujoco.MjModel, base: Sequence[int]) -> Iterator[str]:
    for joint in sorted({int(model.dof_jntid[dof]) for dof in base}):
        dofs = [dof for dof in base if model.dof_jntid[dof] == joint]
        poly = model.dof_dampingpoly[dofs].any() or np.any(model.jnt_stiffnesspoly[joint])
        found = {
            "range": float(model.jnt_limited[joint]),
            "stiffness": float(model.jnt_stiffness[joint]),
            "damping": float(np.abs(model.dof_damping[dofs]).max()),
            "damping or stiffness that is not linear": float(poly),
            "frictionloss": float(model.dof_frictionloss[dofs].max()),
            "armature": float(model.dof_armature[dofs].max()),
        }
        for what, value in found.items():
            if value:
                size = "" if what == "range" or what.endswith("linear") else f" {value:g}"
                name = model.joint(joint).name
                yield f"joint '{name}' of the base: {what}{size}: expected none: nobody holds the base"


def _of_actuators(model: mujoco.MjModel, base: Sequence[int]) -> Iterator[str]:
    for i in range(model.nu):
        kind, target = mujoco.mjtTrn(model.actuator_trntype[i]), int(model.actuator_trnid[i, 0])
        name = model.actuator(i).name or i
        if kind in _JOINT:
            if any(model.dof_jntid[dof] == target for dof in base):
                yield (f"actuator '{name}': drives the base by its joint '{model.joint(target).name}': expected none: "
                       "the ground alone moves the whole")  # fmt: skip
        elif kind == mujoco.mjtTrn.mjTRN_SITE and int(model.actuator_trnid[i, 1]) < 0:
            yield f"actuator '{name}': pushes a site against nothing: expected a torque at a joint"
        elif kind == mujoco.mjtTrn.mjTRN_BODY:
            yield f"actuator '{name}': sticks to what it touches: expected a torque at a joint"


def _of_equalities(model: mujoco.MjModel, base: Sequence[int]) -> Iterator[str]:
    kinds = mujoco.mjtEq
    for i in range(model.neq):
        kind, name = kinds(model.eq_type[i]), model.equality(i).name or i
        ends = [int(model.eq_obj1id[i]), int(model.eq_obj2id[i])]
        if kind in (kinds.mjEQ_CONNECT, kinds.mjEQ_WELD):
            of_sites = model.eq_objtype[i] == mujoco.mjtObj.mjOBJ_SITE
            bodies = [int(model.site_bodyid[end]) if of_sites else end for end in ends]
            if any(_still(model, body) for body in bodies):
                word = "welded" if kind == kinds.mjEQ_WELD else "connected"
                held = " and ".join(model.body(body).name for body in bodies if not _still(model, body)) or "a body"
                yield f"equality '{name}': '{held}' is {word} to the world: expected none: nobody holds the robot"
        elif kind == kinds.mjEQ_JOINT:
            held = [end for end in ends if end >= 0 and any(model.dof_jntid[dof] == end for dof in base)]
            for joint in held:
                yield (f"equality '{name}': holds the joint '{model.joint(joint).name}' of the base: expected none: "
                       "nobody holds the base")  # fmt: skip


def _of_tendons(model: mujoco.MjModel, base: Sequence[int]) -> Iterator[str]:
    joints, sites = mujoco.mjtWrap.mjWRAP_JOINT, mujoco.mjtWrap.mjWRAP_SITE
    solids = (mujoco.mjtWrap.mjWRAP_SPHERE, mujoco.mjtWrap.mjWRAP_CYLINDER)
    for i in range(model.ntendon):
        first, name = int(model.tendon_adr[i]), model.tendon(i).name or i
        for wrap in range(first, first + int(model.tendon_num[i])):
            kind, part = model.wrap_type[wrap], int(model.wrap_objid[wrap])
            if kind == joints and any(model.dof_jntid[dof] == part for dof in base):
                joint = model.joint(part).name
                yield f"tendon '{name}': goes over the joint '{joint}' of the base: expected the robot's own joints"
            elif (kind == sites and _still(model, int(model.site_bodyid[part]))) or (
                kind in solids and _still(model, int(model.geom_bodyid[part]))
            ):
                yield f"tendon '{name}': is fastened to the world: expected one between parts of the robot"
                break


def _of_options(model: mujoco.MjModel) -> Iterator[str]:
    option = model.opt
    off = [name for name in _NEEDED if option.disableflags & getattr(mujoco.mjtDisableBit, f"mjDSBL_{name}")]
    if off:
        yield f"option: flag: {', '.join(name.lower() for name in off)} disabled; expected enabled"
    if option.enableflags & mujoco.mjtEnableBit.mjENBL_OVERRIDE:
        yield "option: flag: override enabled; expected disabled: how the ground is, the scenario says"
    if np.any(option.wind):
        yield f"option: wind {' '.join(f'{one:g}' for one in option.wind)}: expected none; push it with [[push]]"
    for what in ("density", "viscosity"):
        if value := float(getattr(option, what)):
            yield f"option: {what} {value:g}: expected 0: no air bears or drives a robot"


def _of_bodies(model: mujoco.MjModel) -> Iterator[str]:
    for body in np.flatnonzero(model.body_gravcomp):
        yield (f"body '{model.body(int(body)).name}': gravcomp {model.body_gravcomp[body]:g}: expected 0: only its "
               "actuators and the ground hold a robot up")  # fmt: skip


def _still(model: mujoco.MjModel, body: int) -> bool:
    """Whether a body is the world, or fixed to it."""
    return model.body_weldid[body] == 0
