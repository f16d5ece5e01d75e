"""Numbers that a policy is shown, measured, delayed, scaled and remembered; and its clock."""

import math
from collections import deque
from collections.abc import Callable, Sequence
from itertools import chain, islice

import mujoco
import numpy as np

from biped.control.observation import Observation
from biped.scenario.card import Clock, Term

Measure = Callable[[Observation], np.ndarray]
"""Numbers of a term at a call."""


class Shown:
    """Assembles what a network is shown: terms measured, offset, clipped, scaled, delayed and remembered.

    Args:
        terms: In the network's order.
        measures: Of each.
        sizes: (n,) how many numbers each has at a call.
        by_call: Whether histories are laid side by side call by call, not term by term.
    """

    def __init__(self, terms: Sequence[Term], measures: Sequence[Measure], sizes: Sequence[int], by_call: bool):
        self._measures, self._by_call = tuple(measures), by_call

        def each(values: Sequence[float | tuple[float, ...]]) -> np.ndarray:
            return np.concatenate([np.broadcast_to(one, size) for one, size in zip(values, sizes, strict=True)])

        self._offset, self._scale = each([term.offset for term in terms]), each([term.scale for term in terms])
        self._low = each([-np.inf if term.clip is None else term.clip[0] for term in terms])
        self._high = each([np.inf if term.clip is None else term.clip[1] for term in terms])
        self._clipped = any(term.clip is not None for term in terms)
        self._ends, self._histories = np.cumsum(sizes)[:-1], [term.history for term in terms]
        self._past: list[deque[np.ndarray]] = [deque(maxlen=term.history + term.delay) for term in terms]
        self._remembers = any(past.maxlen != 1 for past in self._past)

    def show(self, sensed: Observation) -> np.ndarray:
        """(k,) 32-bit floats; of a history the oldest first, before the first call everything was as at the first."""
        values = np.concatenate([measure(sensed) for measure in self._measures], dtype=float)
        values += self._offset
        if self._clipped:
            np.minimum(np.maximum(values, self._low, out=values), self._high, out=values)
        values *= self._scale
        if not self._remembers:
            return values.astype(np.float32)
        parts = []
        for past, value, history in zip(self._past, np.split(values, self._ends), self._histories, strict=True):
            past.extend([value] * (1 if past else past.maxlen or 1))
            parts.append(list(islice(past, history)))
        shown = [value for call in zip(*parts, strict=True) for value in call] if self._by_call else chain(*parts)
        return np.concatenate(list(shown)).astype(np.float32)


class Phases:
    """The clock of a policy."""

    def __init__(self, clock: Clock, period: float):
        self._clock, self._period = clock, period
        self._phase, self._still, self._frequency = np.array(clock.offsets), False, clock.frequency

    def turn(self, angle: float) -> None:
        """All phases go on by an angle [rad]."""
        self._phase = self._phase + angle

    def begin(self, command: np.ndarray) -> None:
        """A call begins."""
        clock, size = self._clock, float(np.linalg.norm(command))
        small = size < clock.threshold
        self._still = small and clock.still is not None
        self._frequency = clock.frequency + (0.0 if small else clock.per_speed * min(size, clock.most_speed))

    def end(self) -> None:
        """It is done: time goes on."""
        moved = self._phase + 2.0 * math.pi * self._frequency * self._period
        self._phase = np.fmod(moved + math.pi, 2.0 * math.pi) - math.pi

    def read(self, cosine_first: bool, _: Observation) -> np.ndarray:
        """(2 k,) cosines and sines of all phases."""
        phase = np.full_like(self._phase, self._clock.still) if self._still else self._phase
        parts = (np.cos(phase), np.sin(phase))
        return np.concatenate(parts if cosine_first else parts[::-1])


def in_frame(term: str, frame: str, sensed: Observation) -> np.ndarray:
    """(3,) a velocity or the direction of gravity in the frame of a site or body, by default the base."""
    pose = sensed.frame(frame or sensed.robot.base)
    if term == "gravity":
        return pose.orientation.T @ sensed.down
    return pose.velocity if term == "linear_velocity" else pose.angular_velocity


def of_base(term: str, sensed: Observation) -> np.ndarray:
    """Height [m], heading [rad] or orientation of the base in the world's frame, or the time [s]."""
    if term == "time":
        return np.array([sensed.time])
    pose = sensed.base
    R = pose.orientation
    yaw, pitch, roll = (
        math.atan2(R[1, 0], R[0, 0]),
        math.asin(max(-1.0, min(1.0, -R[2, 0]))),
        math.atan2(R[2, 1], R[2, 2]),
    )
    match term:
        case "height":
            return pose.position[2:]
        case "heading":
            return np.array([yaw])
        case "euler":
            return np.array([roll, pitch, yaw])
        case "rotation_6d":
            return R[:, :2].ravel()
        case _:
            quaternion = _quaternion(R)
            return quaternion if term == "quaternion_wxyz" else np.roll(quaternion, -1)


def _quaternion(R: np.ndarray) -> np.ndarray:
    """(4,) scalar first and not negative."""
    out = np.empty(4)
    mujoco.mju_mat2Quat(out, np.ascontiguousarray(R).ravel())
    return out if out[0] >= 0.0 else -out
