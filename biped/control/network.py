"""A policy's network and the numbers that it is shown: measured, delayed, scaled and remembered."""

import math
import os
from collections import deque
from collections.abc import Callable, Sequence
from functools import lru_cache
from itertools import chain, islice
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from biped.base.errors import InputError
from biped.base.files import label
from biped.control.observation import Observation
from biped.scenario.card import Clock, Term

NEEDS = "a policy network needs onnxruntime, which is not installed; pip install onnxruntime"


class Network:
    """A network during one run; the hidden state of a recurrent one goes from call to call.

    Args:
        file: The ONNX file: its first input takes an observation, its first output is the action; the others, in the
            same order, are the hidden state.

    Attributes:
        size: How many numbers it takes; None: any.
        actions: How many it returns; None: any.

    Raises:
        InputError: It is no such network, or onnxruntime is not installed.
    """

    def __init__(self, file: Path):
        self._session, self._inputs, outputs = _session(str(file), file.stat().st_mtime, os.getpid())
        if len(self._inputs) != len(outputs):
            raise InputError(f"{label(file)}: expected as many hidden states out as in, got "
                             f"{len(self._inputs) - 1} in and {len(outputs) - 1} out", "law")  # fmt: skip
        self.size, self.actions = (_width(one[0]) for one in (self._inputs, outputs))
        self._name = self._inputs[0].name
        self._hidden = [np.zeros([d if isinstance(d, int) else 1 for d in one.shape], np.float32)
                        for one in self._inputs[1:]]  # fmt: skip

    def ask(self, observed: np.ndarray) -> np.ndarray:
        """(actions,) what it returns for an observation (size,) of 32-bit floats."""
        feed = {self._name: observed[None]}
        for one, value in zip(self._inputs[1:], self._hidden, strict=True):
            feed[one.name] = value
        found: Any = self._session.run(None, feed)
        self._hidden = list(found[1:])
        return np.asarray(found[0], dtype=np.float32).reshape(-1)


def metadata(file: Path) -> dict[str, str]:
    """Words that a trainer wrote into an ONNX file, by name.

    Raises:
        InputError: It is no such file, or onnxruntime is not installed.
    """
    session, _, _ = _session(str(file), file.stat().st_mtime, os.getpid())
    return dict(session.get_modelmeta().custom_metadata_map)


def _width(one: Any) -> int | None:
    width = one.shape[-1] if one.shape else 1
    return width if isinstance(width, int) else None


@lru_cache(maxsize=8)
def _session(file: str, modified: float, process: int) -> tuple[Any, list[Any], list[Any]]:
    """A network, its inputs and its outputs; one of each process."""
    try:
        session = session_of(file)
    except ImportError as error:
        raise InputError(f"law: {error}", "law") from None
    except ValueError as error:
        raise InputError(f"{label(Path(file))}: {error}", "law") from None
    return session, list(session.get_inputs()), list(session.get_outputs())


def session_of(file: str) -> Any:
    """A session of onnxruntime that runs a network in one thread.

    Raises:
        ValueError: The file is no network.
        ImportError: onnxruntime is not installed.
    """
    try:
        import onnxruntime
    except ImportError:
        raise ImportError(NEEDS) from None
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = options.inter_op_num_threads = 1  # small networks gain nothing from more
    options.log_severity_level = 4
    try:
        return onnxruntime.InferenceSession(file, options, providers=["CPUExecutionProvider"])
    except Exception as error:
        raise ValueError(f"not an ONNX network: {' '.join(str(error).split())[:200]}") from None


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
