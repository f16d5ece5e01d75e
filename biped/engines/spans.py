"""A run cut where the forces of its pushes change."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise

import numpy as np

from biped.base.errors import InputError
from biped.base.files import nearest
from biped.scenario.keys import Scenario
from biped.scenario.pushing import pieces


def push_spans(
    s: Scenario, bodies: Sequence[str], turned: Callable[[tuple[float, ...]], np.ndarray], count: int, tick: float
) -> list[tuple[int, int, np.ndarray]]:
    """The run in spans in which the same forces act.

    Args:
        s: The scenario.
        bodies: Names of the bodies that can be pushed.
        turned: The force of a push (d,) in the ground's frame.
        count: Number of ticks.
        tick: [s].

    Returns:
        (first tick, last tick + 1, forces (len(bodies), d) [N]) of each span.

    Raises:
        InputError: A push names a body that is not there.
    """
    for i, p in enumerate(s.push):
        if p.body not in bodies:
            raise InputError(
                f"push[{i}].body: model '{s.model}' has no body '{p.body}'; {nearest(p.body, list(bodies))}"
            )
    size = len(turned((0.0, 0.0)))
    begin: dict[int, list[tuple[int, int, np.ndarray]]] = {}
    cuts = {0, count}
    for piece in pieces(s):
        first, last = round(piece.start / tick), round(piece.end / tick)
        cuts |= {min(first, count), min(last, count)}
        begin.setdefault(first, []).append((last, bodies.index(piece.body), turned(piece.force)))
    out, acting = [], []
    for first, last in pairwise(sorted(cuts)):
        acting = [one for one in acting if one[0] > first] + begin.get(first, [])
        total = np.zeros((len(bodies), size))
        for _, body, force in acting:
            total[body] += force
        out.append((first, last, total))
    return out
