"""Runs whose random numbers are moved a little: a seed whose streams are mixtures of standard normals.

Everything random in a run follows from its seed. A `Normals` is such a seed, but every number that is drawn from it is
a function of a standard normal z: itself, or Φ(z) where a uniform one is asked for. A *move* mixes z with a fresh
normal w, z' = √(1 − β²) z + β w, which leaves standard normals standard normal and is small where β is (the
preconditioned Crank–Nicolson proposal: S. Cotter, G. Roberts, A. Stuart, D. White, Stat. Sci. 28:424, 2013). A move may
begin at a time: what a process drew before then stays to the last bit, and so does the run up to it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np


class Move(NamedTuple):
    """A move in the space of a run's standard normals.

    Attributes:
        seed: Of the fresh normals.
        beta: Their weight, 0 … 1; of 1, nothing of those before is left.
        after: [s] from which it moves the numbers that processes draw for a time; other numbers move only where it
            is 0.
    """

    seed: int
    beta: float
    after: float = 0.0


class Normals(int):
    """A seed whose streams are those of an ordinary one, mapped from standard normals and moved.

    Args:
        seed: The seed that the moves begin with.
        moves: In the order in which they were made.
    """

    moves: tuple[Move, ...]

    def __new__(cls, seed: int, moves: Sequence[Move] = ()) -> Normals:
        """A whole number, as every seed is, which carries its moves along."""
        out = super().__new__(cls, seed)
        out.moves = tuple(moves)
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
            w = rng.standard_normal(size)
            new = math.sqrt(1.0 - move.beta * move.beta) * z + move.beta * w
            if times is not None:
                late = times >= move.after
                z = np.where(late.reshape(-1, *[1] * (np.ndim(z) - 1)), new, z)
            elif move.after == 0.0:
                z = new
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
