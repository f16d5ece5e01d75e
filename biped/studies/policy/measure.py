"""Measurements of a policy from its card: speed, cost, and the largest pushes, slopes and latency that it stands.

Each limit is searched upward, level by level, and ends below the first at which a run falls.
"""

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

from biped.engines.mujoco import simulate
from biped.ensemble.plan import Plan
from biped.measure.metrics import assess
from biped.robot.gravity import GRAVITY
from biped.scenario.card import Card
from biped.scenario.card_file import read_card
from biped.studies.policy.checks import commands_of, plan_of

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
