"""Disturbances from what cannot be seen to what fells the walker: their growth by size, and a slice through the basin.

A gait may amplify the invisible and still forget what can be seen. Pairs of walks, one of them kicked, are compared
after one and after three returns; where the distance is what it was, kicks neither grow nor shrink. Below that size the
gait's own irregularity rules, above it disturbances die out, until the walker falls.

Every point of the slice is a change of lean and speed that several states of the steady gait are given; it ends in one
of three things: a fall, a walk that is not the gait's, the gait.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from biped.base.errors import RunError
from biped.studies.stability.section import Kicks, Mapped, Steady

SIZES = (1e-8, 1e-6, 1e-4, 1e-3, 3e-3, 1e-2, 3e-2, 0.1, 0.2, 0.4)
"""Distances of the kicked state, natural units."""

PAIRS = 12
"""Pairs of walks of each size."""

RETURNS = 3


class Shrinking(NamedTuple):
    """The shrinking of kicks of one size.

    Attributes:
        size: Distance of the kicked state from the other, natural units.
        after: (RETURNS,) median distance after each return; nan where fewer than half of the pairs got there.
        fell: Kicked walks that fell, of `walks`.
        walks: Kicked walks.
    """

    size: float
    after: list[float]
    fell: int
    walks: int


def shrinking(gait: Steady, rng: np.random.Generator, mapped: Mapped) -> list[Shrinking]:
    """Measures how kicks of every size shrink.

    Args:
        gait: Its strides; pairs start from their states.
        rng: Draws states and directions.
        mapped: Carries walks out.
    """
    starts = []
    for z in gait.states[rng.integers(len(gait.states), size=PAIRS)]:
        kicks = Kicks(gait.section, z)
        starts.append((kicks, rng.standard_normal(kicks.basis.shape[1])))

    def pair(start: tuple[Kicks, np.ndarray]) -> list[tuple[np.ndarray, bool]]:
        """Distances (RETURNS,) after kicks of every size, and whether the kicked walk fell."""
        kicks, direction = start
        seconds = (RETURNS + 0.5) * gait.stride
        plain = gait.section.walk(kicks.z, seconds)[1]
        out = []
        for size in SIZES:
            apart = np.full(RETURNS, np.nan)
            try:
                t, other = gait.section.walk(kicks.along(direction, size), seconds)
            except RunError:  # no such state
                out.append((apart, False))
                continue
            n = min(len(plain), len(other), RETURNS)
            apart[:n] = np.linalg.norm(plain[:n] - other[:n], axis=1)
            out.append((apart, t.end != "completed"))
        return out

    found = mapped(pair, starts)
    rows = []
    for i, size in enumerate(SIZES):
        apart = np.array([one[i][0] for one in found])
        enough = np.isfinite(apart).sum(axis=0) >= PAIRS / 2
        after = [float(np.nanmedian(apart[:, k])) if enough[k] else float("nan") for k in range(RETURNS)]
        rows.append(Shrinking(size, after, sum(one[i][1] for one in found), PAIRS))
    return rows


def floor(rows: Sequence[Shrinking]) -> float | None:
    """The size above which kicks have shrunk after `RETURNS` returns; 0: all do, None: none does."""
    sizes = np.array([row.size for row in rows])
    after = np.array([row.after[-1] for row in rows])
    sizes, after = sizes[np.isfinite(after)], after[np.isfinite(after)]
    grows = np.flatnonzero(after >= sizes)
    if not grows.size:
        return 0.0
    last = int(grows[-1])
    if last + 1 == len(sizes):
        return None
    # The crossing of the diagonal, on a straight line in logarithms.
    low, high = np.log(after[last] / sizes[last]), np.log(after[last + 1] / sizes[last + 1])
    return float(np.exp(np.interp(0.0, [high, low], np.log([sizes[last + 1], sizes[last]]))))


LEAN = tuple(np.linspace(-0.75, 0.75, 11))
"""[rad] forward."""
SPEED = tuple(np.linspace(-1.0, 1.0, 11))
"""[m/s] forward."""
STATES = 2
"""Steady states that every change is made to."""
STRIDES = 6
"""Strides of a walk after the change."""
LAST = 2
"""Returns at its end that are compared with the gait's own."""
WITHIN = 0.95
"""Share of the gait's own states that are nearer to its others than what counts as back on the gait."""
SHRUNK = 0.1
"""Share of the change that may be left of it to count as back on the gait: a limit cycle is reached only in the end."""

FELL, WALKS, RETURNED, IMPOSSIBLE = "fell", "walks", "returned", "impossible"
"""Ends of a change: a fall; the walker is still up but not back; it is back; no such posture."""


class Basin(NamedTuple):
    """Outcomes of every change of the grid.

    Attributes:
        lean: [rad] forward, of the grid.
        speed: [m/s] forward, likewise.
        reach: How far a state of the gait may be from the nearest of its other states, natural units.
        states: Steady states that every change was made to.
        counts: For each outcome [lean][speed] how many of them ended so.
    """

    lean: list[float]
    speed: list[float]
    reach: float
    states: int
    counts: dict[str, list[list[int]]]

    def as_dict(self) -> dict[str, Any]:
        """Numbers by name, each outcome under its own."""
        out = self._asdict()
        return out | out.pop("counts")


def reach(steady: np.ndarray) -> float:
    """How far a state of the gait may be from the nearest of its other states, natural units."""
    apart = np.linalg.norm(steady[:, None] - steady[None], axis=2)
    np.fill_diagonal(apart, np.inf)
    return float(np.quantile(apart.min(axis=1), WITHIN))


def basin_slice(gait: Steady, rng: np.random.Generator, mapped: Mapped) -> Basin:
    """Walks from every change of the grid.

    Args:
        gait: Its strides.
        rng: Draws the states that are changed.
        mapped: Carries walks out.
    """
    steady = gait.states
    chosen = [Kicks(gait.section, z) for z in steady[rng.permutation(len(steady))[:STATES]]]
    near = reach(steady)

    def outcome(at: tuple[Kicks, float, float]) -> str:
        kicks, lean, speed = at
        try:
            changed = kicks.moved(lean, speed)
        except RunError:
            return IMPOSSIBLE
        t, states = gait.section.walk(changed, (STRIDES + 0.5) * gait.stride)
        if t.end != "completed":
            return FELL
        # A walker that no longer strides is up, but not walking as the gait does.
        if len(states) < STRIDES // 2:
            return WALKS
        away = np.linalg.norm(states[-LAST:, None] - steady[None], axis=2).min(axis=1)
        allowed = max(near, SHRUNK * float(np.linalg.norm(changed - kicks.z)))
        return RETURNED if away.min() <= allowed else WALKS

    grid = [(kicks, lean, speed) for lean in LEAN for speed in SPEED for kicks in chosen]
    found = np.array(mapped(outcome, grid)).reshape(len(LEAN), len(SPEED), len(chosen))
    counts = {name: (found == name).sum(axis=2).tolist() for name in (FELL, WALKS, RETURNED, IMPOSSIBLE)}
    return Basin(list(LEAN), list(SPEED), near, len(chosen), counts)
