"""A model file as MuJoCo parses it: completed to a robot on ground, without idle parts and joints held stiff."""

import warnings
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from biped.base.errors import InputError
from biped.base.files import label, nearest
from biped.base.trust import trusted
from biped.robot.holding import free_bases, let_go
from biped.robot.safety import spellings_of
from biped.scenario.keys import Simulation
from biped.scenario.robot import Described

_HINGES = (mujoco.mjtJoint.mjJNT_HINGE, mujoco.mjtJoint.mjJNT_SLIDE)
_CLOSE = 1e-9
"""[m] by which a body may be elsewhere afterwards."""


def stiffen(spec: mujoco.MjSpec, table: Described) -> None:
    """Takes joints out of a completed file, with their actuators.

    Args:
        spec: The file, which is changed.
        table: What is said of the robot: which joints, and its start.

    Raises:
        InputError: A joint is not there or no hinge, or something else of the file needs it.
    """
    joints = {joint.name: joint for joint in spec.joints}
    for name in table.rigid:
        if name not in joints:
            raise InputError(f"robot.rigid: no joint '{name}'; {nearest(name, list(joints))}", "robot.rigid")
        if joints[name].type not in _HINGES:
            raise InputError(f"robot.rigid: joint '{name}': expected a hinge or a slide", "robot.rigid")
    model = spec.compile()
    data = mujoco.MjData(model)
    keys = [model.key(i).name for i in range(model.nkey)]
    if keys:
        mujoco.mj_resetDataKeyframe(model, data, keys.index(table.start) if table.start in keys else 0)
    mujoco.mj_kinematics(model, data)
    for name in table.rigid:
        _place(spec, model, data, int(model.jnt_bodyid[model.joint(name).id]))
    for actuator in list(spec.actuators):
        if actuator.target in table.rigid:
            spec.delete(actuator)
    for sensor in list(spec.sensors):
        if sensor.objname in table.rigid or sensor.objtype == mujoco.mjtObj.mjOBJ_ACTUATOR:
            spec.delete(sensor)
    for name in table.rigid:
        spec.delete(joints[name])
    _cut_keyframes(spec, model, table.rigid)
    _compare(spec, model, data)


def _place(spec: mujoco.MjSpec, model: mujoco.MjModel, data: mujoco.MjData, body: int) -> None:
    """Puts a body where it is in its parent's frame."""
    parent = int(model.body_parentid[body])
    turn = data.xmat[parent].reshape(3, 3)
    back, quat = np.empty(4), np.empty(4)
    mujoco.mju_negQuat(back, data.xquat[parent])
    mujoco.mju_mulQuat(quat, back, data.xquat[body])
    part = spec.body(model.body(body).name)
    part.pos, part.quat = turn.T @ (data.xpos[body] - data.xpos[parent]), quat
    part.alt.type = mujoco.mjtOrientation.mjORIENTATION_QUAT


def _cut_keyframes(spec: mujoco.MjSpec, model: mujoco.MjModel, names: Sequence[str]) -> None:
    """Takes joints out of all keyframes, and what these command."""
    numbers = [model.joint(name).id for name in names]
    for number, key in enumerate(spec.keys):
        key.qpos = np.delete(model.key_qpos[number], model.jnt_qposadr[numbers])
        key.qvel = np.delete(model.key_qvel[number], model.jnt_dofadr[numbers])
        key.ctrl = key.act = []


def _compare(spec: mujoco.MjSpec, model: mujoco.MjModel, data: mujoco.MjData) -> None:
    """Makes sure that all bodies are where they were.

    Raises:
        InputError: One is not, or something of the file needs a joint that is gone.
    """
    try:
        stiff = spec.compile()
    except ValueError as error:
        raise InputError(f"robot.rigid: {' '.join(str(error).split())}", "robot.rigid") from None
    there = mujoco.MjData(stiff)
    names = {model.joint(j).name: j for j in range(model.njnt)}
    for joint in range(stiff.njnt):
        old = names[stiff.joint(joint).name]
        size = 7 if model.jnt_type[old] == mujoco.mjtJoint.mjJNT_FREE else 1
        first = int(model.jnt_qposadr[old])
        there.qpos[int(stiff.jnt_qposadr[joint]) :][:size] = data.qpos[first : first + size]
    mujoco.mj_kinematics(stiff, there)
    for body in range(model.nbody):
        name = model.body(body).name
        if np.abs(there.xpos[stiff.body(name).id] - data.xpos[body]).max() > _CLOSE:
            raise InputError(f"robot.rigid: body '{name}' cannot be held where the start has it", "robot.rigid")


