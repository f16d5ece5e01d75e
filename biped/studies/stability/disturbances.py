"""Small disturbances of a walk, of any robot under any law in any engine: their growth, and what they do to its steps.

Growth: a walk is made twice, once with a push of one tick in mid-walk; how far apart the two are is compared at equal
strikes of the first foot. Nothing is taken from law or engine but the true trajectory.

The gait sensitivity norm of D. Hobbelen and M. Wisse (IEEE Trans. Robot. 23:1213, 2007) is the root of the summed
squares by which gait indicators differ from their usual values after a disturbance, over the size of the disturbance.
Indicators here are the times of the steps and the ways of the centre of mass in them, in natural units. A walk that is
no perfect cycle scatters by itself: what it scatters without a disturbance is taken off.
"""

import dataclasses
import math
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from msgspec.structs import replace

from biped.base.errors import RunError
from biped.base.statistics import Z95
from biped.ensemble.backend import Jobs
from biped.ensemble.campaign import simulate
from biped.ensemble.executor import mapped
from biped.ensemble.plan import Plan
from biped.measure.metrics.gait import headings
from biped.measure.trajectory import Trajectory
from biped.robot.ground import GRAVITY
from biped.robot.run import Run
from biped.scenario.vary import stream
from biped.scenario.world import Push
from biped.studies.run import plan_of, title_of

SETTLING, STRIDES = 4, 5
"""Strides before the push, and after it."""
SIZES = (1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 5e-2)
"""Impulses of the pushes, in m √(g l)."""
PAIRS = 6
"""Pushes of each size, at other moments of a stride."""
LARGE = 0.1
"""Distance in natural units beyond which two walks have nothing to do with one another."""
RESAMPLED = 2000
LASTING = 24.0
"""[s] of a walk unless a change says otherwise."""


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


def expect_enough(name: str, own: Trajectory, count: int, least: int, words: str) -> None:
    """Rejects a walk that is too short to be disturbed and compared.

    Args:
        name: Name or path of the scenario.
        own: The walk.
        count: How many it has of what is counted.
        least: How many it needs.
        words: What is counted.

    Raises:
        RunError: It has fewer.
    """
    if count < least:
        raise RunError(f"{title_of(name)}: {count} {words} in {own.time[-1]:.1f} s ({own.end}); expected at least "
                       f"{least}: raise duration, or take a gait that walks")  # fmt: skip


def states_of(t: Trajectory) -> np.ndarray:
    """(n, k) state in natural units, without place and heading.

    Height of the base, direction of gravity in it, its turning rate, velocity of the centre of mass as the base faces,
    joint angles and their rates.
    """
    leg = t.robot.leg
    time, speed = math.sqrt(leg / GRAVITY), math.sqrt(leg * GRAVITY)
    gravity = np.array(t.gravity) / np.linalg.norm(t.gravity)
    angle = headings(t)
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


def with_push(run: Run, impulse: float, row: int, axis: int = 0) -> Run:
    """Returns the run with a push of one tick on its trunk.

    Args:
        run: The run.
        impulse: In m √(g l).
        row: Tick of the push.
        axis: 0 forward; in space 1 to the left.
    """
    robot, s = run.robot, run.scenario
    newton = impulse * robot.mass * math.sqrt(GRAVITY * robot.leg) / run.tick
    force = tuple(newton if i == axis else 0.0 for i in range(len(robot.moving_columns)))
    push = Push(at=row * run.tick, duration=run.tick, force=force, body=robot.bodies[robot.trunk_number - 1])
    return dataclasses.replace(run, scenario=replace(s, push=(*s.push, push)))


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


SETTLING_STEPS, STEPS = 8, 12
"""Steps before a disturbance, and those that count after it."""
MOMENTS = 24
"""Disturbances of each kind, at other moments of a stride."""
PUSH, RISE = 0.05, 0.01
"""Impulse of a push in m √(g l); height of a step of the ground in leg lengths."""
LONGER = 1.2
"""How much longer than those of the undisturbed walk the steps after a disturbance may take, to be counted."""
RAMP = 0.06
"""Of a step of the ground, in leg lengths."""
INDICATORS = ("time", "way")
"""Of a step: its duration, in √(l/g), and the way of the centre of mass in it, in l."""


