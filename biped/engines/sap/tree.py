"""Bodies and joints of a compiled MuJoCo model as a plant of Drake's: built part by part, not by its parser of MJCF.

A body of several joints becomes a chain: MuJoCo turns it about one after the other, so that between two of them lies a
body without mass. Where a joint's coordinate is zero in Drake it is the file's reference in MuJoCo.
"""

# pyright: reportMissingImports=false
from __future__ import annotations

from typing import NamedTuple

import mujoco
import numpy as np
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import (
    FixedOffsetFrame,
    Joint,
    PdControllerGains,
    PrismaticJoint,
    QuaternionFloatingJoint,
    RevoluteJoint,
    RigidBody,
    RotationalInertia,
    SpatialInertia,
    WeldJoint,
)

_FREE, _HINGE = mujoco.mjtJoint.mjJNT_FREE, mujoco.mjtJoint.mjJNT_HINGE
_STIFF = 100.0
"""How many times as much as would stop it within a step dry friction damps a joint that it holds: such a joint creeps
by a hundredth of what its load would add in a step. Above 4,000 Drake would hold its place too, as a spring does."""


class PlantParts(NamedTuple):
    """Bodies and joints that were built.

    Attributes:
        bodies: By MuJoCo's number; the first is the world.
        joints: By MuJoCo's number.
        servos: (actuator's number in the model, of its joint) of actuators that Drake's own servos stand for.
        brakes: (number of the joint, rate [N m s/rad]) of dampers that give way at a joint's dry friction.
    """

    bodies: list[RigidBody]
    joints: list[Joint]
    servos: list[tuple[int, int]]
    brakes: list[tuple[int, float]]


def add_tree(plant: MultibodyPlant, m: mujoco.MjModel) -> PlantParts:
    """Adds a model's bodies, joints, rotors and servos to a plant.

    Args:
        plant: Not finished yet; changed.
        m: The model, which has passed `biped.engines.sap.refused.check_model`.
    """
    plant.mutable_gravity_field().set_gravity_vector(m.opt.gravity)
    bodies: list[RigidBody] = [plant.world_body()]
    joints: list[Joint] = []
    for b in range(1, m.nbody):
        body, own = _add_body(plant, m, b, bodies[m.body_parentid[b]])
        bodies.append(body)
        joints += own
    return PlantParts(bodies, joints, *_add_actuators(plant, m, joints))


def stops_of(m: mujoco.MjModel, joint: int) -> np.ndarray:
    """(2,) [m, rad] where a joint's stops begin to push: its range without the margins at both ends."""
    low, high = m.jnt_range[joint]
    margin = min(float(m.jnt_margin[joint]), 0.5 * (high - low))
    return np.array([low + margin, high - margin])


def pose(place: np.ndarray, quaternion: np.ndarray) -> RigidTransform:
    """A pose from MuJoCo's place (3,) [m] and quaternion (4,)."""
    out = np.empty(9)
    mujoco.mju_quat2Mat(out, quaternion)
    return RigidTransform(RotationMatrix(out.reshape(3, 3)), place)


