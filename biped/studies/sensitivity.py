"""Which drawn value explains the falls: first-order sensitivities of an ensemble's outcome.

S = Var(E[y | x]) / Var(y), Sobol's first-order index of the outcome y (1 where a run did not walk, or whatever it had
to do) to one drawn value x, from the runs that were made anyway: they are sorted by x into classes of equal size, and
what scatters between the classes beyond chance is what x explains (Kelley's ε², the correlation ratio less its bias).
What x does together with other values is no part of it. Intervals held the truth in 90 to 98 of 100 made-up ensembles
of 60 to 1000 runs.
"""

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from biped.ensemble.plan import Plan
from biped.robot.planar.topology import N_ANGLES, PITCH
from biped.robot.planar.tree import absolute
from biped.scenario.vary import stream

LEAST = 20
"""Fewer runs say nothing about what explains them."""
_IN_A_CLASS, _CLASSES = 10, 8
_RESAMPLED = 1000
_GRID = 60
STARTS = 2000
"""Most runs whose start angles are found anew to be looked at."""


class Share(NamedTuple):
    """The share of failures that one drawn value explains.

    Attributes:
        name: The scenario key, or which start angle.
        index: First-order sensitivity; chance may make the estimate a little negative.
        interval: Its 95 % interval.
        labels: The classes, in words.
        failed: Runs of each class that missed their goal.
        runs: Runs of each class.
    """

    name: str
    index: float  # pyright: ignore[reportIncompatibleMethodOverride]
    interval: tuple[float, float]
    labels: list[str]
    failed: list[int]
    runs: list[int]

    @property
    def sure(self) -> bool:
        """Whether chance alone would not explain as much."""
        return self.interval[0] > 0.0


def explained(plan: Plan, rows: Sequence[Mapping[str, Any]], goal: str = "walked") -> list[Share]:
    """Shares of the runs that missed their goal which each drawn or swept value explains, the largest first.

    Args:
        plan: The ensemble; without a sweep, its random starts are looked at too.
        rows: Its runs' rows.
        goal: What a run had to do, as a metric.

    Returns:
        Nothing if there are fewer than `LEAST` runs, all or none reached it, or nothing was drawn.
    """
    failed = np.array([not row[goal] for row in rows])
    if len(rows) < LEAST or failed.all() or not failed.any():
        return []
    drawn: dict[str, list[Any]] = {}
    for key in dict.fromkeys(key for row in rows for key in row["values"]):
        drawn[key] = [row["values"].get(key) for row in rows]
    if plan.scenario.start.jitter > 0.0 and not plan.scenario.sweep and len(rows) <= STARTS:
        angles = np.array([absolute(plan.run(row["index"]).q)[PITCH:] for row in rows])
        links = plan.robot.bodies
        drawn |= {f"start: {links[i].replace('_', ' ')}": np.degrees(angles[:, i]).tolist() for i in range(N_ANGLES)}
    rng = stream(plan.scenario.seed, "sensitivity")
    shares = [share_of(name, values, failed, rng) for name, values in drawn.items()]
    return sorted((share for share in shares if share is not None), key=lambda share: -share.index)


def share_of(name: str, values: Sequence[Any], failed: np.ndarray, rng: np.random.Generator) -> Share | None:
    """The share of failures that one drawn value explains.

    Args:
        name: Its name.
        values: (n,) its value in each run.
        failed: (n,) whether the run missed its goal.
        rng: For the interval.

    Returns:
        None if it took one value only.
    """
    labels, member = _classes(values)
    if len(labels) < 2:
        return None
    runs = np.bincount(member, minlength=len(labels))
    counts = np.bincount(member, weights=failed, minlength=len(labels)).astype(int)
    index = float(_index(counts[None], runs)[0])
    interval = _interval(index, counts, runs, rng)
    return Share(name, index, interval, labels, counts.tolist(), runs.tolist())


def _interval(index: float, counts: np.ndarray, runs: np.ndarray, rng: np.random.Generator) -> tuple[float, float]:
    """The 95 % interval of a sensitivity: every true one that would give the estimate in 95 of 100 ensembles.

    Rates of the classes are taken to lie as the observed ones do, drawn together or apart until they explain as much.
    """
    mean = counts.sum() / runs.sum()
    away = counts / runs - mean
    spread = float((runs * away**2).sum() / runs.sum()) or 1.0
    held = []
    for wanted in np.linspace(0.0, 1.0, _GRID) ** 2:  # finer where it is small
        rates = np.clip(mean + math.sqrt(wanted * mean * (1.0 - mean) / spread) * away, 0.0, 1.0)
        low, high = np.quantile(_index(rng.binomial(runs, rates, (_RESAMPLED, len(runs))), runs), [0.025, 0.975])
        if wanted == 0.0 and index <= high:
            held.append(0.0)  # chance gives as much, or even more
        elif low <= index <= high:
            whole = (runs * rates).sum() / runs.sum()
            held.append(float((runs * (rates - whole) ** 2).sum() / runs.sum() / (whole * (1.0 - whole))))
    return min(held, default=1.0), max(held, default=1.0)


def _index(failed: np.ndarray, runs: np.ndarray) -> np.ndarray:
    """(m,) ε² of counts (m, classes) of runs (classes,)."""
    n, mean = runs.sum(), failed.sum(axis=1, keepdims=True) / runs.sum()
    rates = failed / runs
    total = (n * mean * (1.0 - mean))[:, 0]
    between = (runs * (rates - mean) ** 2).sum(axis=1)
    within = (total - between) / (n - len(runs))
    return np.divide(between - (len(runs) - 1) * within, total, out=np.zeros(len(total)), where=total > 0.0)


def _classes(values: Sequence[Any]) -> tuple[list[str], np.ndarray]:
    """Names of classes and the class (n,) of each value: its own where few values occur, else of equal size."""
    distinct = list(dict.fromkeys(values))
    numbers = all(isinstance(value, int | float) and not isinstance(value, bool) for value in distinct)
    most = max(2, min(_CLASSES, len(values) // _IN_A_CLASS))
    if len(distinct) <= _CLASSES or not numbers:
        distinct = sorted(distinct) if numbers else sorted(distinct, key=str)
        if len(distinct) > len(values) // 2:  # every run its own word: nothing to compare
            return [], np.zeros(len(values), int)
        place = {value: i for i, value in enumerate(distinct)}
        return [_text(value) for value in distinct], np.array([place[value] for value in values])
    order = np.argsort(np.array(values, float), kind="stable")
    member = np.empty(len(values), int)
    parts = np.array_split(order, most)
    for i, part in enumerate(parts):
        member[part] = i
    return [f"{_text(float(values[part[0]]))} … {_text(float(values[part[-1]]))}" for part in parts], member


def _text(value: Any) -> str:
    if not isinstance(value, float):
        return str(value)
    return f"{float(f'{value:.2g}'):.10g}" if abs(value) < 1e6 else f"{value:.2g}"