DRAWN = 2
"""Geoms of higher groups are not drawn, as in MuJoCo's own viewer."""
THIN, THICK, SLIM, SHORT = 0.015, 0.05, 0.2, 0.01
"""[m] Least and largest radius of a capsule that is drawn in the place of a mesh, its share of the length, and [m] the
least length of one."""


def find_assets(spec: mujoco.MjSpec, path: Path, notes: list[str]) -> None:
    """Says where meshes and textures lie, and leaves out those that are missing and only looked at.

    Capsules from joint to joint are drawn instead of missing meshes, and what else a body has.

    Args:
        spec: The parsed file, which is changed.
        path: The file.
        notes: What is left out is added here.

    Raises:
        InputError: A mesh is missing that touches something, or that a body's inertia follows from.
    """
    missing = [mesh for mesh in spec.meshes if mesh.file and not _found(mesh, path, spec.meshdir)]
    bare: dict[str, Any] = {}
    for mesh in missing:
        name = mesh.name or Path(mesh.file).stem
        for geom in [one for one in spec.geoms if one.meshname == name]:
            if why := _needed(spec, geom):
                places = ", ".join(spellings_of(mesh.file))[:400]
                raise InputError(f"{label(path)}: mesh '{mesh.file[:200]}': there is no such file, and {why}; expected "
                                 f"it below the folder of the model, as {places}")  # fmt: skip
            bare[geom.parent.name] = geom.parent
            spec.delete(geom)
        spec.delete(mesh)
    for name, body in bare.items():
        if name != "world":
            _draw(body)
    if missing:
        names = ", ".join(Path(mesh).name for mesh in [one.file for one in missing][:2])
        gone = f"{len(missing)} that are only looked at are not there ({names}, …)"
        notes.append(f"meshes: {gone}; capsules are drawn instead")
    lost = [texture for texture in spec.textures if texture.file and not _found(texture, path, spec.texturedir)]
    for material in spec.materials if lost else ():
        material.textures = ["" if name in {one.name for one in lost} else name for name in material.textures]
    for texture in lost:
        spec.delete(texture)
    if lost:
        notes.append(f"textures: {len(lost)} are not there; left out")


def _draw(body: Any) -> None:
    """Makes a body visible that has lost its meshes: capsules to its children touch nothing and weigh nothing."""
    for geom in body.geoms:
        geom.group = min(geom.group, DRAWN)
    for child in body.bodies:
        length = float(np.linalg.norm(child.pos))
        if length > SHORT:
            capsule = body.add_geom(type=mujoco.mjtGeom.mjGEOM_CAPSULE, fromto=[0.0, 0.0, 0.0, *child.pos])
            capsule.size[0] = min(max(SLIM * length, THIN), THICK)
            capsule.contype = capsule.conaffinity = 0
            capsule.group, capsule.mass = DRAWN, 0.0


def _found(asset: Any, path: Path, inside: str) -> bool:
    """Whether an asset is there; its file is then written in a form that MuJoCo finds."""
    folder, file = path.parent, asset.file
    spellings = spellings_of(file)
    if (folder / inside / file).is_file():
        return True
    roots = [folder]
    if file not in spellings and trusted(path):  # of a ROS package: beside the folder that the model is in
        roots += [folder.parent, folder.parent.parent]
    for place in (root / below / spelling for root in roots for below in ("", inside) for spelling in spellings):
        if place.is_file():
            asset.file = str(place.resolve())
            return True
    return False


def _needed(spec: mujoco.MjSpec, geom: Any) -> str:
    """Why a geom cannot be left out; empty if it can."""
    body = geom.parent
    if geom.contype or geom.conaffinity or any(geom.name and geom.name in (p.geomname1, p.geomname2)
                                               for p in spec.pairs):  # fmt: skip
        return f"body '{body.name}' touches things with it"
    explicit = body.explicitinertial or body.name == "world" or geom.mass == 0.0 or geom.density == 0.0
    return "" if explicit else f"the mass of body '{body.name}' follows from it"


