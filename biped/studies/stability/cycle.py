"""Fixed points of a return map and the multipliers of its linearisation, each with an error estimate.

A periodic motion is a fixed point z* = P(z*) of the map P from one crossing of a section to the next. A small
disturbance becomes J = ∂P/∂z times itself with every return; the eigenvalues of J are the Floquet multipliers, and the
motion is stable if all lie inside the unit circle.

A walker that is sampled, rattles on its heels and switches its gains has a return map with a jump wherever a switch
moves to the next control tick. Its derivative at a point says nothing about disturbances larger than the distance to
the next jump; how disturbances of a given size shrink on average does: a linear fit over an ensemble says it, with
bootstrap intervals.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from biped.base.errors import RunError

Map = Callable[[np.ndarray], np.ndarray]
"""A return map: section state (n,) to section state (n,) at the next crossing."""

_MOST_STEPS = 30


class Cycle(NamedTuple):
    """A periodic motion.

    Attributes:
        state: (n,) fixed point.
        residual: Largest |P(z) - z| there.
        jacobian: (n, n) ∂P/∂z there.
        multipliers: (n,) complex, the largest magnitude first.
        error: (n,) how far each may be off: what halving the difference changed.
    """

    state: np.ndarray
    residual: float
    jacobian: np.ndarray
    multipliers: np.ndarray
    error: np.ndarray

    @property
    def stable(self) -> bool:
        """Whether disturbances die out, the error estimate included."""
        return bool((np.abs(self.multipliers) + self.error < 1.0).all())


def jacobian(P: Map, z: np.ndarray, step: float) -> np.ndarray:
    """∂P/∂z (n, n) by central differences of size `step`; its error is of order step²."""
    columns = []
    for i in range(z.size):
        e = np.zeros(z.size)
        e[i] = step
        columns.append((P(z + e) - P(z - e)) / (2.0 * step))
    return np.column_stack(columns)


def extrapolated(P: Map, z: np.ndarray, step: float) -> tuple[np.ndarray, np.ndarray]:
    """∂P/∂z (n, n) with the step² error removed (Richardson), and without, at step / 2."""
    coarse, fine = jacobian(P, z, step), jacobian(P, z, 0.5 * step)
    return fine + (fine - coarse) / 3.0, fine


def sorted_multipliers(matrix: np.ndarray) -> np.ndarray:
    """Eigenvalues (n,), the largest magnitude first; of a conjugate pair the upper one."""
    values: np.ndarray[Any, np.dtype[np.complex128]] = np.linalg.eigvals(matrix).astype(complex)
    return values[np.lexsort((-values.imag, -np.round(np.abs(values), 12)))]


def matched(values: np.ndarray, others: np.ndarray) -> np.ndarray:
    """`others` in the order in which each is nearest to its partner in `values`, the largest choosing first."""
    left = list(others)
    out = []
    for value in values:
        nearest = int(np.argmin([abs(value - other) for other in left]))
        out.append(left.pop(nearest))
    return np.array(out)


def find_cycle(P: Map, guess: np.ndarray, step: float = 1e-4, tolerance: float = 1e-11) -> Cycle:
    """The fixed point near a guess by Newton's method, and its multipliers.

    Args:
        P: Return map, smooth near the fixed point.
        guess: (n,) where to begin.
        step: Size of the central differences; twice and once half of it give the error estimate.
        tolerance: Largest |P(z) - z| that counts as fixed.

    Raises:
        RunError: Newton's method does not settle.
    """
    z = np.array(guess, dtype=float)
    residual = P(z) - z
    for _ in range(_MOST_STEPS):
        if np.abs(residual).max() < tolerance:
            break
        z = z - np.linalg.solve(jacobian(P, z, step) - np.eye(z.size), residual)
        residual = P(z) - z
    else:
        raise RunError(
            f"no fixed point within {_MOST_STEPS} Newton steps of {np.asarray(guess).tolist()}: the state still moves "
            f"by {np.abs(residual).max():.1e} in a return"
        )
    J, fine = extrapolated(P, z, step)
    values = sorted_multipliers(J)
    return Cycle(z, float(np.abs(residual).max()), J, values, np.abs(values - matched(values, np.linalg.eigvals(fine))))


def pairs(values: np.ndarray) -> list[list[float]]:
    """Complex numbers as [real, imaginary]."""
    return [[float(np.real(value)), float(np.imag(value))] for value in values]


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
