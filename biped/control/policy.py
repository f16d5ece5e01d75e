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

if TYPE_CHECKING:
    from biped.control.law import Setup
    from biped.control.observation import Observation
    from biped.control.planar.user import PlanarObservation, PlanarSetup


class Policy:
    """A law that asks a network; subclass it and say what is what.

    Attributes:
        network: The ONNX file, beside the file of the class.
        observations: What it sees, by name, in its order: some of the setup's `observed`.
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
        self._seen = places(setup.observed, self.observations)
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

    def torques(self, sensed: Observation | PlanarObservation) -> np.ndarray:
        """(6,) [N m]; of a robot of another kind (nu,)."""
        if self._ticks % self._every == 0:
            seen = sensed.numbers[self._seen].astype(np.float32)
            said: Any = self._ask(None, {self._input: seen[None]})[0]
            self._latest = self._offset + self._scale * said[0].astype(float)
        self._ticks += 1
        if self.action == "torque":
            return self._latest
        places, columns = self._driven
        return self._k * (self._latest - sensed.q[places]) - self._b * sensed.v[columns]


def places(known: Sequence[str], observations: Sequence[str]) -> np.ndarray:
    """Where observations stand among all that there are.

    Raises:
        ValueError: One has no such name.
    """
    for name in observations:
        if name not in known:
            raise ValueError(f"observations: unknown '{name}'; {nearest(name, list(known))}")
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
