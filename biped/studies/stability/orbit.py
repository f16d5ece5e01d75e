"""A gait under small disturbances: a fixed point or cycle of its return map, and its largest Lyapunov exponent.

A return map that is repeated from a walk either comes back to the same n states, whose multipliers then say how small
disturbances shrink, or it does not; its largest Lyapunov exponent (Benettin's method: a neighbour that is pulled back
to a fixed distance after every return) says whether neighbours approach or part.
"""

import math
from typing import NamedTuple

import numpy as np

from biped.base.errors import RunError
from biped.base.statistics import Z95
from biped.measure.trajectory import Trajectory
from biped.robot.run import Run
from biped.scenario.vary import stream
from biped.studies.stability.cycle import Cycle, Map, find_cycle
from biped.studies.stability.section import Kicks, Mapped, PoincareSection, Steady, crossings

RETURNS = 80
"""How often the map is repeated in search of a cycle."""

LONGEST = 16
"""Returns of the longest cycle that is recognised."""

CLOSED = 1e-4
"""Distance at which a state counts as the one n returns before, natural units."""

SPECTRUM = 2
"""Returns of the longest cycle whose multipliers are computed: each costs hundreds of strides."""

DIFFERENCE = 1e-6
"""Central differences of the return map."""

FIXED = 1e-9
"""Largest change in a cycle that counts as none."""

NEIGHBOUR = 1e-8
"""Distance of neighbours in Benettin's method."""

FULL = 1e-3
"""Neighbours that part by this much in one return have left the small: the exponent is then a lower bound."""

CHAINS, ALIGNED, MEASURED = 6, 4, 10
"""Chains of returns; how many returns turn the neighbour into the direction that grows most; how many are measured."""


class Orbit(NamedTuple):
    """Where the repeated return map goes.

    Attributes:
        returns: Returns of the cycle; None: none up to `LONGEST` was reached.
        moved: Distance of the last state from the nearest of the `LONGEST` before it.
        state: (17,) the last state, on the cycle.
        cycle: Fixed point of so many returns and its multipliers, if they were computed.
    """

    returns: int | None
    moved: float
    state: np.ndarray
    cycle: Cycle | None


class Exponent(NamedTuple):
    """Largest Lyapunov exponent per return.

    Attributes:
        value: Mean growth of ln(distance) in a return.
        half_width: Of its 95 % interval, from independent chains.
        bound: Whether neighbours parted too far within a return: the exponent is at least the value.
        lost: Chains that ended in a fall.
    """

    value: float
    half_width: float
    bound: bool
    lost: int


def find_orbit(section: PoincareSection, z: np.ndarray, stride: float) -> Orbit:
    """Repeats the return map from a state and looks for a cycle.

    Args:
        section: The section.
        z: (17,) where to begin.
        stride: [s] about as long as a stride takes.

    Raises:
        RunError: The walker falls on the way.
    """
    states = [z]
    for _ in range(RETURNS):
        states.append(section.returned(states[-1], stride))
    recent = np.array(states[-1 - LONGEST :])
    distance = np.linalg.norm(recent[:-1] - recent[-1], axis=1)[::-1]
    moved = float(distance.min())
    closed = np.flatnonzero(distance < CLOSED)
    if not closed.size:
        return Orbit(None, moved, states[-1], None)
    n = int(closed[0]) + 1
    return Orbit(n, moved, states[-1], _cycle(section, states[-1], n, stride) if n <= SPECTRUM else None)


def _cycle(section: PoincareSection, z: np.ndarray, n: int, stride: float) -> Cycle | None:
    """Fixed point of n returns by Newton's method.

    Compliant contacts give way: a foot that is pressed in is part of the state, and leaving it out moves the third
    digit of the multipliers. Rigid ones do not: there a state has only the directions that a disturbance can have.
    """
    rigid = section.run.scenario.engine == "home"
    basis = Kicks(section, z).basis if rigid else np.eye(z.size)

    def returns(x: np.ndarray) -> np.ndarray:
        at = z + basis @ x
        for _ in range(n):
            at = section.returned(at, stride)
        return (at - z) @ basis

    try:
        return find_cycle(returns, np.zeros(basis.shape[1]), DIFFERENCE, FIXED)
    except (RunError, np.linalg.LinAlgError):
        return None  # jumps closer to the cycle than the differences: it has no multipliers that could be told


def growth(P: Map, z: np.ndarray, neighbour: np.ndarray, count: int) -> np.ndarray:
    """Growth (count,) of ln(distance) in each return between a state's returns and a neighbour's.

    The neighbour is pulled back along the line to its first distance after each return.
    """
    distance = float(np.linalg.norm(neighbour - z))
    out = []
    for _ in range(count):
        z, beside = P(z), P(neighbour)
        apart = float(np.linalg.norm(beside - z))
        # Neighbours that meet exactly have approached by all that numbers can tell.
        out.append(math.log(max(apart, 1e-16) / distance))
        neighbour = z + (beside - z) * (distance / apart) if apart > 0.0 else z + distance / math.sqrt(z.size)
    return np.array(out)


def exponent(gait: Steady, rng: np.random.Generator, mapped: Mapped) -> Exponent | None:
    """Largest Lyapunov exponent of the return map, from steady states; None if every chain fell.

    Args:
        gait: Its strides.
        rng: Where chains begin, and in which direction the neighbour is.
        mapped: Carries chains out.
    """
    starts, steady = [], gait.states
    for i in rng.integers(len(steady), size=CHAINS):
        kicks = Kicks(gait.section, steady[i])
        starts.append((steady[i], kicks.along(rng.standard_normal(kicks.basis.shape[1]), NEIGHBOUR)))

    def chain(start: tuple[np.ndarray, np.ndarray]) -> np.ndarray | None:
        try:
            return growth(lambda z: gait.section.returned(z, gait.stride), *start, ALIGNED + MEASURED)[ALIGNED:]
        except RunError:
            return None

    chains = [one for one in mapped(chain, starts) if one is not None]
    if len(chains) < 2:
        return None
    means = np.array([one.mean() for one in chains])
    bound = bool(np.median(np.concatenate(chains)) > math.log(FULL / NEIGHBOUR))
    half = float(Z95 * means.std(ddof=1) / math.sqrt(len(means)))
    return Exponent(float(means.mean()), half, bound, CHAINS - len(chains))


SHORT = 2, 3
"""The same of one short chain: returns that turn the neighbour, and those that are measured."""


def parting(run: Run, walk: Trajectory) -> float:
    """Mean growth of ln(distance) in a return of the stride, between a walk and its neighbour: one short chain.

    It begins at the last return of the run.

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
        grown = growth(lambda state: section.returned(state, stride), z, beside, sum(SHORT))
    except RunError:
        return math.inf
    return float(grown[SHORT[0] :].mean())
