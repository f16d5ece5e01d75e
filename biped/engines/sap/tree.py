"""Bodies and joints of a compiled MuJoCo model as a plant of Drake's, part by part; what Drake lacks is refused.

A body of several joints becomes a chain: MuJoCo turns it about one after the other, so that between two of them lies a
body without mass. Where a joint's coordinate is zero in Drake it is the file's reference in MuJoCo. Servos and dry
friction of joints are solved along with the contacts.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import mujoco
import numpy as np
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import (
    FixedOffsetFrame,
    Joint,
    JointActuatorIndex,
    PdControllerGains,
    PrismaticJoint,
    QuaternionFloatingJoint,
    RevoluteJoint,
    RigidBody,
    RotationalInertia,
    SpatialInertia,
    WeldJoint,
)
from pydrake.systems.framework import Context

from biped.base.errors import InputError

# pyright: reportMissingImports=false


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
        m: The model, which has passed `biped.engines.sap.tree.check_model`.
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
            if m.actuator_forcelimited[a]:
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


# pyright: reportMissingImports=false


class JointTorques:
    """Torques of servos and dry friction at their joints.

    Drake's port has their sum at each joint. Friction's share follows from its own law: a damper of rate `PlantParts.
    brakes` that gives way at the joint's dry friction.

    Args:
        plant: Finished.
        m: The model that it was built from.
        tree: What was built.
        context: The plant's.

    Attributes:
        any: Whether there are any.
        servo: (nv,) generalized forces of servos in the latest step, in Drake's order.
        friction: (nv,) of dry friction, likewise.
        rubs: Whether there is any dry friction.
    """

    def __init__(self, plant: MultibodyPlant, m: mujoco.MjModel, tree: PlantParts, context: Context):
        self.any, self.rubs = bool(tree.servos or tree.brakes), bool(tree.brakes)
        self.servo, self.friction = (np.zeros(plant.num_velocities()) for _ in range(2))
        if not self.any:
            return
        self._actuator, self._joint = (np.array([one[i] for one in tree.servos], dtype=int) for i in range(2))
        holds = m.actuator_biasprm[self._actuator, 1] != 0.0
        self._zero = np.where(holds, m.qpos0[m.jnt_qposadr[self._joint]], 0.0)
        self._net = plant.get_net_actuation_output_port()
        first: dict[int, int] = {}  # actuator of each of Drake's columns; those of one joint have the same sum
        order: list[int] = []  # which servo each row of the desired state is of; none of a brake or a rotor
        by_joint = {j: i for i, (_, j) in enumerate(tree.servos)}
        number = {int(joint.index()): j for j, joint in enumerate(tree.joints)}
        for index in range(plant.num_actuators()):
            actuator = plant.get_joint_actuator(JointActuatorIndex(index))
            j = number[int(actuator.joint().index())]
            first.setdefault(int(tree.joints[j].velocity_start()), index)
            # Rotors that nothing holds have rows there, too.
            order.append(by_joint[j] if actuator.name() == tree.joints[j].name() and j in by_joint else -1)
        column = np.array([tree.joints[j].velocity_start() for j in self._joint], dtype=int)
        self._columns, self._index = column, np.array([first[int(c)] for c in column], dtype=int)
        rank = {servo: row for row, servo in enumerate(order) if servo >= 0}
        # Positions that are wanted come first there, and after all of them velocities; a servo has one of the two.
        self._rows = np.where(holds, 0, len(order)) + np.array([rank[i] for i in range(len(tree.servos))], dtype=int)
        port = plant.get_desired_state_input_port(tree.bodies[1].model_instance())
        self._desired: Any = port.FixValue(context, np.zeros(2 * len(order)))
        self._values = self._desired.GetMutableData().get_mutable_value().get_mutable_value()
        braked = np.array([j for j, _ in tree.brakes], dtype=int)
        self._most, self._rate = (np.zeros(plant.num_velocities()) for _ in range(2))
        at = np.array([tree.joints[j].velocity_start() for j in braked], dtype=int)
        self._most[at], self._rate[at] = m.dof_frictionloss[m.jnt_dofadr[braked]], [rate for _, rate in tree.brakes]
        self._least = -self._most

    def command(self, target: np.ndarray) -> None:
        """Has servos hold their joints at targets (nu,)."""
        self._desired.GetMutableData()  # without it Drake does not know that they change
        self._values[self._rows] = target[self._actuator] - self._zero

    def read(self, context: Context, now: np.ndarray, torque: np.ndarray) -> None:
        """Finds what they gave in the step whose last velocities are `now`.

        Args:
            context: The plant's.
            now: (nv,) velocities at the end of the step.
            torque: (njnt,) torques of servos are written here.
        """
        if self.rubs:
            np.minimum(np.maximum(-self._rate * now, self._least), self._most, out=self.friction)
        if self._joint.size:
            found = self._net.Eval(context)[self._index] - self.friction[self._columns]
            torque[self._joint] = self.servo[self._columns] = found


_FLAGS = ("CONSTRAINT", "CONTACT", "LIMIT", "FRICTIONLOSS", "SPRING", "DAMPER", "GRAVITY", "FILTERPARENT", "CLAMPCTRL",
          "ACTUATION")  # fmt: skip
"""MuJoCo's flags of parts of the physics that Drake's plant is built with in any case."""
_EDGED = (mujoco.mjtGeom.mjGEOM_HFIELD, mujoco.mjtGeom.mjGEOM_SDF)


def check_model(model: mujoco.MjModel, name: str) -> None:
    """Makes sure that Drake can step a model.

    Args:
        model: Compiled for a run.
        name: What the scenario calls it.

    Raises:
        InputError: It has a part that has no counterpart there.
    """
    for what, why in _reasons(model):
        raise InputError(f"engine: 'drake' cannot simulate model '{name}': it has {what}, {why}; expected engine = "
                         "'mujoco'", "engine")  # fmt: skip


def _reasons(m: mujoco.MjModel) -> Iterator[tuple[str, str]]:
    """Each part that has no counterpart, and why."""
    free, ball = m.jnt_type == mujoco.mjtJoint.mjJNT_FREE, m.jnt_type == mujoco.mjtJoint.mjJNT_BALL
    for j in np.flatnonzero(ball):
        yield f"the ball joint '{m.joint(j).name}'", "and Drake's has three angles, which lock"
    if m.neq:
        yield f"{m.neq} equality constraints", "which MuJoCo makes soft in a way of its own"
    stiff = m.tendon_stiffness if m.tendon_stiffness.ndim == 1 else m.tendon_stiffness[:, 0]
    damped = m.tendon_damping if m.tendon_damping.ndim == 1 else m.tendon_damping[:, 0]
    if m.ntendon and (np.any(stiff) or np.any(damped) or m.tendon_limited.any() or m.tendon_frictionloss.any()):
        yield "tendons that pull", "which Drake has not"
    if m.opt.density or m.opt.viscosity or np.any(m.opt.wind):
        yield "air or water around it", "which Drake has not"
    if np.any(m.body_gravcomp):
        yield "bodies whose weight is compensated", "which Drake has not"
    if np.any(m.dof_dampingpoly) or np.any(m.jnt_stiffnesspoly):
        yield "springs or dampers that are not linear", "which Drake's joints have not"
    for j in np.flatnonzero(free):
        columns = slice(m.jnt_dofadr[j], m.jnt_dofadr[j] + 6)
        spring = m.jnt_stiffness[j] if m.jnt_stiffness.ndim == 1 else m.jnt_stiffness[j, 0]
        damping = m.dof_damping[columns]
        if m.dof_armature[columns].any() or np.any(damping) or spring or m.dof_frictionloss[columns].any():
            yield (f"armature, damping, friction or a spring in the free joint '{m.joint(j).name}'",
                   "which Drake's has not")  # fmt: skip
    if np.any(m.geom_solref[:, 0] <= 0.0) or np.any(m.pair_solref[:, 0] <= 0.0):
        yield "contacts of a stiffness and damping of their own (solref < 0)", "which have no contact time here"
    if off := [name for name in _FLAGS if m.opt.disableflags & getattr(mujoco.mjtDisableBit, f"mjDSBL_{name}")]:
        yield f"disabled parts of the physics ({', '.join(off).lower()})", "which are not taken away here"
    if m.nflex:
        yield "parts that bend", "which are not built here"
    for g in np.flatnonzero(np.isin(m.geom_type, _EDGED)):
        yield f"a height field or signed distance ('{m.geom(g).name}')", "whose contacts Drake has not"
