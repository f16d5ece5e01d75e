"""Parts of a model file that a walk can do without: meshes and textures that are only looked at, idle joints."""

from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from biped.base.errors import InputError
from biped.base.files import label
from biped.base.trust import trusted
from biped.robot.safety import spellings_of

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