def _add_body(
    plant: MultibodyPlant, m: mujoco.MjModel, b: int, parent: RigidBody
) -> tuple[RigidBody, list[RevoluteJoint | PrismaticJoint | QuaternionFloatingJoint]]:
    """Adds a body with the joints that it moves by."""
    name, inertia = m.body(b).name or f"body {b}", _inertia(m, b)
    first, count = int(m.body_jntadr[b]), int(m.body_jntnum[b])
    rest = pose(m.body_pos[b], m.body_quat[b])
    if count == 0:
        body = plant.AddRigidBody(name, inertia)
        plant.AddJoint(WeldJoint(name, _frame(plant, f"{name} on", parent, rest), body.body_frame(), RigidTransform()))
        return body, []
    if m.jnt_type[first] == _FREE:
        body = plant.AddRigidBody(name, inertia)
        free = QuaternionFloatingJoint(f"free {first}", plant.world_frame(), body.body_frame())
        return body, [plant.AddJoint(free)]
    joints, on = [], parent
    for j in range(first, first + count):
        last, joint = j == first + count - 1, m.joint(j).name or f"joint {j}"
        body = plant.AddRigidBody(*((name, inertia) if last else (f"{name} before {joint}", SpatialInertia.Zero())))
        at = RigidTransform(m.jnt_pos[j])
        kind = RevoluteJoint if m.jnt_type[j] == _HINGE else PrismaticJoint
        damping = float(np.ravel(m.dof_damping[m.jnt_dofadr[j]])[0])
        added = plant.AddJoint(
            kind(joint, _frame(plant, f"{joint} on", on, rest @ at), _frame(plant, f"{joint} of", body, at),
                 m.jnt_axis[j], damping=damping)
        )  # fmt: skip
        if m.jnt_limited[j]:
            low, high = stops_of(m, j) - m.qpos0[m.jnt_qposadr[j]]
            added.set_position_limits([low], [high])
        joints.append(added)
        on, rest = body, RigidTransform()
    return body, joints


def _frame(plant: MultibodyPlant, name: str, body: RigidBody, place: RigidTransform) -> FixedOffsetFrame:
    return plant.AddFrame(FixedOffsetFrame(name, body.body_frame(), place))


def _inertia(m: mujoco.MjModel, b: int) -> SpatialInertia:
    """A body's mass, centre and inertia about its origin, as MuJoCo has them."""
    mass = float(m.body_mass[b])
    if mass == 0.0:
        return SpatialInertia.Zero()
    turn = np.empty(9)
    mujoco.mju_quat2Mat(turn, m.body_iquat[b])
    R = turn.reshape(3, 3)
    about = R @ np.diag(m.body_inertia[b]) @ R.T
    x, y, z = about
    central = RotationalInertia(x[0], y[1], z[2], x[1], x[2], y[2])
    return SpatialInertia.MakeFromCentralInertia(mass, m.body_ipos[b], central)


def _add_actuators(
    plant: MultibodyPlant, m: mujoco.MjModel, joints: list[Joint]
) -> tuple[list[tuple[int, int]], list[tuple[int, float]]]:
    """Adds servos, dry friction and rotors, which Drake has only in actuators; returns servos and brakes.

    Dry friction is a servo that holds the joint's velocity at zero with no more than its torque. Of several actuators
    of a joint Drake takes the last one's rotor.
    """
    servos = {int(m.actuator_trnid[a, 0]): a for a in range(m.nu)
              if m.actuator_biastype[a] != mujoco.mjtBias.mjBIAS_NONE}  # fmt: skip
    driven, brakes = [], []
    for j, joint in enumerate(joints):
        dof, last = int(m.jnt_dofadr[j]), None
        armature, friction = float(m.dof_armature[dof]), float(m.dof_frictionloss[dof])
        if j in servos:
            a = servos[j]
            last = plant.AddJointActuator(joint.name(), joint)
            last.set_effort_limit(float(m.actuator_forcerange[a, 1]))
            _, stiffness, damping = m.actuator_biasprm[a, :3]
            last.set_controller_gains(PdControllerGains(p=-stiffness, d=-damping))
            driven.append((a, j))
        if friction > 0.0:
            rate = _STIFF / (m.opt.timestep * float(m.dof_invweight0[dof]))
            last = plant.AddJointActuator(f"{joint.name()} friction", joint)
            last.set_effort_limit(friction)
            last.set_controller_gains(PdControllerGains(p=0.0, d=rate))
            brakes.append((j, rate))
        if last is None and armature > 0.0:
            last = plant.AddJointActuator(joint.name(), joint)
        if last is not None:
            last.set_default_rotor_inertia(armature)
    return driven, brakes
