"""How fast neighbours of a walk part: one short chain of what `biped stability` measures with many long ones."""

from __future__ import annotations

import math

from biped.base.errors import RunError
from biped.measure.trajectory import Trajectory
from biped.robot.run import Run
from biped.scenario.vary import stream
from biped.studies.stability.kicks import Kicks
from biped.studies.stability.orbit import NEIGHBOUR, growth
from biped.studies.stability.section import PoincareSection, crossings

ALIGNED, MEASURED = 2, 3
"""Returns that turn the neighbour into the direction that grows most; those that are measured."""


def parting(run: Run, walk: Trajectory) -> float:
    """Mean growth of ln(distance) in a return of the stride, between a walk and its neighbour.

    The chain (`biped.studies.stability.orbit.growth`) begins at the last return of the run.

    Args:
        run: A run of a planar biped of seven links that walks.
        walk: What became of it.

    Returns:
        The growth; infinite if the walker does not return often enough.
    """
    section = PoincareSection(run, run.true_tree)
    seen = crossings(walk, section.height)
    if len(seen.time) < 2:
        return math.inf
    z, stride = section.states(seen)[-1], float(seen.time[-1] - seen.time[-2])
    try:
        kicks = Kicks(section, z)
        beside = kicks.along(stream(run.seed, "tune.neighbour").standard_normal(kicks.basis.shape[1]), NEIGHBOUR)
        grown = growth(lambda state: section.returned(state, stride), z, beside, ALIGNED + MEASURED)
    except RunError:
        return math.inf
    return float(grown[ALIGNED:].mean())
