"""The arrays a march works in and the ones it leaves behind: made once, so that it allocates nothing."""

from typing import Any, NamedTuple

import numpy as np

from biped.base.jit import kernel
from biped.dynamics.collocation import NODES, table
from biped.dynamics.orthogonal import Workspace, copy, workspace
from biped.dynamics.reference import by_reference
from biped.dynamics.sparse import Sparse, dense

KEPT, TAKEN = range(2)
"""Names of the counters of `Samples.count`."""


class Functions(NamedTuple):
    """The system's functions, in the order of `system.SIGNATURES`."""

    mass: Any
    force: Any
    phi: Any
    A: Any
    b_q: Any
    b_v: Any
    potential: Any
    power: Any
    event: Any


class Grid(NamedTuple):
    """Where samples are asked for."""

    t: float  # [s] start
    dt: float  # [s] step, or the longest one when adaptive
    steps: int
    every: int  # a sample is kept every so many steps


@by_reference
class Samples(NamedTuple):
    """Samples along the way, K = steps/every + 1 of them."""

    t: np.ndarray  # (K,) [s]
    q: np.ndarray  # (K, n)
    v: np.ndarray  # (K, n)
    phi: np.ndarray  # (K,) largest |Φ| since the sample before
    phi_dot: np.ndarray  # (K,) largest |Φ̇| since the sample before
    ratio: np.ndarray  # (K,) smallest pivot ratio of any stage since the sample before
    rank: np.ndarray  # (K,) smallest rank of the constraints at any stage since the sample before
    work: np.ndarray  # (K, k) [J] work of every force that is accounted for
    count: np.ndarray  # pyright: ignore[reportIncompatibleMethodOverride] # (2,) samples kept, steps taken


Q, ACCELERATION, MOVE, PLACE, SPEED, FIX_Q, FIX_V, LAST_Q, LAST_V = range(9)
"""Rows of `Room.c`: Q, M⁻¹Q, W times something, q and v of a stage, −WΦ and −WΦ̇ of the step's start, and where a step
ended that is being improved."""

PHI, B_Q, B_V, LAG, AIM = range(5)
"""Rows of `Room.r`: Φ, b_q, b_v (then what C⁺ is applied to), b_q − A v = −Φ̇, and scratch, of a stage."""

RATIO, RANK, EVALUATED, SPLIT, REFUSED, FIRED, LEAPT = range(7)
"""Places of `Room.seen`: smallest pivot ratio and rank since the last sample, counts, the event that happened."""


@by_reference
class Room(NamedTuple):
    """Everything the march writes on its way."""

    M: np.ndarray  # (n, n)
    A: np.ndarray  # (m, n)
    c: np.ndarray  # (9, n) vectors of coordinates
    r: np.ndarray  # (5, m) vectors of rows
    away: np.ndarray  # (s, n) what the nodes of a leap have been moved by, onto the constraints
    rate: np.ndarray  # (2, s, n) q̇ and v̇ of the stages
    weights: np.ndarray  # (3, s) of the rates in the step taken, and in two estimates of its error
    power: np.ndarray  # (s + 1, k) [W] of every force that is accounted for, at the stages; last: their work [J]
    event: np.ndarray  # (3, e) event functions at the start of a step, at its end, at a trial
    seen: np.ndarray  # (7,)
    gauss: np.ndarray  # what a leap needs, see `collocation.table`
    factors: Workspace
    sparse: Sparse


def room(n: int, m: int, stages: int, powers: int = 0, events: int = 0, K: Sparse | None = None) -> Room:
    """Room for a system of n coordinates and m constraints under a scheme of so many stages."""
    shapes = [(n, n), (m, n), (9, n), (5, m), (NODES, n)]
    shapes += [(2, stages, n), (3, stages), (stages + 1, powers), (3, events)]
    arrays = [np.zeros(shape) for shape in shapes]
    return Room._make(
        [*arrays, np.array([1.0, m, 0, 0, 0, 0, 0]), table(), workspace(n, m), dense() if K is None else K]
    )


def samples(count: int, n: int, powers: int) -> Samples:
    """Room for so many samples."""
    flat = [np.zeros(count) for _ in range(4)]
    ranks, counts = np.zeros(count, np.int64), np.zeros(2, np.int64)
    states = np.zeros((2, count, n))
    return Samples._make([flat[0], *(x.copy() for x in states), *flat[1:], ranks, np.zeros((count, powers)), counts])


@kernel
def largest(x):
    """Largest magnitude in x; nan if there is a nan."""
    s = 0.0
    for i in range(x.shape[0]):
        if np.isnan(x[i]):
            return np.nan
        s = max(s, abs(x[i]))
    return s


@kernel
def keep(arrived, t, q, v, room, out):
    """Note how well the state satisfies the constraints; keep it as a sample if it has arrived at one."""
    i, seen, power = out.count[KEPT], room.seen, room.power
    out.phi[i] = max(out.phi[i], largest(room.r[PHI]))
    out.phi_dot[i] = max(out.phi_dot[i], largest(room.r[LAG]))
    if arrived:
        out.t[i] = t
        copy(q, out.q[i])
        copy(v, out.v[i])
        copy(power[power.shape[0] - 1], out.work[i])
        out.ratio[i], out.rank[i] = seen[RATIO], int(seen[RANK])
        seen[RATIO], seen[RANK] = 1.0, room.r.shape[1]
        out.count[KEPT] += 1
