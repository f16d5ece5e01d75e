"""Self-checks of a policy's card: most policies that seem bad have a wrong card."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from msgspec import structs

from biped.control.card import Networked
from biped.engines.mujoco import simulate
from biped.ensemble.plan import Plan
from biped.measure.metrics.space import headings
from biped.measure.trajectory import Trajectory
from biped.robot.law_factory import Factory
from biped.robot.run import Run
from biped.scenario.card import Card, Numbers, per_joint
from biped.scenario.card_file import read_card
from biped.scenario.reading import from_text
from biped.studies.policy.tape import CLOSE, Tape, differences, record

SECONDS = 4.0
"""[s] of each run."""
SETTLED = 1.5
"""[s] after which velocities count."""
ALONG, ACROSS, DRIFT = 0.3, 0.35, 1.0
"""Least share of a command that is done; most [m/s] across it; most [m] that is moved where nothing is asked for."""
SMALL = 0.2
"""[m/s, rad/s] A smaller command may be passed over, as many policies do; the other way is wrong all the same."""

Tell = Callable[[str], None]


class Check(NamedTuple):
    """One check.

    Attributes:
        name: In words.
        passed: Whether it passed.
        words: What came of it.
    """

    name: str
    passed: bool
    words: str


def check(file: Path, card: Card | None = None, blind: bool = True) -> list[Check]:
    """Checks a card by short runs on level ground.

    Args:
        file: The card's file.
        card: What stands for it instead of its contents.
        blind: Whether to see that permuted joints fail too.

    Returns:
        The checks; names and widths, which raise where they fail, come first.

    Raises:
        InputError: Card, network and model do not fit one another.
    """
    card = read_card(file) if card is None else card
    out = []
    still = _walk(file, card, (0.0, 0.0, 0.0))
    out.append(
        Check("names and widths fit the model", True, f"{len(card.joints)} joints, {len(card.observation)} terms")
    )
    drift = float(np.hypot(*(still.base[-1, :2] - still.base[0, :2])))
    out.append(Check("stays up and in place under zero command", still.end == "completed" and drift < DRIFT,
                     f"{_end(still)}, moved {drift:.2f} m"))  # fmt: skip
    for name, command in _commands(card):
        t = _walk(file, card, command)
        out.append(_followed(name, command, t))
    if blind:
        shifted = structs.replace(card, joints=(*card.joints[1:], card.joints[0]))
        t = _walk(file, shifted, _commands(card)[0][1])
        wrong = not _followed("", _commands(card)[0][1], t).passed
        out.append(Check("permuted joints fail", wrong, _end(t) if wrong else "they walk too: these checks are blind"))
    return out


def _commands(card: Card) -> list[tuple[str, tuple[float, float, float]]]:
    """Commands within what a policy was trained on, and their names."""

    def bound(name: str, value: float) -> float:
        low, high = card.command.get(name, (-value, value))
        return min(max(value, 0.8 * low), 0.8 * high)

    return [
        ("walks forward", (bound("forward", 0.5), 0.0, 0.0)),
        ("walks backward", (bound("forward", -0.4), 0.0, 0.0)),
        ("walks to the left", (0.0, bound("left", 0.3), 0.0)),
        ("turns to the left", (0.0, 0.0, bound("yaw", 0.5))),
    ]


def _walk(file: Path, card: Card, command: tuple[float, float, float]) -> Trajectory:
    """A short run under a command."""
    return simulate(run_of(file, card, command))


def run_of(file: Path, card: Card, command: tuple[float, float, float]) -> Run:
    """Returns a short run of a card under a command."""
    forward, left, yaw = command
    text = (f'law = "{file.name}"\nduration = {SECONDS}\n'
            f"command = {{ forward = {forward}, left = {left}, yaw = {yaw} }}\n")  # fmt: skip
    scenario = from_text(text, file.parent / "check.toml")
    return Plan(scenario, law=Factory(Networked(card, file), scenario.law or "", str(file))).run(0)


def reproduce(file: Path, tape: Tape, card: Card | None = None) -> list[Check]:
    """Checks a card against a tape: each term of the observation, actions, targets and rate.

    Args:
        file: The card's file.
        tape: It.
        card: What stands for it instead of its contents.

    Raises:
        InputError: Card, network and model, or card and tape, do not fit one another.
    """
    gaps = differences(run_of(file, read_card(file) if card is None else card, (0.0, 0.0, 0.0)), tape)
    return [Check(f"{name} as on the tape", gap < CLOSE, f"differs by at most {gap:.2g}") for name, gap in gaps.items()]


def _followed(name: str, command: tuple[float, float, float], t: Trajectory) -> Check:
    if t.end != "completed":
        return Check(name, False, f"asked for ({', '.join(f'{value:g}' for value in command)}); {_end(t)}")
    late = t.time > SETTLED
    way, heading = headings(t)[late], np.diff(headings(t)[late]).mean() / t.tick
    moved = np.diff(t.base[late, :2], axis=0) / t.tick
    c, s = np.cos(way[:-1]), np.sin(way[:-1])
    forward, left = float((c * moved[:, 0] + s * moved[:, 1]).mean()), float((c * moved[:, 1] - s * moved[:, 0]).mean())
    done, asked = np.array([forward, left, heading]), np.array(command)
    size = float(np.linalg.norm(asked))
    along = float(done @ asked) / size
    across = float(np.linalg.norm((done - along * asked / size)[:2]))
    words = ", ".join(f"{value:.2f}" for value in done)
    least = ALONG * size if size >= SMALL else -0.5 * size
    return Check(name, along > least and across < ACROSS,
                 f"asked for ({', '.join(f'{value:g}' for value in command)}), did ({words})")  # fmt: skip


def _end(t: Trajectory) -> str:
    return "stayed up" if t.end == "completed" else f"{t.end} at {float(t.time[-1]):.2f} s"


class Fault(NamedTuple):
    """An injected fault.

    Attributes:
        name: In words.
        found: The check that failed; empty if none did.
    """

    name: str
    found: str


def inject(file: Path, tell: Tell) -> list[Fault]:
    """Injects faults into a right card, one at a time, and notes which check finds each: first those of a tape.

    Args:
        file: The card's file.
        tell: Told of each fault.
    """
    card, out = read_card(file), []
    tape = record(run_of(file, card, _commands(card)[0][1]))
    for name, wrong in faults_of(card):
        tell(name)
        failed = [one.name for one in reproduce(file, tape, wrong) if not one.passed]
        failed = failed or [one.name for one in check(file, wrong, blind=False) if not one.passed]
        out.append(Fault(name, failed[0] if failed else ""))
    return out


def faults_of(card: Card) -> list[tuple[str, Card]]:
    """A right card with one thing wrong in it, for every kind of fault that it can have."""
    replace, count, action = structs.replace, len(card.joints), card.action

    def term(name: str, **change: Any) -> Card:
        return replace(card, observation=tuple(replace(one, **change) if one.term == name else one
                                               for one in card.observation))  # fmt: skip

    def times(value: Numbers, factor: float) -> Numbers:
        return tuple(factor * one for one in value) if isinstance(value, tuple) else factor * value

    half = count // 2
    default = per_joint(card.default, count)
    seen = {one.term: one for one in card.observation}
    out = [
        ("joints in another order", replace(card, joints=(*card.joints[half:], *card.joints[:half]))),
        ("actions with the other sign", replace(card, action=replace(action, scale=times(action.scale, -1.0)))),
        ("actions three times as large", replace(card, action=replace(action, scale=times(action.scale, 3.0)))),
        ("default pose of zeros", replace(card, default=0.0)),
        ("default pose with the other sign", replace(card, default=times(default, -1.0))),
        ("asked half as often", replace(card, rate=0.5 * card.rate)),
        ("actions late by two calls", replace(card, action=replace(action, delay=2.0 / card.rate))),
    ]
    for name in ("gravity", "angular_velocity", "joint_position", "joint_velocity", "command"):
        if name in seen:
            out.append((f"{name} with the other sign", term(name, scale=times(seen[name].scale, -1.0))))
    if "last_action" in seen:
        out.append(("last action missing", term("last_action", scale=0.0)))
    if action.stiffness is not None:
        out.append(("stiffness halved", replace(card, action=replace(action, stiffness=times(action.stiffness, 0.5)))))
    return out
