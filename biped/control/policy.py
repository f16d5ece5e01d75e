"""A policy network as a control law: an ONNX file, observations by name, actions scaled (`pip install onnxruntime`).

A law file beside the network says what it sees and what its numbers mean:

    from biped.control.policy import Policy

    class Walker(Policy):
        network = "walker.onnx"
        observations = ("q.root_pitch", "v.root_x", "contact.right_toe", …)
        scale = 50.0

The network takes one array (1, number of observations) of 32-bit floats and returns one of (1, 6).
"""

from __future__ import annotations

import inspect
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Literal

import numpy as np

from biped.base.files import nearest
from biped.control.network import session_of
from biped.robot.leg_states import STATES

if TYPE_CHECKING:
    from biped.control.law import Setup
    from biped.control.observation import Observation
    from biped.control.planar.user import PlanarObservation, PlanarSetup
    from biped.robot.robot import Robot


class Policy:
    """A law that asks a network; subclass it and say what is what.

    Attributes:
        network: The ONNX file, beside the file of the class.
        observations: What it sees, by name, in its order; see `names_of`.
        action: What it returns, after scaling: `torque` [N m] of the six joints, or `position` [rad] that a spring and
            a damper of each joint are held to.
        offset: Added to the scaled numbers, one for all joints or six.
        scale: What the network's numbers are multiplied by, one for all joints or six.
        stiffness: [N m/rad] of the springs with `position`.
        damping: [N m s/rad] of their dampers.
        rate: [Hz] at which it is asked; in between its latest action holds. None: at every tick.
    """

    network: ClassVar[str]
    observations: ClassVar[tuple[str, ...]]
    action: ClassVar[Literal["torque", "position"]] = "torque"
    offset: ClassVar[float | Sequence[float]] = 0.0
    scale: ClassVar[float | Sequence[float]] = 1.0
    stiffness: ClassVar[float | Sequence[float]] = 0.0
    damping: ClassVar[float | Sequence[float]] = 0.0
    rate: ClassVar[float | None] = None

    def __init__(self, setup: Setup | PlanarSetup):
        if self.action not in ("torque", "position"):
            raise ValueError(f"action: expected 'torque' or 'position', got {self.action!r}")
        self._seen = places(setup.robot, self.observations)
        self._every = 1 if self.rate is None else round(1.0 / (self.rate * setup.tick))
        if self._every < 1 or (self.rate and abs(self._every * self.rate * setup.tick - 1.0) > 1e-9):
            raise ValueError(f"rate: expected a whole part of {1.0 / setup.tick:g} Hz, got {self.rate}")
        robot = setup.robot
        self._driven = robot.places, robot.columns  # where the driven joints stand in q and v
        size = len(robot.actuators)
        self._offset, self._scale, self._k, self._b = (
            np.broadcast_to(np.array(value, dtype=float), size)
            for value in (self.offset, self.scale, self.stiffness, self.damping)
        )
        self._ask, self._input = _session(
            Path(inspect.getfile(type(self))).parent / self.network, len(self._seen), size
        )
        self._ticks, self._latest = 0, np.zeros(size)

    def torques(self, sensed: Any) -> np.ndarray:
        """(6,) [N m]; of a robot of another kind (nu,)."""
        if self._ticks % self._every == 0:
            whole = everything(sensed) if hasattr(sensed, "state") else everything_of(sensed)
            seen = whole[self._seen].astype(np.float32)
            said: Any = self._ask(None, {self._input: seen[None]})[0]
            self._latest = self._offset + self._scale * said[0].astype(float)
        self._ticks += 1
        if self.action == "torque":
            return self._latest
        places, columns = self._driven
        return self._k * (self._latest - sensed.q[places]) - self._b * sensed.v[columns]


