"""How a disturbance's size changes with a return: from what cannot be seen to what fells the walker.

A gait may amplify the invisible and still forget what can be seen. Pairs of walks, one of them kicked, are compared
after one and after three returns; where the distance is what it was, kicks neither grow nor shrink. Below that size the
gait's own irregularity rules, above it disturbances die out, until the walker falls.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from biped.base.errors import RunError
from biped.studies.stability.kicks import Kicks
from biped.studies.stability.section import PoincareSection

SIZES = (1e-8, 1e-6, 1e-4, 1e-3, 3e-3, 1e-2, 3e-2, 0.1, 0.2, 0.4)
"""Distances of the kicked state, natural units."""

PAIRS = 12
"""Pairs of walks of each size."""

RETURNS = 3


class Shrinking(NamedTuple):
    """What becomes of kicks of one size.

    Attributes:
        size: Distance of the kicked state from the other, natural units.
        after: (RETURNS,) median distance after each return; nan where fewer than half of the pairs got there.
        fell: Kicked walks that fell, of `walks`.
        walks: Kicked walks.
    """

    size: float
    after: list[float]
    fell: int
    walks: int


def shrinking(
    section: PoincareSection,
    steady: np.ndarray,
    stride: float,
    rng: np.random.Generator,
    mapped: Callable[[Callable, Sequence], list],
) -> list[Shrinking]:
    """What becomes of kicks of every size.

    Args:
        section: The section.
        steady: (m, 17) states of steady walks; pairs start from them in turn.
        stride: [s] about as long as a stride takes.
        rng: Draws states and directions.
        mapped: How a function of many items is carried out (`biped.studies.stability.workers`).
    """
    starts = []
    for z in steady[rng.integers(len(steady), size=PAIRS)]:
        kicks = Kicks(section, z)
        starts.append((kicks, rng.standard_normal(kicks.basis.shape[1])))

    def pair(start: tuple[Kicks, np.ndarray]) -> list[tuple[np.ndarray, bool]]:
        """Distances (RETURNS,) after kicks of every size, and whether the kicked walk fell."""
        kicks, direction = start
        seconds = (RETURNS + 0.5) * stride
        plain = section.walk(kicks.z, seconds)[1]
        out = []
        for size in SIZES:
            apart = np.full(RETURNS, np.nan)
            try:
                t, other = section.walk(kicks.along(direction, size), seconds)
            except RunError:  # no such state
                out.append((apart, False))
                continue
            n = min(len(plain), len(other), RETURNS)
            apart[:n] = np.linalg.norm(plain[:n] - other[:n], axis=1)
            out.append((apart, t.end != "completed"))
        return out

    found = mapped(pair, starts)
    rows = []
    for i, size in enumerate(SIZES):
        apart = np.array([one[i][0] for one in found])
        enough = np.isfinite(apart).sum(axis=0) >= PAIRS / 2
        after = [float(np.nanmedian(apart[:, k])) if enough[k] else float("nan") for k in range(RETURNS)]
        rows.append(Shrinking(size, after, sum(one[i][1] for one in found), PAIRS))
    return rows


def floor(rows: Sequence[Shrinking]) -> float | None:
    """The size above which kicks have shrunk after `RETURNS` returns; 0: all do, None: none does."""
    sizes = np.array([row.size for row in rows])
    after = np.array([row.after[-1] for row in rows])
    sizes, after = sizes[np.isfinite(after)], after[np.isfinite(after)]
    grows = np.flatnonzero(after >= sizes)
    if not grows.size:
        return 0.0
    last = int(grows[-1])
    if last + 1 == len(sizes):
        return None
    # The crossing of the diagonal, on a straight line in logarithms.
    low, high = np.log(after[last] / sizes[last]), np.log(after[last + 1] / sizes[last + 1])
    return float(np.exp(np.interp(0.0, [high, low], np.log([sizes[last + 1], sizes[last]]))))