def leave_out_idle(spec: mujoco.MjSpec, notes: list[str]) -> None:
    """Leaves out bodies that hang on nothing, touch nothing and only stand for joints that a robot does not have.

    Args:
        spec: The parsed file, which is changed.
        notes: What is left out is added here.
    """
    roots = [body for body in spec.bodies if body.name != "world" and body.parent.name == "world"]
    idle = [body for body in roots if _idle(body)]
    if len(idle) == len(roots):
        return
    names = ", ".join(f"'{body.name}'" for body in idle[:6])
    for body in idle:
        spec.delete(body)
    if idle:
        notes.append(f"bodies: {names}: hang on nothing and touch nothing; left out, with their actuators")


def _idle(body: Any) -> bool:
    """Whether a body moves by one hinge or slide, has nothing on it and cannot touch anything."""
    joints = list(body.joints)
    kinds = (mujoco.mjtJoint.mjJNT_HINGE, mujoco.mjtJoint.mjJNT_SLIDE)
    touches = any(geom.contype or geom.conaffinity for geom in body.geoms)
    return len(joints) == 1 and joints[0].type in kinds and not list(body.bodies) and not touches


GROUND = "ground"

# Without a handler MuJoCo appends warnings to MUJOCO_LOG.TXT in the user's folder; a run's warnings are in its data.
mujoco.set_mju_user_warning(lambda message: None)


def is_urdf(path: Path) -> bool:
    """Whether a file is one of URDF: it has neither a free base, nor a ground, nor actuators."""
    return path.suffix == ".urdf"


def parsed(path: Path, table: Described, notes: list[str] | None = None) -> tuple[mujoco.MjSpec, mujoco.MjModel]:
    """The file, completed, and compiled as it is.

    Args:
        path: The file.
        table: What is said of the robot.
        notes: What was left out of the file is added here.

    Raises:
        InputError: MuJoCo cannot read or compile it.
    """
    return compiled_spec(path, lambda: read(path, table, notes))


def compiled_spec(path: Path, read: Callable[[], mujoco.MjSpec]) -> tuple[mujoco.MjSpec, mujoco.MjModel]:
    """Returns a model file as it is read, and compiled as it is.

    Args:
        path: The file, for the error.
        read: Reads it.

    Raises:
        InputError: MuJoCo cannot read or compile it.
    """
    try:
        spec = read()
        with warnings.catch_warnings():
            warnings.simplefilter("error")  # what MuJoCo only warns of (a singular inertia) no run survives
            return spec, spec.compile()
    except (ValueError, UserWarning, mujoco.FatalError) as error:
        said = " ".join(str(error).split())
        if "Schema violation" in said:  # older files have words that are gone
            said += f" (this is MuJoCo {mujoco.__version__})"
        raise InputError(f"{label(path)}: not a model MuJoCo can compile: {said}") from None


def no_keyframe(path: Path, name: str, names: Sequence[str]) -> InputError:
    """The error that a model file has no keyframe of a name that a scenario starts from."""
    hint = nearest(name, list(names)) if names else "there are none"
    return InputError(f"start.posture: model {label(path)} has no keyframe '{name}'; {hint}", "start.posture")


def set_solver(option: Any, simulation: Simulation) -> None:
    """Gives a model's options (`mujoco.MjOption`) the time step, integrator and solver of a scenario."""
    option.timestep = simulation.timestep
    option.integrator = getattr(mujoco.mjtIntegrator, f"mjINT_{simulation.integrator.upper()}")
    option.cone = getattr(mujoco.mjtCone, f"mjCONE_{simulation.cone.upper()}")
    option.impratio = simulation.impratio
    option.tolerance = simulation.tolerance
    option.iterations = simulation.iterations
    option.ls_iterations = simulation.ls_iterations


def read(path: Path, table: Described, notes: list[str] | None = None) -> mujoco.MjSpec:
    """The file, completed; arguments and errors as of `parsed`."""
    spec = mujoco.MjSpec.from_file(str(path))
    out = [] if notes is None else notes
    find_assets(spec, path, out)
    leave_out_idle(spec, out)
    free_bases(spec, out)
    let_go(spec, out)
    complete(spec, table, is_urdf(path))
    if table.rigid:
        stiffen(spec, table)
    return spec


