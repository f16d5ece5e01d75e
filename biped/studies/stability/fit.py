"""Multipliers of a return map that scatters: a linear fit over an ensemble, with bootstrap intervals.

A walker that is sampled, rattles on its heels and switches its gains has a return map with a jump wherever a switch
moves to the next control tick. Its derivative at a point says nothing about disturbances larger than the distance to
the next jump; how disturbances of a given size shrink on average does.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from biped.studies.stability.cycle import sorted_multipliers

EXPLAINED = 0.99
"""Share of the ensemble's variance that the fitted directions hold."""

_RESAMPLED = 300


class Returns(NamedTuple):
    """Pairs of successive section states.

    Attributes:
        before: (m, n) section states.
        after: (m, n) the states one return later.
        walk: (m,) which walk a pair is from; pairs of one walk are not independent.
    """

    before: np.ndarray
    after: np.ndarray
    walk: np.ndarray


class Fit(NamedTuple):
    """A linear return map in the r directions in which the ensemble is spread.

    Attributes:
        mean: (n,) centre of the states.
        basis: (r, n) orthonormal directions.
        matrix: (r, r) of the linear map.
        multipliers: (r,) complex, the largest magnitude first.
        interval: 95 % bootstrap interval of the largest magnitude.
        explained: Share of the variance of the states after a return that the map predicts.
    """

    mean: np.ndarray
    basis: np.ndarray
    matrix: np.ndarray
    multipliers: np.ndarray
    interval: tuple[float, float]
    explained: float

    @property
    def radius(self) -> float:
        """The largest magnitude of a multiplier."""
        return float(np.abs(self.multipliers[0]))


def _map(x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Least-squares matrix (r, r) and prediction of y (m, r) = matrix x + constant."""
    rows = np.column_stack([x, np.ones(len(x))])
    solution = np.linalg.lstsq(rows, y, rcond=None)[0]
    return solution[:-1].T, rows @ solution


def fit_map(returns: Returns, rng: np.random.Generator) -> Fit:
    """Fits a linear map to pairs of section states.

    Whole walks are resampled for the interval, with the directions kept.
    """
    mean = returns.before.mean(axis=0)
    _, s, directions = np.linalg.svd(returns.before - mean, full_matrices=False)
    share = np.cumsum(s**2) / np.sum(s**2)
    basis = directions[: int(np.searchsorted(share, EXPLAINED)) + 1]
    x, y = (returns.before - mean) @ basis.T, (returns.after - mean) @ basis.T
    matrix, predicted = _map(x, y)
    explained = 1.0 - float(((y - predicted) ** 2).sum() / ((y - y.mean(axis=0)) ** 2).sum())
    walks = np.unique(returns.walk)
    members = [np.flatnonzero(returns.walk == walk) for walk in walks]
    radii = []
    for _ in range(_RESAMPLED):
        rows = np.concatenate([members[i] for i in rng.integers(len(walks), size=len(walks))])
        radii.append(np.abs(np.linalg.eigvals(_map(x[rows], y[rows])[0])).max())
    low, high = np.percentile(radii, [2.5, 97.5])
    return Fit(mean, basis, matrix, sorted_multipliers(matrix), (float(low), float(high)), explained)
