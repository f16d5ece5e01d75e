"""A slice through a gait's basin of attraction: torso lean and forward speed, changed at the section.

Every point of a grid is a change of lean and speed that several states of the steady gait are given; what becomes of
them is one of three things: a fall, a walk that is not the gait's, the gait.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from biped.base.errors import RunError
from biped.studies.stability.kicks import Kicks
from biped.studies.stability.section import PoincareSection

LEAN = tuple(np.linspace(-0.75, 0.75, 11))
"""[rad] forward."""
SPEED = tuple(np.linspace(-1.0, 1.0, 11))
"""[m/s] forward."""
STATES = 2
"""Steady states that every change is made to."""
STRIDES = 6
"""Strides of a walk after the change."""
LAST = 2
"""Returns at its end that are compared with the gait's own."""
WITHIN = 0.95
"""Share of the gait's own states that are nearer to its others than what counts as back on the gait."""
SHRUNK = 0.1
"""Share of the change that may be left of it to count as back on the gait: a limit cycle is reached only in the end."""

FELL, WALKS, RETURNED, IMPOSSIBLE = "fell", "walks", "returned", "impossible"
"""What a change ends in: a fall; the walker is still up but not back; it is back; no such posture."""


class Basin(NamedTuple):
    """What became of every change of the grid.

    Attributes:
        lean: [rad] forward, of the grid.
        speed: [m/s] forward, likewise.
        reach: How far a state of the gait may be from the nearest of its other states, natural units.
        states: Steady states that every change was made to.
        counts: For each outcome [lean][speed] how many of them ended so.
    """

    lean: list[float]
    speed: list[float]
    reach: float
    states: int
    counts: dict[str, list[list[int]]]

    def as_dict(self) -> dict[str, Any]:
        """Numbers by name, each outcome under its own."""
        out = self._asdict()
        return out | out.pop("counts")


def reach(steady: np.ndarray) -> float:
    """How far a state of the gait may be from the nearest of its other states, natural units."""
    apart = np.linalg.norm(steady[:, None] - steady[None], axis=2)
    np.fill_diagonal(apart, np.inf)
    return float(np.quantile(apart.min(axis=1), WITHIN))


def basin(
    section: PoincareSection,
    steady: np.ndarray,
    stride: float,
    rng: np.random.Generator,
    mapped: Callable[[Callable, Sequence], list],
) -> Basin:
    """Walks from every change of the grid.

    Args:
        section: The section.
        steady: (m, 17) states of steady walks.
        stride: [s] about as long as a stride takes.
        rng: Draws the states that are changed.
        mapped: How a function of many items is carried out (`biped.studies.stability.workers`).
    """
    chosen = [Kicks(section, z) for z in steady[rng.permutation(len(steady))[:STATES]]]
    near = reach(steady)

    def outcome(at: tuple[Kicks, float, float]) -> str:
        kicks, lean, speed = at
        try:
            changed = kicks.moved(lean, speed)
        except RunError:
            return IMPOSSIBLE
        t, states = section.walk(changed, (STRIDES + 0.5) * stride)
        if t.end != "completed":
            return FELL
        # A walker that no longer strides is up, but not walking as the gait does.
        if len(states) < STRIDES // 2:
            return WALKS
        away = np.linalg.norm(states[-LAST:, None] - steady[None], axis=2).min(axis=1)
        allowed = max(near, SHRUNK * float(np.linalg.norm(changed - kicks.z)))
        return RETURNED if away.min() <= allowed else WALKS

    grid = [(kicks, lean, speed) for lean in LEAN for speed in SPEED for kicks in chosen]
    found = np.array(mapped(outcome, grid)).reshape(len(LEAN), len(SPEED), len(chosen))
    counts = {name: (found == name).sum(axis=2).tolist() for name in (FELL, WALKS, RETURNED, IMPOSSIBLE)}
    return Basin(list(LEAN), list(SPEED), near, len(chosen), counts)
