"""models/*.xml as they are: parsed, checked, tried elsewhere first, and what is written in them.

Coordinates are x, z of the torso's centre of mass, pitch, then hip, knee and ankle leg by leg; the file's may be in
another order (`biped.robot.planar.order`). What MuJoCo steps is `biped.robot.planar.build`. Both libraries read the
file, and each silently tolerates what the other does not (Pinocchio drops unnamed bodies, knows no gears), so whatever
would make them disagree is refused here.
"""

from functools import lru_cache
from pathlib import Path

import mujoco
import numpy as np

from biped.base.errors import InputError, short
from biped.base.files import label, nearest
from biped.robot.holding import holds, unknown_at_home
from biped.robot.planar.description import PlanarParts, description_at, version_of
from biped.robot.planar.order import canonical, order_of
from biped.robot.planar.topology import BASE, LINK_DOF, PARENT, POINT_LINK, TORSO, Z
from biped.robot.planar.tree import Tree, tree_of
from biped.robot.safety import examine, packaged, tried
from biped.robot.spec import check_sizes, compiled_spec, no_keyframe

_SLACK = 1e-9
ANY_ROBOT = (
    "others run with law = 'thesis', if they are bipeds with a free base, or with [robot] and law = 'stand' or "
    "'path.py:Class' (biped model FILE; docs/robots.md)"
)


def check_parts(spec: mujoco.MjSpec, name: str, robot: PlanarParts) -> None:
    """Checks that a parsed model file has every named part, before the compiler stumbles over what refers to it.

    Args:
        spec: The model file.
        name: The file, for the error.
        robot: Its description.

    Raises:
        InputError: It lacks a named part, has it in another place, or a body has no name.
    """
    bodies = [body for body in spec.bodies if body.name != "world"]
    for body in bodies:
        if not body.name:
            inside = body.parent.name or "an unnamed body"
            raise InputError(
                f"{name}: a body inside '{inside}' has no name; expected exactly the bodies {', '.join(robot.links)}"
            )
    kinds = (
        ("body", robot.links, bodies),
        ("joint", robot.joints, spec.joints),
        ("actuator", robot.actuators, spec.actuators),
        ("site", robot.points, spec.sites),
        ("contact pair", robot.points, spec.pairs),
        ("geom", (robot.contact.ground, *robot.points), spec.geoms),
    )
    missing = []
    for kind, wanted, parts in kinds:
        there = [part.name for part in parts]
        for part in wanted:
            if part not in there:
                spare = [other for other in there if other and other not in wanted]
                hint = nearest(part, spare) if spare else f"there are: {', '.join(there)}"
                missing.append((f"{kind} '{part}'", hint))
    if missing:
        (first, hint), *more = missing
        also = f"; missing too: {short(', '.join(part for part, _ in more), 600)}" if more else ""
        raise InputError(f"{name}: {first}: missing; {hint}{also}; {ANY_ROBOT}")
    for i, joint in enumerate(robot.joints):
        link, there = robot.links[max(TORSO, i - LINK_DOF)], spec.joint(joint).parent.name
        if there != link:
            raise InputError(f"{name}: joint '{joint}': expected in body '{link}', got in body '{there}'")


def check_model(model: mujoco.MjModel, name: str, robot: PlanarParts) -> None:
    """Checks a compiled model file.

    Args:
        model: The model.
        name: The file, for the error.
        robot: Its description.

    Raises:
        InputError: It has other parts, another tree, or is not planar.
    """
    _exactly(model, name, robot)
    _bodies(model, name, robot)
    _joints(model, name, robot)
    _motors(model, name, robot)
    _contacts(model, name, robot)
    if held := holds(model, base_dofs(model, robot)):
        raise InputError(f"{name}: {'; '.join(held)}")


def base_dofs(model: mujoco.MjModel, robot: PlanarParts) -> tuple[int, ...]:
    """Returns the columns of v in which the torso moves."""
    return tuple(int(model.joint(joint).dofadr[0]) for joint in robot.base.joints)


