"""A run cut where pushes begin and end."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from biped.scenario.keys import Scenario


def spans_of(
    s: Scenario, forces: Sequence[np.ndarray], none: np.ndarray, count: int, tick: float
) -> list[tuple[int, int, np.ndarray]]:
    """The run in pieces in which the same pushes act.

    Args:
        s: The scenario.
        forces: What each of its pushes is, in any shape.
        none: What acts where none does, in the same shape.
        count: Number of ticks.
        tick: [s].

    Returns:
        (first tick, last tick + 1, sum of the pushes) of each piece.
    """
    spans = [(round(p.at / tick), round((p.at + p.duration) / tick)) for p in s.push]
    cuts = sorted({0, count, *(min(t, count) for span in spans for t in span)})
    out = []
    for first, last in pairwise(cuts):
        total = none.copy()
        for (start, stop), force in zip(spans, forces, strict=True):
            if start <= first < stop:
                total += force
        out.append((first, last, total))
    return out
