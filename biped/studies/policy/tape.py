"""Tapes of a policy: states, observations and actions, call by call, that a right card reproduces."""

import math
from pathlib import Path
from typing import Any, NamedTuple

import mujoco
import numpy as np

from biped.base.errors import InputError, why
from biped.base.files import label
from biped.control.card import Walker
from biped.engines.plant import MujocoPlant
from biped.robot.run import Run

MOST_BYTES = 200_000_000
CLOSE = 1e-4
"""Of a number of an observation or action, by which a tape may differ: 32-bit floats, and a trainer's own rounding."""


class Tape(NamedTuple):
    """A tape, from the first call on.

    Attributes:
        time: (n,) [s] of the calls.
        qpos: (n, nq) coordinates, in MuJoCo's order.
        qvel: (n, nv) velocities.
        command: (n, 3) forward, left, yaw.
        observation: (n, k) what the network was shown.
        action: (n, m) what it returned.
        target: (n, m) [rad] or [N m] what became of that.
        applied: (n, m) the target that acted until the call.
    """

    time: np.ndarray
    qpos: np.ndarray
    qvel: np.ndarray
    command: np.ndarray
    observation: np.ndarray
    action: np.ndarray
    target: np.ndarray
    applied: np.ndarray


class _Fixed(NamedTuple):
    """A command as it was at a call."""

    value: np.ndarray

    def at(self, _: float) -> np.ndarray:
        return self.value


def read_tape(path: Path) -> Tape:
    """Reads a tape from the arrays of an .npz file.

    Raises:
        InputError: It is none.
    """
    try:
        if path.stat().st_size > MOST_BYTES:
            raise InputError(f"{label(path)}: expected a tape of at most {MOST_BYTES // 10**6} MB")
        with np.load(path, allow_pickle=False) as file:
            return Tape(**{name: np.asarray(file[name], dtype=float) for name in Tape._fields})
    except (OSError, ValueError, KeyError) as error:
        raise InputError(f"{label(path)}: expected a tape: an .npz file of the arrays {', '.join(Tape._fields)} "
                         f"(docs/your-policy.md); {why(error)}") from None  # fmt: skip


def record(run: Run) -> Tape:
    """Returns the tape of a run: what its policy was shown and did at every call.

    Raises:
        InputError: It failed in the first call.
    """
    plant = MujocoPlant(run)
    law: Any = plant.law.law
    rows: list[tuple[np.ndarray, ...]] = []
    calls, ask = 0, law.torques

    def torques(sensed: Any) -> np.ndarray:
        nonlocal calls
        out = ask(sensed)
        if law.calls > calls:
            calls = law.calls
            rows.append((np.array(sensed.time), sensed.q.copy(), sensed.v.copy(), sensed.command, law.observed.copy(),
                         law.action.copy(), law.target.copy(), law.applied.copy()))  # fmt: skip
        return out

    law.torques = torques
    plant.advance(0, run.ticks)
    if not rows:
        raise InputError(f"{run.scenario.law}: the policy fails in its first call, so there is no tape of it")
    return Tape(*(np.array(column, dtype=float) for column in zip(*rows, strict=True)))


class Decisions(NamedTuple):
    """A policy's decisions in the states of a tape, call by call.

    Attributes:
        observed: (k,) each: the network's input.
        acted: (m,) its output.
        targets: (m,) what became of that.
    """

    observed: list[np.ndarray]
    acted: list[np.ndarray]
    targets: list[np.ndarray]


def replay(plant: MujocoPlant, tape: Tape, opposite: bool = False) -> Decisions:
    """Has a policy decide in the states of a tape, of which each call is shown the tape's latest action.

    Args:
        plant: Of a run of its card, at its start.
        tape: It.
        opposite: Whether its clock is half a turn ahead: the other leg's.
    """
    law, data, sensed, out = plant.law.law, plant.data, plant.truth, Decisions([], [], [])
    assert isinstance(law, Walker)
    if opposite and law.clock is not None:
        law.clock.turn(math.pi)
    for i, time in enumerate(tape.time):
        data.qpos[:], data.qvel[:] = tape.qpos[i], tape.qvel[i]
        mujoco.mj_forward(plant.model, data)
        sensed.begin(float(time))
        sensed.command_at = _Fixed(tape.command[i])  # type: ignore[assignment]
        law.ask(sensed)
        out.observed.append(law.observed)
        out.acted.append(law.action)
        out.targets.append(law.target)
        law.action = tape.action[i].astype(np.float32)  # the next call is shown the tape's
    return out


def differences(run: Run, tape: Tape) -> dict[str, float]:
    """Largest differences between a tape and what a card makes of its states: by term, of actions, targets and times.

    Args:
        run: Of the card.
        tape: It.

    Raises:
        InputError: The tape is of another robot.
    """
    plant = MujocoPlant(run)
    law: Any = plant.law.law
    for name, size in (("qpos", plant.model.nq), ("qvel", plant.model.nv)):
        if getattr(tape, name).shape[1:] != (size,):
            raise InputError(
                f"tape: {name}: expected {size} numbers a call, as the model has, got {getattr(tape, name).shape}"
            )
    replayed = replay(plant, tape)
    out = {}
    observed = np.array(replayed.observed)
    if observed.shape != tape.observation.shape:
        out["widths"] = float(abs(observed.shape[-1] - tape.observation.shape[1]))
    else:
        gap, first = np.abs(observed - tape.observation).max(axis=0), 0
        for name, size in law.sizes:
            out[name] = max(out.get(name, 0.0), float(gap[first : first + size].max()))
            first += size
    for name, ours, theirs in (("actions", replayed.acted, tape.action), ("targets", replayed.targets, tape.target)):
        out[name] = float(np.abs(np.array(ours) - theirs).max()) if np.shape(ours) == theirs.shape else np.inf
    before = 1 + law.late
    if len(tape.time) > before:
        out["delay"] = float(np.abs(tape.applied[before:] - tape.target[:-before]).max())
    if len(tape.time) > 1:
        out["rate"] = float(abs(np.median(np.diff(tape.time)) * law.rate - 1.0))
    return out