def _exactly(model: mujoco.MjModel, name: str, robot: PlanarParts) -> None:
    joints = [model.joint(i).name for i in range(model.njnt)]
    kinds = (
        ("bodies", robot.links, [model.body(i).name for i in range(1, model.nbody)]),
        ("joints", robot.joints, joints),
        ("actuators", robot.actuators, [model.actuator(i).name for i in range(model.nu)]),
        ("contact pairs", robot.points, [model.pair(i).name for i in range(model.npair)]),
    )
    for parts, wanted, there in kinds:
        if sorted(there) != sorted(wanted):
            raise InputError(f"{name}: {parts}: expected exactly {', '.join(wanted)}, got {', '.join(there)}")
    # Legs may come in any order; Pinocchio makes one joint of the torso's three, whose order stays.
    if tuple(joints[:BASE]) != robot.base.joints:
        raise InputError(
            f"{name}: joints: expected {', '.join(robot.base.joints)} first and in this order, got {', '.join(joints)}"
        )


def _bodies(model: mujoco.MjModel, name: str, robot: PlanarParts) -> None:
    for link, up in zip(robot.links, PARENT, strict=True):
        parent = model.body(model.body_parentid[model.body(link).id]).name
        expected = "world" if up < 0 else robot.links[up]
        if parent != expected:
            raise InputError(f"{name}: body '{link}': expected inside '{expected}', got inside '{parent}'")
    torso = model.body(robot.base.link).id
    if np.abs(model.body_pos[torso]).max() + np.abs(model.body_ipos[torso]).max() > _SLACK:
        raise InputError(
            f"{name}: body '{robot.base.link}': expected its frame and centre of mass at the world's origin"
        )


def _joints(model: mujoco.MjModel, name: str, robot: PlanarParts) -> None:
    for i, joint in enumerate(robot.joints):
        at = model.joint(joint).id
        slides = i <= Z
        axis = ((1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, -1.0, 0.0))[min(i, 2)]
        kind = mujoco.mjtJoint.mjJNT_SLIDE if slides else mujoco.mjtJoint.mjJNT_HINGE
        if (
            model.jnt_type[at] != kind
            or np.abs(model.jnt_axis[at] - axis).max() > _SLACK
            or np.abs(model.jnt_pos[at]).max() > _SLACK
        ):
            word = "slide" if slides else "hinge"
            raise InputError(
                f"{name}: joint '{joint}': expected axis {' '.join(f'{a:g}' for a in axis)} of a {word} at its body's "
                "origin"
            )
        limited = bool(model.jnt_limited[at])
        if joint in robot.stops:
            if not limited or model.jnt_range[at, 1] != 0.0:
                raise InputError(f"{name}: joint '{joint}': expected a range that ends at 0, where its stop is")
        elif limited:
            raise InputError(
                f"{name}: joint '{joint}': expected no range: only {', '.join(robot.stops)} "
                "have stops that the controller and the home engine know"
            )


def _motors(model: mujoco.MjModel, name: str, robot: PlanarParts) -> None:
    for motor, joint in zip(robot.actuators, robot.joints[BASE:], strict=True):
        i = model.actuator(motor).id
        drives = model.actuator_trntype[i] == mujoco.mjtTrn.mjTRN_JOINT
        direct = model.actuator_gear[i, 0] == 1.0 and model.actuator_gainprm[i, 0] == 1.0
        if (
            not (drives and direct)
            or model.joint(model.actuator_trnid[i, 0]).name != joint
            or model.actuator_biastype[i] != mujoco.mjtBias.mjBIAS_NONE
            or model.actuator_dyntype[i] != mujoco.mjtDyn.mjDYN_NONE
        ):
            raise InputError(
                f"{name}: actuator '{motor}': expected a motor on joint '{joint}' with gear 1, so that its control is "
                "the joint's torque"
            )


