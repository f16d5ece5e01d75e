"""Which entries of M and A are ever filled, and the order of elimination that keeps it cheap."""

from functools import lru_cache
from heapq import heapify, heappop, heappush

import numpy as np

from biped.dynamics.sparse import Sparse, dense
from biped.dynamics.system import ConstrainedSystem

LEAST_SIZE = 40
"""Coordinates and constraints below which full matrices are as fast."""

LEAST_GAIN = 4.0
"""How many times fewer operations make up for the indirection."""

WRITTEN = ("values", "x", "size", "use")
"""Arrays that a run writes to."""


def find(system: ConstrainedSystem, t: float, q: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Entries of M (n, n) and of A (m, n) that are not zero at the start or in one of three states beside it.

    The states are drawn with a fixed seed; an entry that is filled only later is noticed on the way.
    """
    rng = np.random.default_rng(0)
    M, A = np.zeros((system.n, system.n), bool), np.zeros((system.m, system.n), bool)
    for spread in (0.0, 1.0, 1.0, 1.0):
        beside = q + spread * rng.normal(size=system.n), v + spread * rng.normal(size=system.n)
        e = system.evaluate(t + spread * rng.random(), *beside)
        M |= e.M != 0.0
        A |= e.A != 0.0
    return M | M.T | np.eye(system.n, dtype=bool), A


def plan(M: np.ndarray, A: np.ndarray) -> Sparse:
    """The order of elimination and everything that follows from it; `dense()` where it would not pay.

    Args:
        M: (n, n) where M may be filled.
        A: (m, n) where A may be filled.
    """
    found = _planned(M.tobytes(), A.tobytes(), A.shape)
    return dense() if found is None else found._replace(**{name: getattr(found, name).copy() for name in WRITTEN})


@lru_cache(maxsize=32)
def _planned(M_filled: bytes, A_filled: bytes, shape: tuple[int, int]) -> Sparse | None:
    m, n = shape
    M = np.frombuffer(M_filled, bool).reshape(n, n)
    A = np.frombuffer(A_filled, bool).reshape(m, n)
    full = n**3 / 3 + m * n * (n + m) + m**3 / 3
    if n + m < LEAST_SIZE or LEAST_GAIN * (M.sum() ** 2 / n + A.sum() ** 2 / max(m, 1)) > full:
        return None
    order, columns = _eliminate(M, A, full)
    return _lay_out(M, A, order, columns) if order else None


def _eliminate(M: np.ndarray, A: np.ndarray, full: float) -> tuple[list[int], list[list[int]]]:
    """Nodes in order of elimination (least degree first, a constraint after its coordinates), neighbours left.

    Nothing if it would cost more than full matrices do.
    """
    m, n = A.shape
    near = [{int(j) for j in np.flatnonzero(M[i])} - {i} for i in range(n)] + [set() for _ in range(m)]
    waits = [0] * (n + m)
    for i, j in zip(*np.nonzero(A), strict=True):
        near[j].add(n + int(i))
        near[n + int(i)].add(int(j))
        waits[n + int(i)] += 1
    needed_by = [[n + int(i) for i in np.flatnonzero(A[:, j])] for j in range(n)]
    ready = set(range(n)) | {n + i for i in range(m) if waits[n + i] == 0}
    order, columns, work = [], [], 0.0
    queue = [(len(near[x]), x) for x in ready]
    heapify(queue)
    while queue:
        degree, node = heappop(queue)
        if node not in ready or degree != len(near[node]):
            continue  # it has been eliminated, or stands elsewhere in the queue since its neighbours have changed
        ready.remove(node)
        left = near[node]
        work += (len(left) + 1.0) ** 2
        if LEAST_GAIN * work > full:
            return [], []
        for other in left:
            near[other] |= left
            near[other] -= {node, other}
            if other in ready:
                heappush(queue, (len(near[other]), other))
        if node < n:
            for row in needed_by[node]:
                waits[row] -= 1
                if waits[row] == 0:
                    ready.add(row)
                    heappush(queue, (len(near[row]), row))
        order.append(node)
        columns.append([int(x) for x in left])
    return order, columns


def _lay_out(M: np.ndarray, A: np.ndarray, order: list[int], columns: list[list[int]]) -> Sparse:
    m, n = A.shape
    N = n + m
    place = np.zeros(N, np.int64)
    place[order] = np.arange(N)
    rows = [np.sort(place[column]) if column else np.zeros(0, np.int64) for column in columns]
    start = np.concatenate(([0], np.cumsum([len(r) for r in rows])))
    count = N + int(start[-1])
    at = {(int(i), k): N + int(start[k]) + a for k, r in enumerate(rows) for a, i in enumerate(r)}
    at |= {(k, k): k for k in range(N)}
    target = [at[int(r[a]), int(r[b])] for r in rows for a in range(len(r)) for b in range(a)]

    def goes(i: int, j: int) -> int:
        return at[max(place[i], place[j]), min(place[i], place[j])]

    def entries(filled: np.ndarray, first: int) -> np.ndarray:
        """Places of entries and where they go; those above M's diagonal behind all others."""
        kept = np.argwhere(filled)
        to = [goes(first + i, j) if first or i >= j else count for i, j in kept]
        return np.ascontiguousarray(np.column_stack((kept, np.array(to, np.int64).reshape(-1))).astype(np.uint64))

    return Sparse(
        M=entries(M, 0),
        A=entries(A, n),
        place=place.astype(np.uint64),
        start=start,
        row=np.concatenate(rows).astype(np.uint64),
        target=np.array(target, np.uint64),
        values=np.zeros(count + 1),
        x=np.zeros((2, N, 2)),
        size=np.zeros(N),
        use=np.where(np.arange(N) < n, 1.0, -1.0),
    )
