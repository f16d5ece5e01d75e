"""A model file as MuJoCo parses it, completed: what a URDF or a bare body lacks to be a robot on ground."""

import warnings
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from biped.base.errors import InputError
from biped.base.files import label, nearest
from biped.robot.assets import find_assets, leave_out_idle
from biped.robot.holding import let_go
from biped.robot.rigid import stiffen
from biped.scenario.keys import Simulation
from biped.scenario.robot import Described

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
        raise InputError(f"{label(path)}: not a model MuJoCo can compile: {' '.join(str(error).split())}") from None


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
        spec.worldbody.add_geom(name=GROUND, type=mujoco.mjtGeom.mjGEOM_PLANE, size=[0.0, 0.0, 0.05], group=3,
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
    fixed |= model.body_weldid[1:] == 0
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
