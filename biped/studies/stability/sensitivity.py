"""The gait sensitivity norm: how much small disturbances of a walk upset its steps.

It is the root of the summed squares by which gait indicators differ from their usual values after a disturbance, over
the size of the disturbance (D. Hobbelen and M. Wisse, IEEE Trans. Robot. 23:1213, 2007). Indicators here are the times
of the steps and the ways of the centre of mass in them, in natural units. A walk that is no perfect cycle scatters by
itself: what it scatters without a disturbance is taken off. It is measured of any robot under any law in any engine.
"""

import dataclasses
import math
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from msgspec.structs import replace

from biped.ensemble.backend import Jobs
from biped.ensemble.campaign import simulate
from biped.ensemble.executor import mapped
from biped.ensemble.plan import Plan
from biped.measure.trajectory import Trajectory
from biped.robot.ground import GRAVITY
from biped.robot.run import Run
from biped.scenario.vary import stream
from biped.studies.run import plan_of, title_of
from biped.studies.stability.disturbances import LASTING, RESAMPLED, expect_enough, with_push

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