def complete(spec: mujoco.MjSpec, table: Described, urdf: bool) -> None:
    """Gives parts without a name one, and adds a ground; to a URDF's robot a free base and motors too.

    Args:
        spec: The parsed file, which is changed.
        table: What is said of the robot.
        urdf: Whether the file is a URDF.
    """
    bodies = [body for body in spec.bodies if body.name != "world"]
    if urdf:
        spec.compiler.fusestatic = False
        roots = [body for body in bodies if body.parent.name == "world"]
        if len(roots) == 1 and not list(roots[0].joints):
            roots[0].add_freejoint(name=f"{roots[0].name}_free")
        if not list(spec.actuators):
            followers = {one.name1 for one in spec.equalities if one.type == mujoco.mjtEq.mjEQ_JOINT}
            for joint in spec.joints:
                if joint.name not in followers and joint.type in (
                    mujoco.mjtJoint.mjJNT_HINGE,
                    mujoco.mjtJoint.mjJNT_SLIDE,
                ):
                    motor = spec.add_actuator(name=joint.name, target=joint.name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
                    motor.set_to_motor()
    for kind, parts in (("body", bodies), ("joint", list(spec.joints))):
        taken = {part.name for part in parts}
        for number, part in enumerate(parts):
            if not part.name:
                part.name = _free(f"{kind}_{number}", taken)
    taken = {actuator.name for actuator in spec.actuators}
    for actuator in spec.actuators:
        if not actuator.name:
            actuator.name = _free(actuator.target, taken)
    for number, key in enumerate(spec.keys):
        if not key.name:
            key.name = f"key_{number}"
    planes = [geom for geom in spec.geoms if geom.type == mujoco.mjtGeom.mjGEOM_PLANE]
    if not planes and not table.ground:
        ground = _free(GROUND, {geom.name for geom in spec.geoms})
        spec.worldbody.add_geom(name=ground, type=mujoco.mjtGeom.mjGEOM_PLANE, size=[0.0, 0.0, 0.05], group=3,
                                contype=1, conaffinity=1, condim=3, rgba=[0.85, 0.86, 0.84, 1.0])  # fmt: skip


def _free(name: str, taken: set[str]) -> str:
    """A name like this one that is not taken; it is from now on."""
    while name in taken:
        name += "_"
    taken.add(name)
    return name


def check_sizes(model: mujoco.MjModel, name: str) -> None:
    """Checks that a compiled model is of a size at which the arithmetic of a walk means something.

    Args:
        model: The model.
        name: The file, for the error.

    Raises:
        InputError: A link is lighter, heavier or longer than any that could walk, or a posture is none.
    """
    # What is fixed to something heavier may weigh nothing: a frame, as URDFs have many.
    fixed = (model.body_mass[1:] == 0.0) & (
        np.bincount(model.body_weldid, model.body_mass)[model.body_weldid[1:]] > 0.0
    )
    fixed |= (model.body_weldid[1:] == 0) | (model.body_mocapid[model.body_weldid[1:]] >= 0)
    for what, values, least, most, unit in (
        ("mass", np.where(fixed & (model.body_mass[1:] == 0.0), 1.0, model.body_mass[1:]), 1e-6, 1e6, "kg"),
        ("inertia", np.where(fixed, 1.0, model.body_inertia[1:].min(axis=1)), 1e-12, 1e9, "kg m²"),
        ("place", np.abs(model.body_pos[1:]).max(axis=1), 0.0, 1e3, "m"),
        ("centre of mass", np.abs(model.body_ipos[1:]).max(axis=1), 0.0, 1e3, "m"),
    ):
        for i in np.flatnonzero(~((values >= least) & (values <= most)))[:1]:
            raise InputError(
                f"{name}: body '{model.body(int(i) + 1).name}': {what}: expected {least:g} … {most:g} {unit}, got "
                f"{values[i]:g}"
            )
    for i in np.flatnonzero(~(np.abs(model.key_qpos) <= 1e3).all(axis=1))[:1]:
        raise InputError(f"{name}: key '{model.key(int(i)).name}': qpos: expected at most 1000 m or rad")
