"""Where a model file has the parts of a biped, and Pinocchio's model of it, both in canonical order.

A file may list legs, motors and contact pairs in any order. Engines and controllers speak the canonical one
(`biped.robot.planar.topology`); where the file's is another, the MuJoCo engine gathers and scatters by these numbers.
"""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import mujoco
import numpy as np

from biped.base.errors import InputError
from biped.base.files import label
from biped.robot.ground import gravity
from biped.robot.planar.description import PlanarParts, description_at, version_of
from biped.robot.planar.topology import BASE, NQ, NU
from biped.robot.planar.tree import Tree

if TYPE_CHECKING:
    import pinocchio


class Order(NamedTuple):
    """MuJoCo's numbers of a biped's parts.

    Attributes:
        joints: (9,) of the coordinates.
        actuators: (6,) of the motors.
        points: (4,) of the contact points' geoms.
        contacts: (4,) canonical numbers of the points, in the order in which MuJoCo lists contacts.
        stops: (2,) canonical numbers of the stops, in the order in which MuJoCo lists joint limits.
        bent: (2,) [rad] the other ends of their ranges, where a leg is bent as far as it can be; by canonical number.
    """

    joints: np.ndarray
    actuators: np.ndarray
    points: np.ndarray
    contacts: np.ndarray
    stops: np.ndarray
    bent: np.ndarray

    @property
    def canonical(self) -> bool:
        """Whether coordinates and motors are in canonical order, so that MuJoCo's own arrays will do."""
        return bool((self.joints == np.arange(NQ)).all() and (self.actuators == np.arange(NU)).all())


def order_of(model: mujoco.MjModel, robot: PlanarParts) -> Order:
    """The order of a compiled model file that has passed its check."""
    joints = np.array([model.joint(joint).dofadr[0] for joint in robot.joints])
    pairs = [robot.points.index(name) for i in range(model.npair) if (name := model.pair(i).name) in robot.points]
    return Order(
        joints=joints,
        actuators=np.array([model.actuator(motor).id for motor in robot.actuators]),
        points=np.array([model.geom(point).id for point in robot.points]),
        contacts=np.array(pairs),
        stops=np.argsort([model.joint(stop).dofadr[0] for stop in robot.stops]),
        bent=np.array([model.joint(stop).range[0] for stop in robot.stops]),
    )


@lru_cache(maxsize=4)
def canonical(path: str, modified: float, described: float) -> pinocchio.Model:
    """Pinocchio's model of a version of a file (`version_of`), legs in canonical order; not to be written to.

    Raises:
        InputError: Pinocchio cannot read it.
    """
    import pinocchio

    try:
        return _reordered(pinocchio.buildModelFromMJCF(path), description_at(Path(path)))
    except (ValueError, RuntimeError) as error:
        raise InputError(
            f"{label(Path(path))}: not a model Pinocchio can read: {' '.join(str(error).split())}"
        ) from error


def _reordered(model: pinocchio.Model, robot: PlanarParts) -> pinocchio.Model:
    """Pinocchio's model with its legs in canonical order; the same one if they are."""
    import pinocchio

    root, *there = list(model.names)[1:]
    wanted = [root, *robot.joints[BASE:]]
    if [root, *there] == wanted:
        return model
    out = pinocchio.Model()
    out.name, number = model.name, {0: 0}
    for name in wanted:
        old = model.getJointId(name)
        new = out.addJoint(number[model.parents[old]], model.joints[old], model.jointPlacements[old], name)
        out.appendBodyToJoint(new, model.inertias[old], pinocchio.SE3.Identity())
        at, to = model.joints[old].idx_v, out.joints[new].idx_v
        size = model.joints[old].nv
        for values in ("armature", "damping"):
            getattr(out, values)[to : to + size] = getattr(model, values)[at : at + size]
        number[old] = new
    for frame in model.frames:
        if frame.type == pinocchio.FrameType.OP_FRAME:
            joint = number[frame.parentJoint]
            out.addFrame(pinocchio.Frame(frame.name, joint, 0, frame.placement, frame.type))
    return out


def believed_model(path: Path, slope: float) -> pinocchio.Model:
    """Pinocchio's model of the file, which the controller computes with; gravity as on the scenario's slope."""
    import pinocchio

    model = pinocchio.Model(canonical(*version_of(path)))
    g = gravity(slope)
    model.gravity.linear = np.array([g[0], 0.0, g[1]])
    return model


def pinocchio_tree(model: pinocchio.Model, robot: PlanarParts) -> Tree:
    """Lengths and masses of Pinocchio's model; bodies welded to a link are part of it."""
    joints = [1, *(model.getJointId(name) for name in robot.joints[BASE:])]
    frames = [model.frames[model.getFrameId(point)] for point in robot.points]
    inertias = [model.inertias[joint] for joint in joints]
    planar = [0, 2]
    return Tree(
        joint=np.array([[0.0, 0.0], *(model.jointPlacements[joint].translation[planar] for joint in joints[1:])]),
        com=np.array([inertia.lever[planar] for inertia in inertias]),
        mass=np.array([inertia.mass for inertia in inertias]),
        inertia=np.array([inertia.inertia[1, 1] for inertia in inertias]),
        armature=np.array(model.armature[BASE:]),
        damping=np.array(model.damping[BASE:]),
        point=np.array([frame.placement.translation[planar] for frame in frames]),
    )
