"""Servos and dry friction of joints, which Drake solves along with the contacts, and their torques in a step."""

# pyright: reportMissingImports=false
from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import JointActuatorIndex
from pydrake.systems.framework import Context

from biped.engines.sap.tree import PlantParts


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
        order: list[int] = []  # which servo each row of the desired state is of; none of a brake
        by_joint = {j: i for i, (_, j) in enumerate(tree.servos)}
        number = {int(joint.index()): j for j, joint in enumerate(tree.joints)}
        for index in range(plant.num_actuators()):
            actuator = plant.get_joint_actuator(JointActuatorIndex(index))
            j = number[int(actuator.joint().index())]
            first.setdefault(int(tree.joints[j].velocity_start()), index)
            if actuator.has_controller():
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
