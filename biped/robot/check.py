"""What a model file must be: the seven links, nine joints, six motors and four contact points, in the plane.

Both libraries read the file, and each silently tolerates what the other does not (Pinocchio drops unnamed bodies, knows
no gears), so whatever would make them disagree is refused here.
"""

from __future__ import annotations

import mujoco
import numpy as np

from biped.base.errors import InputError
from biped.base.files import nearest
from biped.robot.tree import ACTUATORS, JOINTS, LINKS, PARENT, POINT_LINK, POINT_RADIUS, POINTS

_SLACK = 1e-9


def check_parts(spec: mujoco.MjSpec, name: str) -> None:
    """Checks that a parsed model file has every named part, before the compiler stumbles over what refers to it.

    Args:
        spec: The model file.
        name: The file, for the error.

    Raises:
        InputError: It lacks a named part, has it in another place, or a body has no name.
    """
    bodies = [body for body in spec.bodies if body.name != "world"]
    for body in bodies:
        if not body.name:
            inside = body.parent.name or "an unnamed body"
            raise InputError(
                f"{name}: a body inside '{inside}' has no name; expected exactly the bodies {', '.join(LINKS)}"
            )
    kinds = (
        ("body", LINKS, bodies),
        ("joint", JOINTS, spec.joints),
        ("actuator", ACTUATORS, spec.actuators),
        ("site", POINTS, spec.sites),
        ("contact pair", POINTS, spec.pairs),
        ("geom", ("ground", *POINTS), spec.geoms),
    )
    for kind, wanted, parts in kinds:
        there = [part.name for part in parts]
        for part in wanted:
            if part not in there:
                spare = [other for other in there if other and other not in wanted]
                hint = nearest(part, spare) if spare else f"there are: {', '.join(there)}"
                raise InputError(f"{name}: {kind} '{part}': missing; {hint}")
    for i, joint in enumerate(JOINTS):
        link, there = LINKS[max(0, i - 2)], spec.joint(joint).parent.name
        if there != link:
            raise InputError(f"{name}: joint '{joint}': expected in body '{link}', got in body '{there}'")


def check_model(model: mujoco.MjModel, name: str) -> None:
    """Checks a compiled model file.

    Args:
        model: The model.
        name: The file, for the error.

    Raises:
        InputError: It has other parts or another order, or is not planar.
    """
    _exactly(model, name)
    _bodies(model, name)
    _joints(model, name)
    _motors(model, name)
    _contacts(model, name)


def _exactly(model: mujoco.MjModel, name: str) -> None:
    kinds = (
        ("bodies", LINKS, [model.body(i).name for i in range(1, model.nbody)]),
        ("joints", JOINTS, [model.joint(i).name for i in range(model.njnt)]),
        ("actuators", ACTUATORS, [model.actuator(i).name for i in range(model.nu)]),
        ("contact pairs", POINTS, [model.pair(i).name for i in range(model.npair)]),
    )
    for parts, wanted, there in kinds:
        if tuple(there) != wanted:
            raise InputError(
                f"{name}: {parts}: expected exactly {', '.join(wanted)} in this order, got {', '.join(there)}"
            )


def _bodies(model: mujoco.MjModel, name: str) -> None:
    for link, up in zip(LINKS, PARENT, strict=True):
        parent = model.body(model.body_parentid[model.body(link).id]).name
        expected = "world" if up < 0 else LINKS[up]
        if parent != expected:
            raise InputError(f"{name}: body '{link}': expected inside '{expected}', got inside '{parent}'")
    torso = model.body("torso").id
    if np.abs(model.body_pos[torso]).max() + np.abs(model.body_ipos[torso]).max() > _SLACK:
        raise InputError(f"{name}: body 'torso': expected its frame and centre of mass at the world's origin")


def _joints(model: mujoco.MjModel, name: str) -> None:
    for i, joint in enumerate(JOINTS):
        axis = ((1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, -1.0, 0.0))[min(i, 2)]
        kind = mujoco.mjtJoint.mjJNT_SLIDE if i < 2 else mujoco.mjtJoint.mjJNT_HINGE
        if (
            model.jnt_type[i] != kind
            or np.abs(model.jnt_axis[i] - axis).max() > _SLACK
            or np.abs(model.jnt_pos[i]).max() > _SLACK
        ):
            word = "slide" if i < 2 else "hinge"
            raise InputError(
                f"{name}: joint '{joint}': expected axis {' '.join(f'{a:g}' for a in axis)} of a {word} at its body's "
                "origin"
            )


def _motors(model: mujoco.MjModel, name: str) -> None:
    for i, motor in enumerate(ACTUATORS):
        drives = model.actuator_trntype[i] == mujoco.mjtTrn.mjTRN_JOINT
        direct = model.actuator_gear[i, 0] == 1.0 and model.actuator_gainprm[i, 0] == 1.0
        if (
            not (drives and direct)
            or model.joint(model.actuator_trnid[i, 0]).name != motor
            or model.actuator_biastype[i] != mujoco.mjtBias.mjBIAS_NONE
            or model.actuator_dyntype[i] != mujoco.mjtDyn.mjDYN_NONE
        ):
            raise InputError(
                f"{name}: actuator '{motor}': expected a motor on joint '{motor}' with gear 1, so that its control is "
                "the joint's torque"
            )


def _contacts(model: mujoco.MjModel, name: str) -> None:
    ground = model.geom("ground")
    upright = np.abs(ground.quat - [1.0, 0.0, 0.0, 0.0]).max() < _SLACK
    if ground.type[0] != mujoco.mjtGeom.mjGEOM_PLANE or ground.bodyid[0] != 0 or ground.pos[2] != 0.0 or not upright:
        raise InputError(f"{name}: geom 'ground': expected the level plane z = 0 (a slope is set in the scenario)")
    for point, link in zip(POINTS, POINT_LINK, strict=True):
        geom, site, pair = model.geom(point), model.site(point), model.pair(point)
        if {model.geom(int(pair.geom1[0])).name, model.geom(int(pair.geom2[0])).name} != {"ground", point}:
            raise InputError(f"{name}: contact pair '{point}': expected between geoms 'ground' and '{point}'")
        if geom.type[0] != mujoco.mjtGeom.mjGEOM_SPHERE or abs(geom.size[0] - POINT_RADIUS) > 1e-3 * POINT_RADIUS:
            raise InputError(f"{name}: geom '{point}': expected a sphere of size {POINT_RADIUS:g}, a contact point")
        for what, body in (("geom", geom.bodyid[0]), ("site", site.bodyid[0])):
            if model.body(body).name != LINKS[link]:
                raise InputError(
                    f"{name}: {what} '{point}': expected in body '{LINKS[link]}', got in '{model.body(body).name}'"
                )
        if np.abs(geom.pos - site.pos).max() > _SLACK:
            raise InputError(
                f"{name}: geom '{point}': expected where site '{point}' is, at {' '.join(f'{x:g}' for x in site.pos)}"
            )