class Sensitivity(NamedTuple):
    """The norm of one kind of disturbance.

    Attributes:
        disturbance: In words.
        size: Of it.
        walks: Disturbed walks.
        fell: Those that fell, or stood, before their steps could be counted: the norm is of the others.
        norm: Of all indicators; nan where no walk was left.
        low: Lower bound of its 95 % interval, resampled over walks.
        high: Upper bound.
        parts: The norm of each of `INDICATORS` alone.
    """

    disturbance: str
    size: float
    walks: int
    fell: int
    norm: float
    low: float
    high: float
    parts: tuple[float, ...]


class GaitSensitivity(NamedTuple):
    """Norms of all kinds of disturbances.

    Attributes:
        scenario: Its name.
        engine: Where.
        kinds: Pushes, then steps of the ground where it can have some.
    """

    scenario: str
    engine: str
    kinds: tuple[Sensitivity, ...]

    def as_dict(self) -> dict[str, Any]:
        """Plain data, as `--json` prints it."""
        return {"scenario": self.scenario, "engine": self.engine, "kinds": [one._asdict() for one in self.kinds]}


class _Usual(NamedTuple):
    """A walk without a disturbance.

    Attributes:
        strikes: Rows of its strikes, of one foot after the other.
        mean: (2, 2) indicators of the steps that begin with a strike of either foot.
        variance: (2,) of the steps about these means.
    """

    strikes: np.ndarray
    mean: np.ndarray
    variance: np.ndarray


def sensitivity(name: str, changes: Sequence[str], jobs: Jobs) -> GaitSensitivity:
    """Measures the gait sensitivity norm.

    Args:
        name: Name or path of the scenario.
        changes: `--set` changes.
        jobs: Number of processes, or a cluster.

    Raises:
        RunError: The walk without a disturbance is too short.
    """
    plan = plan_of(name, [f"duration={LASTING}", *changes])
    own = simulate(plan.run(0))
    rows, feet = _alternate(own)
    expect_enough(name, own, len(rows), SETTLING_STEPS + STEPS + 4, "steps")
    usual = _usual(own, rows, feet)
    rng = stream(plan.scenario.seed, "stability.sensitivity")
    begin, end = rows[SETTLING_STEPS], rows[SETTLING_STEPS + 2]
    moments = [int(begin + (end - begin) * (i + rng.random()) / MOMENTS) for i in range(MOMENTS)]
    kinds = _kinds(plan.run(0), own)
    last = LONGER * float(own.time[rows[SETTLING_STEPS + 2 + STEPS]])
    items = [(kind, row) for kind in range(len(kinds)) for row in moments]
    found = mapped(partial(_upset, plan, kinds, usual, last), items, jobs)
    return GaitSensitivity(title_of(name), plan.scenario.engine, tuple(
        _norm(words, size, found[i * MOMENTS : (i + 1) * MOMENTS], rng) for i, (words, size, _) in enumerate(kinds)
    ))  # fmt: skip


_Disturbed = Callable[..., Run]
_Kind = tuple[str, float, _Disturbed]


def _kinds(run: Run, own: Trajectory) -> list[_Kind]:
    """Kinds of disturbances that a run can have: words, size, and the run with one at a row."""
    ways = {"push forward": (0, 1.0), "push backward": (0, -1.0)}
    aside = len(run.robot.moving_columns) > 2
    if aside:
        ways |= {"push to the left": (1, 1.0), "push to the right": (1, -1.0)}
    out: list[_Kind] = [
        (words, PUSH, partial(with_push, impulse=sign * PUSH, axis=axis)) for words, (axis, sign) in ways.items()
    ]
    if not aside and run.scenario.ground.steps.rise == 0.0:  # in space the ground is one plane
        toes = own.point[..., 0].max(axis=1) / own.robot.leg
        out += [(words, RISE, partial(_stepped, toes=toes, rise=sign * RISE))
                for words, sign in (("step up", 1.0), ("step down", -1.0))]  # fmt: skip
    return out


def _stepped(run: Run, row: int, toes: np.ndarray, rise: float) -> Run:
    """The run on ground that changes its height just beyond the foremost toe of a row."""
    s, leg = run.scenario, run.robot.leg
    start = (float(toes[row]) + RAMP) * leg
    steps = replace(s.ground.steps, rise=rise * leg, start=start, ramp=RAMP * leg, run=100.0, number=1)
    return dataclasses.replace(run, scenario=replace(s, ground=replace(s.ground, steps=steps)))


