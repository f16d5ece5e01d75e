"""How many of the constraints are independent: not where a stage happens to stand, but where the mechanism can be.

Rows may depend on each other only on Φ = 0 (an over-constrained loop: Bricard's six-bar, a parallelogram with a
bar too many); a hair off it they are independent, by as much as the state is off, and stand for forces that do
not exist. And they may depend on each other in one position alone (a singular one), where the rank of the
mechanism is that of its neighbours. Both are told apart by looking at states *on* the constraints: the start,
projected, and where it misses a rank a few neighbours, projected too.
"""

from typing import NamedTuple

import numpy as np

from biped.dynamics.linalg import SAFE_RATIO, apply_w, factor
from biped.dynamics.orthogonal import workspace
from biped.dynamics.sparse import Sparse, factor_sparse, solve_sparse
from biped.dynamics.system import ConstrainedSystem

BESIDE = (1e-2, 1e-3)
"""How far from the start its neighbours are, relative to the size of q."""

NEWTON = 40
"""Iterations of a projection; with the rank in doubt it converges linearly only."""

TIGHT, LOOSE = 1e-9, 1e-2
"""Relative singular values that never and always stand for a rank, however far the constraints are."""


class Place(NamedTuple):
    """Where on the constraints a start belongs, whose rows may depend on each other."""

    rank: int  # of the constraints there
    q: np.ndarray  # (n,)
    left: float  # what the constraints are off by where no motion brings them nearer, rows of length one


def structural_rank(
    system: ConstrainedSystem, t: float, q: np.ndarray, v: np.ndarray, K: Sparse | None = None
) -> tuple[int, Place | None]:
    """Rank of the constraints in the neighbourhood of a start that need not satisfy them.

    Returns:
        The rank, and the start on the constraints; None if its rows are plainly independent.
    """
    full = min(system.m, system.n)
    if full == 0 or _plainly_independent(system, t, q, v, K):
        return full, None
    here, rank, left = _on_constraints(system, t, q)
    place = Place(rank, here, left)
    rng = np.random.default_rng(0)
    size = max(np.abs(q).max(), 1.0)
    for beside in BESIDE:
        for direction in (v, rng.normal(size=system.n)):
            most = np.abs(direction).max()
            if rank < full and most > 0.0:
                away = _tangent(system, t, here, direction / most)
                rank = max(rank, _on_constraints(system, t, here + beside * size * away)[1])
    return rank, place


def _plainly_independent(system: ConstrainedSystem, t: float, q: np.ndarray, v: np.ndarray, K: Sparse | None) -> bool:
    """Whether the rows stand so far apart that no error of the start explains it."""
    if system.m > system.n:
        return False
    e = system.evaluate(t, q, v)
    off, none = np.zeros(system.n), np.zeros(0)
    if K is not None and K.use.size:
        ratio = factor_sparse(e.M, e.A, K)
        if ratio > SAFE_RATIO:
            solve_sparse(e.M, e.A, none, none, e.phi, ratio, K, none, off)
    else:
        w = workspace(system.n, system.m)
        ratio = float(w.ratio[0]) if factor(e.M, e.A, w) and w.rank[0] == system.m else 0.0
        if ratio > SAFE_RATIO:
            apply_w(e.phi, w, off)
    return bool(ratio > SAFE_RATIO and np.abs(off).max() < 0.1 * ratio * max(np.abs(q).max(), 1e-3))


def _spectrum(system: ConstrainedSystem, t: float, q: np.ndarray) -> tuple[np.ndarray, ...] | None:
    """Φ, and R and the singular value decomposition of A R⁻¹ with rows of length one; None if there is none."""
    e = system.evaluate(t, q, np.zeros(system.n))
    try:
        R = np.linalg.cholesky(e.M).T
        C = np.linalg.solve(R.T, e.A.T).T
        length = np.linalg.norm(C, axis=1)
        length[length <= TIGHT * length.max()] = np.inf
        U, s, V = np.linalg.svd(C / length[:, None], full_matrices=False)
    except np.linalg.LinAlgError:
        return None
    # A row of zeros has no length: what it is off by, it stays off by.
    return np.where(np.isinf(length), e.phi, e.phi / length), R, U, s, V


def _on_constraints(system: ConstrainedSystem, t: float, q: np.ndarray) -> tuple[np.ndarray, int, float]:
    """The state projected onto the constraints, their rank there, and what is left of Φ if it came to rest."""
    share, left = LOOSE, 0.0
    q, rank = q.copy(), min(system.m, system.n)
    for _ in range(NEWTON):
        found = _spectrum(system, t, q)
        if found is None or not np.isfinite(found[0]).all():
            return q, rank, 0.0
        phi, R, U, s, V = found
        # What the state is off the constraints by turns rows by about as much: no reason to call them independent.
        rank = int((s > share * max(s[0], 1e-300)).sum())
        x = np.linalg.solve(R, V[:rank].T @ ((U[:, :rank].T @ phi) / s[:rank]))
        q -= x
        moved = np.abs(x).max() / max(np.abs(q).max(), 1.0)
        if share == TIGHT and moved < TIGHT:
            left = float(np.abs(phi).max())
            break
        share = min(max(3.0 * moved, TIGHT), LOOSE)
    return q, rank, left


def _tangent(system: ConstrainedSystem, t: float, q: np.ndarray, direction: np.ndarray) -> np.ndarray:
    """The part of a motion of q that the constraints allow."""
    found = _spectrum(system, t, q)
    if found is None:
        return direction
    _, R, _, s, V = found
    allowed = V[: int((s > TIGHT * s[0]).sum())]
    return direction - np.linalg.solve(R, allowed.T @ (allowed @ (R @ direction)))