def names_of(robot: Robot) -> list[str]:
    """Everything that a network can be shown.

    Joint coordinates `q.NAME` [m, rad] and velocities `v.NAME`; absolute link angles `angle.NAME` [rad] and rates
    `rate.NAME`; `height.NAME` [m] and `contact.NAME` (0 or 1) of toes and heels; `touching.NAME` (0 or 1) of these and
    of the knees at their stops; `Q_d.NAME` of joints [N, N m]; `state.NAME.1` … `.4` of the legs (1 in that state, else
    0); `time` [s].
    """
    links, points = robot.bodies, robot.points
    return [
        *(f"q.{name}" for name in robot.q_names), *(f"v.{name}" for name in robot.q_names),
        *(f"angle.{name}" for name in links), *(f"rate.{name}" for name in links),
        *(f"height.{name}" for name in points), *(f"contact.{name}" for name in points),
        *(f"touching.{name}" for name in (*points, *robot.stops)), *(f"Q_d.{name}" for name in robot.q_names),
        *(f"state.{leg}.{state + 1}" for leg in robot.legs for state in range(STATES)), "time",
    ]  # fmt: skip


def everything(sensed: PlanarObservation) -> np.ndarray:
    """All that `names_of` names, in its order."""
    states = (sensed.state[:, None] == np.arange(1, STATES + 1)).ravel()
    return np.concatenate(
        [
            sensed.q,
            sensed.v,
            sensed.angle,
            sensed.rate,
            sensed.height,
            sensed.contact,
            sensed.touching,
            sensed.Q_d,
            states,
            [sensed.time],
        ]
    )


def names_of_any(robot: Robot) -> list[str]:
    """Everything that the network of a robot of another kind can be shown.

    Coordinates `q.NAME` and velocities `v.NAME` as in `biped model --json`; of contact points `height.NAME` [m] and
    `contact.NAME` (0 or 1); `com.x` … of the centre of mass [m] and `com_velocity.x` … [m/s]; in the frame of the base
    the direction `gravity.x` … and `gyro.x` … [rad/s]; `time` [s].
    """
    points, three = robot.points, "xyz"
    return [
        *(f"q.{name}" for name in robot.q_names), *(f"v.{name}" for name in robot.v_names),
        *(f"height.{name}" for name in points), *(f"contact.{name}" for name in points),
        *(f"{what}.{axis}" for what in ("com", "com_velocity", "gravity", "gyro") for axis in three), "time",
    ]  # fmt: skip


def everything_of(sensed: Observation) -> np.ndarray:
    """All that `names_of_any` names, in its order."""
    base, gravity = sensed.base, sensed.gravity
    return np.concatenate(
        [
            sensed.q,
            sensed.v,
            sensed.height,
            sensed.touching,
            sensed.com,
            sensed.com_velocity,
            base.orientation.T @ gravity / np.linalg.norm(gravity),
            base.orientation.T @ base.angular_velocity,
            [sensed.time],
        ]
    )


def places(robot: Robot, observations: Sequence[str]) -> np.ndarray:
    """Where observations stand among everything.

    Raises:
        ValueError: One has no such name.
    """
    known = names_of_any(robot) if robot.seven_links is None else names_of(robot)
    for name in observations:
        if name not in known:
            raise ValueError(f"observations: unknown '{name}'; {nearest(name, known)}")
    return np.array([known.index(name) for name in observations], dtype=int)


def _session(file: Path, size: int, actions: int):
    """The session that runs a network, and the name of its input.

    Raises:
        ValueError: It is not such a network.
        ImportError: onnxruntime is not installed.
    """
    if not file.is_file():
        raise ValueError(f"network: no file {file.name} beside the law")
    try:
        session = session_of(str(file))
    except ValueError as error:
        raise ValueError(f"network: {file.name} is {error}") from None
    inputs, outputs = session.get_inputs(), session.get_outputs()
    shapes = [list(inputs[0].shape), list(outputs[0].shape)] if len(inputs) == len(outputs) == 1 else []
    if [shape[-1] for shape in shapes] != [size, actions] or inputs[0].type != "tensor(float)":
        told = "; ".join(f"{one.name} {one.type} {one.shape}" for one in (*inputs, *outputs))
        raise ValueError(f"network: expected one input (1, {size}) of floats and one output (1, {actions}), got {told}")
    return session.run, inputs[0].name
