"""An ensemble: what is drawn for each run, what is made of all, and runs whose random numbers are moved a little.

Everything random in a run follows from its seed. A `Normals` is such a seed, but every number that is drawn from it is
a function of a standard normal z: itself, or Φ(z) where a uniform one is asked for. A *move* mixes z with a fresh
normal w, z' = √(1 − β²) z + β w, which leaves standard normals standard normal and is small where β is (the
preconditioned Crank–Nicolson proposal: S. Cotter, G. Roberts, A. Stuart, D. White, Stat. Sci. 28:424, 2013). A move may
begin at a time: what a process drew before then stays to the last bit, and so does the run up to it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Annotated, Any, Literal

import numpy as np
from msgspec import Meta, field

from biped.base.typed import Count, NonNegative, Positive, Real, Section

Weights = Annotated[tuple[Real, ...], Meta(min_length=1, max_length=3)]
"""Of the directions of a process."""


class Shift(Section, frozen=True):
    """A shift along one direction of the normals of a process: c' = spread c + by for the number c along it.

    Attributes:
        pattern: Of each block of times from the move's `after` on, weights of the process's directions, such as
            forward and up; their squares, over all numbers that they weigh, should add up to 1.
        each: Times in a block.
        by: How far the normals are shifted along the pattern.
        spread: What their scatter along the pattern is multiplied by.
    """

    pattern: Annotated[tuple[Weights, ...], Meta(min_length=1, max_length=10_000)]
    each: Count = 1
    by: Real = 0.0
    spread: Positive = 1.0

    def __call__(self, z: np.ndarray, first: int) -> np.ndarray:
        """The normals z, one row for each time, after the shift.

        Args:
            z: (n,) or (n, directions).
            first: Row that the pattern begins with.
        """
        rows = z.reshape(len(z), -1).copy()
        weights = np.repeat(np.array(self.pattern), self.each, axis=0)[: len(z) - first, : rows.shape[1]]
        part = rows[first : first + len(weights), : weights.shape[1]]
        part += weights * ((self.spread - 1.0) * np.sum(weights * part) + self.by)
        return rows.reshape(z.shape)


class Move(Section, frozen=True):
    """A move in the space of a run's standard normals: z' = keep z + beta w, with fresh normals w.

    Attributes:
        seed: Of the fresh normals.
        beta: Their weight; of 1, nothing of those before is left.
        keep: What is left of those before, or by what they are multiplied; default: √(1 − beta²).
        after: [s] from which it moves the numbers that processes draw for a time; other numbers move only where it
            is 0.
        before: [s] up to which it does; default: the end.
        shift: Of the numbers that processes draw for a time, from `after` on; default: none.
    """

    seed: Annotated[int, Meta(ge=0, le=2**63 - 1)] = 0
    beta: Annotated[float, Meta(ge=0, le=1)] = 1.0
    keep: Annotated[float, Meta(ge=0, le=10)] | None = None
    after: NonNegative = 0.0
    before: NonNegative | None = None
    shift: Shift | None = None

    def __call__(self, z: Any, w: Any, times: np.ndarray | None) -> Any:
        """The normals z after the move.

        Args:
            z: Normals of any shape.
            w: Fresh ones.
            times: (n,) [s] of the rows of z; default: of no time.
        """
        keep = math.sqrt(1.0 - self.beta * self.beta) if self.keep is None else self.keep
        new = keep * z + self.beta * w
        if times is None:
            return new if self.after == 0.0 else z
        moves = times >= self.after
        if self.before is not None:
            moves &= times < self.before
        moved = np.where(moves.reshape(-1, *[1] * (np.ndim(z) - 1)), new, z)
        return moved if self.shift is None else self.shift(moved, int(np.searchsorted(times, self.after)))


class Normals(int):
    """A seed whose streams are those of an ordinary one, mapped from standard normals and moved.

    Args:
        seed: The seed that the moves begin with.
        moves: In the order in which they were made.

    Attributes:
        moves: As given.
        squares: Sum of the squares of all normals that were drawn from it since it was made: twice the logarithm of how
            much likelier the likeliest run is.
    """

    moves: tuple[Move, ...]
    squares: float

    def __new__(cls, seed: int, moves: Sequence[Move] = ()) -> Normals:
        """A whole number, as every seed is, which carries its moves along."""
        out = super().__new__(cls, seed)
        out.moves = tuple(moves)
        out.squares = 0.0
        return out

    def __reduce__(self) -> tuple[Any, ...]:
        return Normals, (int(self), self.moves)

    def moved(self, move: Move) -> Normals:
        """The seed after one more move."""
        return Normals(int(self), (*self.moves, move))

    def stream(self, key: int) -> NormalStream:
        """The random numbers of one purpose.

        Args:
            key: Number of the purpose (`biped.scenario.vary.stream`).
        """
        return NormalStream(self, key)


class NormalStream:
    """Random numbers mapped from standard normals: those methods of `numpy.random.Generator` that runs use.

    Args:
        seed: Of the run.
        key: Number of the purpose.
    """

    def __init__(self, seed: Normals, key: int):
        self._seed = seed
        self._first = np.random.default_rng([int(seed), key])
        self._moves = [(np.random.default_rng([move.seed, key]), move) for move in seed.moves]

    def standard_normal(self, size: Any = None, times: np.ndarray | None = None) -> Any:
        """Standard normals.

        Args:
            size: Shape; default: one number.
            times: (n,) [s] from which each row of the numbers acts, of a process in time; default: of none.
        """
        z = self._first.standard_normal(size)
        for rng, move in self._moves:
            z = move(z, rng.standard_normal(size), times)
        self._seed.squares += float(np.sum(np.square(z)))
        return z

    def normal(self, mean: float, deviation: float, size: Any = None) -> Any:
        """Normal numbers."""
        return mean + deviation * self.standard_normal(size)

    def uniform(self, low: float, high: float, size: Any = None) -> Any:
        """Uniform numbers between two bounds."""
        from scipy.special import ndtr

        return low + (high - low) * ndtr(self.standard_normal(size))

    def integers(self, high: int) -> int:
        """A whole number from 0 to less than a bound."""
        return min(int(self.uniform(0.0, float(high))), high - 1)


class Distribution(Section, frozen=True):
    """Where a number is drawn from: exactly one of these.

    A key that holds several numbers gets each drawn by itself.

    Attributes:
        normal: Mean and standard deviation.
        uniform: Lower and upper bound.
        choice: Values, each as likely.
        grid: Values that runs take in turn.
    """

    normal: tuple[Real, NonNegative] | None = None
    uniform: tuple[Real, Real] | None = None
    choice: tuple[bool | float | str, ...] | None = None
    grid: tuple[bool | float | str, ...] | None = None


class Randomise(Section, frozen=True):
    """An ensemble.

    Attributes:
        runs: Number of runs (at each point of a sweep), each with its own seed.
        controller_mass_matrix: Relative standard deviation, elementwise, of the controller's M. In space, of the mass
            of each body, with its moments of inertia, from which the controller's M follows.
        controller_constraints: The same of its A. In space, of the three numbers that place each body in its parent,
            from which M and the Jacobians follow.
        controller_errors: Whether these two are drawn once for a `run`, or anew at every `tick`.
        masses: Share by which the mass of each body may differ from the file's, either way: a factor of it is drawn for
            every run and body, and moments of inertia follow; of a robot of any kind.
        draw: Dotted scenario key, e.g. "ground.friction" or "push.0.at", to its distribution.
        moves: How the normals that runs draw are moved, as `biped find` writes it for a run that fell; default: not at
            all.
    """

    runs: Count = 1
    controller_mass_matrix: Annotated[float, Meta(ge=0, le=1000)] = 0.0
    controller_constraints: Annotated[float, Meta(ge=0, le=1000)] = 0.0
    controller_errors: Literal["run", "tick"] = "run"
    masses: Annotated[float, Meta(ge=0, lt=1)] = 0.0
    draw: dict[str, Distribution] = field(default_factory=dict)
    moves: Annotated[tuple[Move, ...], Meta(max_length=10_000)] | None = None


class FailureKeys(Section, frozen=True):
    """Recording of the last seconds of runs that fell or are doubtful.

    Attributes:
        keep: Most runs kept at each point of a sweep, where a campaign is large (above 10,000 runs), in shards or on a
            cluster; of others all are.
    """

    keep: Annotated[int, Meta(ge=0, le=1_000_000)] = 3


class Threshold(Section, frozen=True):
    """When a sweep's threshold holds.

    Attributes:
        rate: Fraction of the runs that must have walked at every value up to it; or stood or sat, if that is expected.
    """

    rate: Annotated[float, Meta(gt=0, le=1)] = 0.95
