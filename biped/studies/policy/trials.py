"""Trials of a policy by its card: faults that checks must find, and what it costs and withstands.

How many of the faults that are put into a right card its checks find is what the checks are worth. Limits of pushes,
slopes and latency are searched upward, level by level, and end below the first at which a run falls.
"""

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from msgspec import structs

from biped.engines.mujoco import simulate
from biped.ensemble.plan import Plan
from biped.measure.metrics import assess
from biped.robot.ground import GRAVITY
from biped.scenario.card import Card, Numbers, per_joint, read_card
from biped.studies.policy import check, commands_of, plan_of, reproduce, run_of
from biped.studies.policy.tape import record

JITTER = 0.01
"""[rad] std of the starts in which a right card is checked."""


class Fault(NamedTuple):
    """An injected fault.

    Attributes:
        name: In words.
        found: The check that failed; empty if none did.
    """

    name: str
    found: str


class CardTrial(NamedTuple):
    """A card's faults, and what its checks say of the card as it is.

    Attributes:
        card: Its file.
        faults: One by one.
        right: Starts in which the right card was checked.
        alarms: Checks that failed then.
    """

    card: str
    faults: tuple[Fault, ...]
    right: int
    alarms: tuple[Fault, ...]

    def as_dict(self) -> dict[str, Any]:
        """Plain data, as `--json` prints it."""
        return {"card": self.card, "faults": [one._asdict() for one in self.faults], "right": self.right,
                "alarms": [one._asdict() for one in self.alarms]}  # fmt: skip


def trial(file: Path, right: int) -> CardTrial:
    """Tries the checks of a card with faults and without.

    Args:
        file: The card's file.
        right: Starts, a few hundredths of a radian apart, in which the card is checked as it is.
    """
    faults, alarms = inject(file), []
    for seed in range(right):
        text = f"seed = {seed}\nstart.jitter = {JITTER}\n" if seed else ""
        alarms += [Fault(f"start {seed}", one.name) for one in check(file, more=text) if not one.passed]
    return CardTrial(str(file), tuple(faults), right, tuple(alarms))


def inject(file: Path) -> list[Fault]:
    """Injects faults into a right card, one at a time, and notes which check finds each: first those of a tape.

    Args:
        file: The card's file.
    """
    card, out = read_card(file), []
    right: set[str] | None = None  # checks that the right card passes
    tape = record(run_of(file, card, commands_of(card)[0][1]))
    for name, wrong in faults_of(card):
        failed = [one.name for one in reproduce(file, tape, wrong) if not one.passed]
        if not failed:
            right = {one.name for one in check(file) if one.passed} if right is None else right
            failed = [one.name for one in check(file, wrong, blind=False) if not one.passed and one.name in right]
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
    if "angular_velocity" in seen:
        degrees = times(seen["angular_velocity"].scale, math.degrees(1.0))
        out.append(("angular_velocity in degrees", term("angular_velocity", scale=degrees)))
    if "joint_position" in seen and any(default) and not seen["joint_position"].joints:
        out.append(("joint_position not from the default", term("joint_position", offset=default)))
    if "last_action" in seen:
        out.append(("last action missing", term("last_action", scale=0.0)))
    if action.stiffness is not None:
        out.append(("stiffness halved", replace(card, action=replace(action, stiffness=times(action.stiffness, 0.5)))))
    return out


SECONDS, BEGIN = 8.0, 2.0
"""[s] of a run, and from when on means are taken."""
MOMENTS, PUSHED, AFTER = (2.0, 2.15, 2.3), 0.2, 2.5
"""[s] at which pushes come, in a run each, for how long, and how long the run goes on."""
IMPULSES = tuple(0.05 * i for i in range(1, 17))
"""In m √(g l)."""
DIRECTIONS = {
    "forward": (1.0, 0.0), "forward and left": (1.0, 1.0), "to the left": (0.0, 1.0), "backward and left": (-1.0, 1.0),
    "backward": (-1.0, 0.0), "backward and right": (-1.0, -1.0), "to the right": (0.0, -1.0),
    "forward and right": (1.0, -1.0),
}  # fmt: skip
"""Forward and left of each push."""
SLOPES = tuple(float(i) for i in range(2, 21, 2))
"""Degrees."""
DELAYS = tuple(0.01 * i for i in range(1, 11))
"""[s] by which commands act late."""


class Bearable(NamedTuple):
    """The largest level that a policy walks through.

    Attributes:
        name: In words.
        unit: Of the level.
        value: It; 0 if the first is too much.
        most: Whether no larger one was tried.
    """

    name: str
    unit: str
    value: float
    most: bool


class Measured(NamedTuple):
    """A policy's row.

    Attributes:
        asked: [m/s] forward.
        speed: [m/s].
        cost: Net cost of transport.
        lasted: Whether it stayed up.
        limits: Of what it walks through.
    """

    asked: float
    speed: float
    cost: float
    lasted: bool
    limits: tuple[Bearable, ...]


def measure(file: Path) -> Measured:
    """Measures a policy on its card's first command.

    Args:
        file: Its card.
    """
    card = read_card(file)
    (_, (forward, _, _)), *_ = commands_of(card)
    plan = _plan(file, card, forward, "")
    run = plan.run(0)
    unit = run.robot.mass * math.sqrt(GRAVITY * run.robot.leg) / PUSHED
    level = simulate(run)
    numbers = assess(level, (BEGIN, SECONDS)).numbers

    def largest(name: str, of: str, levels: Sequence[float], changes: Callable[[float], Sequence[str]]) -> Bearable:
        last = 0.0
        for one in levels:
            if any(simulate(_plan(file, card, forward, text).run(0)).end != "completed" for text in changes(one)):
                return Bearable(name, of, last, False)
            last = one
        return Bearable(name, of, last, True)

    def pushes(x: float, y: float) -> Callable[[float], Sequence[str]]:
        def changes(one: float) -> Sequence[str]:
            share = one * unit / math.hypot(x, y)
            force = [share * x, share * y, 0.0]
            return [
                f"duration = {at + PUSHED + AFTER}\npush = [{{at = {at}, duration = {PUSHED}, force = {force}}}]\n"
                for at in MOMENTS
            ]

        return changes

    limits = (
        *(largest(f"push {name}", "J/(m√(g l))", IMPULSES, pushes(*way)) for name, way in DIRECTIONS.items()),
        largest("slope up", "degrees", SLOPES, lambda one: [f"ground = {{ slope = {one} }}\n"]),
        largest("slope down", "degrees", SLOPES, lambda one: [f"ground = {{ slope = {-one} }}\n"]),
        largest("latency", "s", DELAYS, lambda one: [f"actuation = {{ delay = {one} }}\n"]),
    )
    return Measured(forward, numbers["speed"], numbers["cost_of_transport"], level.end == "completed", limits)


def _plan(file: Path, card: Card, forward: float, more: str) -> Plan:
    """A run of a card with more in its scenario."""
    lasting = "" if more.startswith("duration") else f"duration = {SECONDS}\n"
    return plan_of(file, card, f"{lasting}{more}command = {{ forward = {forward} }}\n")
