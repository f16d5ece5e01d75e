"""What both engines do the same way: cut a run where pushes begin and end, and say how it ended."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from biped.control.tick import GOING, LOW, TILTED
from biped.errors import InputError
from biped.files import nearest
from biped.geometry import JOINTS
from biped.scenario import Scenario
from biped.trajectory import Q


def push_spans(s: Scenario, bodies: Sequence[str], count: int, tick: float) -> list[tuple[int, int, np.ndarray]]:
    """The run cut where pushes begin and end.

    Args:
        s: The scenario.
        bodies: Names of the bodies that can be pushed.
        count: Number of ticks.
        tick: [s].

    Returns:
        (first tick, last tick + 1, forces (len(bodies), 2) [N] along and normal to the slope) of each span.

    Raises:
        InputError: A push names a body that is not there.
    """
    spans = [(round(p.at / tick), round((p.at + p.duration) / tick)) for p in s.push]
    cuts = sorted({0, count, *(min(t, count) for span in spans for t in span)})
    angle = np.radians(s.ground.slope)
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    forces = []
    for i, p in enumerate(s.push):
        if p.body not in bodies:
            raise InputError(f"push[{i}].body: model '{s.model}' has no body '{p.body}'; {nearest(p.body, bodies)}")
        force = np.zeros((len(bodies), 2))
        force[bodies.index(p.body)] = turn @ np.array(p.force)
        forces.append(force)
    out = []
    for first, last in zip(cuts[:-1], cuts[1:], strict=True):
        total = np.zeros((len(bodies), 2))
        for (start, stop), force in zip(spans, forces, strict=True):
            if start <= first < stop:
                total += force
        out.append((first, last, total))
    return out


def ending(status: int, log: np.ndarray) -> tuple[str, str]:
    """How a run ended (`completed`, `fell` or `diverged`), and in words why.

    Args:
        status: The last tick's.
        log: The rows that were written.
    """
    if status == GOING:
        return "completed", ""
    time = log[-1, 0] if len(log) > 1 else 0.0
    if status in (LOW, TILTED):
        way = "collapsed" if status == LOW else ("fell forward" if log[-1, Q + 2] < 0.0 else "fell backward")
        return "fell", f"{way} at {time:.3f} s"
    before = log[-2, Q : Q + 9] if len(log) > 1 else log[0, Q : Q + 9]
    worst = JOINTS[int(np.argmax(np.abs(before)))]
    return (
        "diverged",
        f"a coordinate stopped being finite after {log[max(len(log) - 2, 0), 0]:.3f} s (largest: {worst})",
    )
