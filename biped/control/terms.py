"""Numbers that a policy is shown, measured, delayed, scaled and remembered; and its clock."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable

import mujoco
import numpy as np

from biped.control.observation import Observation
from biped.scenario.card import Clock, Term

Measure = Callable[[Observation], np.ndarray]
"""Numbers of a term at a call."""


class Shown:
    """A term with its history.

    Attributes:
        kept: Its latest numbers, the oldest first.
    """

    def __init__(self, term: Term, measure: Measure):
        self._term, self._measure = term, measure
        self._scale, self._offset = (np.array(value, dtype=float) for value in (term.scale, term.offset))
        self._late: deque[np.ndarray] = deque(maxlen=term.delay + 1)
        self.kept: deque[np.ndarray] = deque(maxlen=term.history)

    def show(self, sensed: Observation) -> list[np.ndarray]:
        """Its latest numbers, the oldest first; before the first call everything was as at the first."""
        self._late.append(np.array(self._measure(sensed), dtype=float))
        value = self._late[0]
        value = value + self._offset
        if self._term.clip is not None:
            value = np.clip(value, *self._term.clip)
        value = value * self._scale
        while True:
            self.kept.append(value)
            if len(self.kept) == self.kept.maxlen:
                return list(self.kept)


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
        return pose.orientation.T @ (sensed.gravity / np.linalg.norm(sensed.gravity))
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
