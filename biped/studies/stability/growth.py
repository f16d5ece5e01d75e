"""Growth of small disturbances of a walk, of any robot under any law in any engine.

A walk is made twice, once with a push of one tick in mid-walk; how far apart the two are is compared at equal strikes
of the first foot. Nothing is taken from law or engine but the true trajectory.
"""

import math
from collections.abc import Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from biped.ensemble.backend import Jobs
from biped.ensemble.campaign import simulate
from biped.ensemble.executor import mapped
from biped.ensemble.plan import Plan
from biped.measure.trajectory import Trajectory
from biped.robot.ground import GRAVITY
from biped.scenario.vary import stream
from biped.studies.run import plan_of, title_of
from biped.studies.stability.disturbances import LASTING, RESAMPLED, expect_enough, with_push

SETTLING, STRIDES = 4, 5
"""Strides before the push, and after it."""
SIZES = (1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 5e-2)
"""Impulses of the pushes, in m √(g l)."""
PAIRS = 6
"""Pushes of each size, at other moments of a stride."""
LARGE = 0.1
"""Distance in natural units beyond which two walks have nothing to do with one another."""


class Growth(NamedTuple):
    """Growth after pushes of one size.

    Attributes:
        size: Impulse in m √(g l).
        pairs: Walks that were compared; of a pushed one that fell, up to there.
        fell: Pushed walks that fell.
        distances: Geometric means at the strikes after the push, natural units; nan where no pair was left.
        factor: By which distances grow a stride, geometric mean while they are not large; nan where none was.
        low: Lower bound of its 95 % interval, resampled over pairs.
        high: Upper bound.
    """

    size: float
    pairs: int
    fell: int
    distances: tuple[float, ...]
    factor: float
    low: float
    high: float


class Grown(NamedTuple):
    """Growth of pushes of every size.

    Attributes:
        scenario: Its name.
        engine: Where.
        sizes: Pushes from the smallest on.
    """

    scenario: str
    engine: str
    sizes: tuple[Growth, ...]

    def as_dict(self) -> dict[str, Any]:
        """Plain data, as `--json` prints it."""
        return {"scenario": self.scenario, "engine": self.engine, "sizes": [one._asdict() for one in self.sizes]}


def growth(name: str, changes: Sequence[str], jobs: Jobs) -> Grown:
    """Measures the growth of small pushes.

    Args:
        name: Name or path of the scenario.
        changes: `--set` changes.
        jobs: Number of processes, or a cluster.

    Raises:
        RunError: The walk without a push is too short.
    """
    plan = plan_of(name, [f"duration={LASTING}", *changes])
    own = simulate(plan.run(0))
    strikes = _strikes(own)
    expect_enough(name, own, len(strikes), SETTLING + STRIDES + 2, "strikes of the first foot")
    states = states_of(own)
    rng = stream(plan.scenario.seed, "stability.growth")
    begin, end = strikes[SETTLING], strikes[SETTLING + 1]
    rows = [int(begin + (end - begin) * place) for place in rng.random(PAIRS)]
    ways = rng.choice([-1.0, 1.0], PAIRS)
    items = [(size * way, row) for size in SIZES for row, way in zip(rows, ways, strict=True)]
    found = mapped(partial(_apart, plan, states, strikes), items, jobs)
    groups = [found[i * PAIRS : (i + 1) * PAIRS] for i in range(len(SIZES))]
    sizes = tuple(_growth(size, group, rng) for size, group in zip(SIZES, groups, strict=True))
    return Grown(title_of(name), plan.scenario.engine, sizes)


def states_of(t: Trajectory) -> np.ndarray:
    """(n, k) state in natural units, without place and heading.

    Height of the base, direction of gravity in it, its turning rate, velocity of the centre of mass as the base faces,
    joint angles and their rates.
    """
    leg = t.robot.leg
    time, speed = math.sqrt(leg / GRAVITY), math.sqrt(leg * GRAVITY)
    gravity = np.array(t.gravity) / np.linalg.norm(t.gravity)
    angle = t.heading
    c, s, (x, y, z) = np.cos(angle), np.sin(angle), t.com_velocity.T
    about = list(t.robot.turning_columns)
    joints = [i for i in range(t.v.shape[1]) if i not in t.robot.base_columns]
    turned = len(t.q.T) - len(t.v.T)  # a quaternion has a number more than its rates
    return np.column_stack([
        t.base[:, 2] / leg, np.einsum("nij,i->nj", t.turn, gravity), t.v[:, about] * time,
        (c * x + s * y) / speed, (c * y - s * x) / speed, z / speed,
        t.q[:, [i + turned for i in joints]], t.v[:, joints] * time,
    ])  # fmt: skip


def _strikes(t: Trajectory) -> list[int]:
    return [row for row, foot in t.strikes if foot == 0]


def _apart(plan: Plan, states: np.ndarray, strikes: list[int], item: tuple[float, int]) -> tuple[bool, list[float]]:
    """Whether a pushed walk fell, and its distances at the strikes after the push."""
    size, row = item
    pushed = simulate(with_push(plan.run(0), size, row))
    theirs, moved = _strikes(pushed), states_of(pushed)
    after = [
        float(np.linalg.norm(moved[b] - states[a]))
        for a, b in zip(strikes[SETTLING + 1 :][:STRIDES], theirs[SETTLING + 1 :][:STRIDES], strict=False)
    ]
    return pushed.end != "completed", after


def _growth(size: float, group: Sequence[tuple[bool, list[float]]], rng: np.random.Generator) -> Growth:
    table = np.full((len(group), STRIDES), np.nan)
    for line, (_, distances) in zip(table, group, strict=True):
        line[: len(distances)] = distances
    steps = [_steps(line) for line in table]
    there = [one for one in steps if len(one)]
    with np.errstate(all="ignore"):
        logs = np.log(np.where(table > 0.0, table, np.nan))
        means = tuple(float(np.exp(column[~np.isnan(column)].mean())) if (~np.isnan(column)).any() else math.nan
                      for column in logs.T)  # fmt: skip
    if not there:
        return Growth(size, len(group), sum(fell for fell, _ in group), means, math.nan, math.nan, math.nan)
    draws = rng.integers(len(there), size=(RESAMPLED, len(there)))
    resampled = [np.concatenate([there[i] for i in draw]).mean() for draw in draws]
    low, high = np.exp(np.quantile(resampled, [0.025, 0.975]))
    factor = math.exp(float(np.concatenate(there).mean()))
    return Growth(size, len(group), sum(fell for fell, _ in group), means, factor, float(low), float(high))


def _steps(distances: np.ndarray) -> np.ndarray:
    """Ln of the growth from strike to strike while distances are neither zero nor large."""
    a, b = distances[:-1], distances[1:]
    use = (a > 0.0) & (b > 0.0) & (a < LARGE)
    return np.log(b[use] / a[use])