def _alternate(t: Trajectory) -> tuple[np.ndarray, np.ndarray]:
    """Rows and feet of strikes, of one foot after the other: a foot that strikes again begins no new step."""
    strikes = t.strikes
    first = [one for i, one in enumerate(strikes) if i == 0 or one[1] != strikes[i - 1][1]]
    return np.array([row for row, _ in first], dtype=int), np.array([foot for _, foot in first], dtype=int)


def _indicators(t: Trajectory, rows: np.ndarray) -> np.ndarray:
    """(n - 1, 2) indicators of the steps between n strikes."""
    moved = np.linalg.norm(np.diff(t.com[rows, :2], axis=0), axis=1) / t.robot.leg
    return np.column_stack([np.diff(rows) * t.tick / math.sqrt(t.robot.leg / GRAVITY), moved])


def _usual(t: Trajectory, rows: np.ndarray, feet: np.ndarray) -> _Usual:
    steps, of = _indicators(t, rows)[SETTLING_STEPS:], feet[SETTLING_STEPS:-1]
    mean = np.array([steps[of == foot].mean(axis=0) for foot in (0, 1)])
    return _Usual(rows, mean, ((steps - mean[of]) ** 2).sum(axis=0) / max(1, len(steps) - 2))


def _upset(plan: Plan, kinds: Sequence[_Kind], usual: _Usual, last: float, item: tuple[int, int]) -> list[float] | None:
    """Summed squares of changes beyond the scatter, over the size's; None of a walk with too few steps."""
    (_, size, disturbed), row = kinds[item[0]], item[1]
    run = disturbed(plan.run(0), row=row)
    t = simulate(dataclasses.replace(run, scenario=replace(run.scenario, duration=min(run.scenario.duration, last))))
    rows, feet = _alternate(t)
    first = int(np.searchsorted(usual.strikes, row, side="right")) - 1
    rows, feet = rows[first : first + STEPS + 1], feet[first : first + STEPS]
    if len(rows) < STEPS + 1:
        return None
    return beyond_scatter(_indicators(t, rows) - usual.mean[feet], usual.variance, size)


def beyond_scatter(changes: np.ndarray, variance: np.ndarray, size: float) -> list[float]:
    """Summed squares of changes beyond what steps scatter without a disturbance, over the square of its size.

    Args:
        changes: (steps, indicators) from the usual values.
        variance: (indicators,) of undisturbed steps.
        size: Of the disturbance.

    Returns:
        One number for each indicator; the root of the sum of their means over walks is the norm.
    """
    return [float(one) for one in (changes**2 - variance).sum(axis=0) / size**2]


def _norm(words: str, size: float, found: Sequence[list[float] | None], rng: np.random.Generator) -> Sensitivity:
    there = np.array([one for one in found if one is not None])
    if not len(there):
        return Sensitivity(words, size, len(found), len(found), math.nan, math.nan, math.nan, (math.nan, math.nan))

    def root(values: np.ndarray) -> float:
        return math.sqrt(max(0.0, float(values.mean())))

    whole = there.sum(axis=1)
    resampled = [root(whole[draw]) for draw in rng.integers(len(whole), size=(RESAMPLED, len(whole)))]
    low, high = (float(one) for one in np.quantile(resampled, [0.025, 0.975]))
    parts = tuple(root(column) for column in there.T)
    return Sensitivity(words, size, len(found), len(found) - len(there), root(whole), low, high, parts)


def rank_correlation(first: Sequence[float], second: Sequence[float]) -> tuple[float, float, float]:
    """Spearman's rank correlation of pairs, and its 95 % interval.

    The interval is Fisher's with the variance of D. Bonett and T. Wright (Psychometrika 65:23, 2000), which holds for
    ranks of small samples.

    Args:
        first: Numbers, infinite ones too.
        second: As many, at least four.
    """
    from scipy.stats import rankdata

    rho = float(np.corrcoef(rankdata(first), rankdata(second))[0, 1])
    if math.isnan(rho) or abs(rho) >= 1.0:
        return rho, rho, rho
    half = Z95 * math.sqrt((1.0 + 0.5 * rho * rho) / (len(first) - 3))
    return rho, math.tanh(math.atanh(rho) - half), math.tanh(math.atanh(rho) + half)