def _contacts(model: mujoco.MjModel, name: str, robot: PlanarParts) -> None:
    floor, radius = robot.contact.ground, robot.contact.radius
    ground = model.geom(floor)
    upright = np.abs(ground.quat - [1.0, 0.0, 0.0, 0.0]).max() < _SLACK
    if ground.type[0] != mujoco.mjtGeom.mjGEOM_PLANE or ground.bodyid[0] != 0 or ground.pos[2] != 0.0 or not upright:
        raise InputError(f"{name}: geom '{floor}': expected the level plane z = 0 (a slope is set in the scenario)")
    for point, number in zip(robot.points, POINT_LINK, strict=True):
        link = robot.links[number]
        geom, site, pair = model.geom(point), model.site(point), model.pair(point)
        if {model.geom(int(pair.geom1[0])).name, model.geom(int(pair.geom2[0])).name} != {floor, point}:
            raise InputError(f"{name}: contact pair '{point}': expected between geoms '{floor}' and '{point}'")
        if geom.type[0] != mujoco.mjtGeom.mjGEOM_SPHERE or abs(geom.size[0] - radius) > 1e-3 * radius:
            raise InputError(f"{name}: geom '{point}': expected a sphere of size {radius:g}, a contact point")
        for what, body in (("geom", geom.bodyid[0]), ("site", site.bodyid[0])):
            if model.body(body).name != link:
                raise InputError(
                    f"{name}: {what} '{point}': expected in body '{link}', got in '{model.body(body).name}'"
                )
        if np.abs(geom.pos - site.pos).max() > _SLACK:
            raise InputError(
                f"{name}: geom '{point}': expected where site '{point}' is, at {' '.join(f'{x:g}' for x in site.pos)}"
            )


@lru_cache(maxsize=8)
def _checked(path: str, modified: float, described: float) -> tuple[mujoco.MjSpec, mujoco.MjModel]:
    """Parses, compiles and checks a model file once per version of it; first elsewhere if it may be anybody's."""
    file = Path(path)
    if not packaged(file):
        examine(file)
        tried(label(file), lambda: _survives(path))
    return _parsed(path)


def _parsed(path: str) -> tuple[mujoco.MjSpec, mujoco.MjModel]:
    name, robot = label(Path(path)), description_at(Path(path))

    def read() -> mujoco.MjSpec:
        spec = mujoco.MjSpec.from_file(path)
        check_parts(spec, name, robot)
        return spec

    spec, model = compiled_spec(Path(path), read)
    check_model(model, name, robot)
    return spec, model


def _survives(path: str) -> None:
    """Everything that is ever done with a model file, once."""
    _, model = _parsed(path)
    check_sizes(model, label(Path(path)))
    mujoco.mj_step(model, mujoco.MjData(model))
    canonical(path, 0.0, 0.0)


def checked_model(path: Path) -> mujoco.MjModel:
    """The compiled model file as it is; not to be written to."""
    return _checked(*version_of(path))[1]


def check_home(path: Path) -> None:
    """Makes sure that the home engine knows every part of a model.

    Raises:
        InputError: It would leave some out.
    """
    model = checked_model(path)
    if unknown := unknown_at_home(model, base_dofs(model, description_at(path))):
        raise InputError(f"engine: home has no equations for parts of {label(path)}: {'; '.join(unknown)}; take them "
                         "out, or write engine = 'mujoco'", "engine")  # fmt: skip


def spec_of(path: Path) -> mujoco.MjSpec:
    """A private copy of the parsed model file."""
    return _checked(*version_of(path))[0].copy()


def posture_of(path: Path, name: str) -> tuple[np.ndarray, tuple[str, ...]]:
    """A named start posture: joint coordinates (9,), canonical order, and the points that touch the ground.

    Raises:
        InputError: The model has no such keyframe, or names points that do not exist.
    """
    spec, model = _checked(*version_of(path))
    robot = description_at(path)
    keys = {key.name: key for key in spec.keys}
    if name not in keys:
        raise no_keyframe(path, name, list(keys))
    contacts = tuple(next((text.data for text in spec.texts if text.name == name), "").split())
    for contact in contacts:
        if contact not in robot.points:
            raise InputError(
                f"{label(path)}: text '{name}': '{contact}' is no contact point; {nearest(contact, list(robot.points))}"
            )
    return np.array(keys[name].qpos)[order_of(model, robot).joints], contacts


def tree_at(path: Path) -> Tree:
    """Lengths and masses written in a model file; not to be written to."""
    return _tree(*version_of(path))


@lru_cache(maxsize=8)
def _tree(path: str, modified: float, described: float) -> Tree:
    return tree_of(_checked(path, modified, described)[1], label(Path(path)), description_at(Path(path)))
