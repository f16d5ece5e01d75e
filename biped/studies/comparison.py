"""The same scenario in several engines: every metric side by side, the time until walkers part, and a verdict."""

import math
from collections.abc import Mapping, Sequence
from itertools import combinations
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from biped.base.errors import InputError
from biped.base.statistics import UNLIKELY, means, same_rate, wilson
from biped.base.writing import dumps, may_fill, write_into
from biped.ensemble import campaign
from biped.ensemble.backend import Jobs
from biped.ensemble.plan import Plan
from biped.ensemble.results import result_of
from biped.ensemble.rows import LOST, RAISED
from biped.measure.trajectory import Trajectory
from biped.measure.verdict import SOUND
from biped.scenario.engines import HOME, MUJOCO
from biped.scenario.metrics import METRICS
from biped.scenario.reading import to_toml
from biped.studies.run import plan_of

DEFAULT = (HOME, MUJOCO)
"""Engines that are compared where none are named."""
PARTED = 0.05
"""[m] by which the place of the base, of a joint of the legs or of the trunk's end must differ in two walkers that have
parted."""
JUDGED = ("speed", "cost_of_transport", "double_support")
"""Metrics that decide, besides how many walked, whether engines agree."""
MARGIN = 0.05
"""A difference within this share of the larger mean is none that matters."""


class Disagreement(NamedTuple):
    """Two engines that do not agree.

    Attributes:
        engines: Which.
        metrics: Names of those in which they differ.
        parted_at: [s] when their first walkers part; nan if they never do.
    """

    engines: tuple[str, str]
    metrics: tuple[str, ...]
    parted_at: float


class Comparison(NamedTuple):
    """One scenario in several engines.

    Attributes:
        scenario: Its name.
        description: Its line for people.
        plans: Its plan in each engine.
        results: Result object of each engine, as `run` makes it.
        first: Trajectory of run 0 in each engine.
    """

    scenario: str
    description: str
    plans: dict[str, Plan]
    results: dict[str, dict[str, Any]]
    first: dict[str, Trajectory]

    @property
    def engines(self) -> tuple[str, ...]:
        """Their names."""
        return tuple(self.plans)

    @property
    def runs(self) -> dict[str, list[Mapping[str, Any]]]:
        """Rows of each engine."""
        return {engine: result["runs"] for engine, result in self.results.items()}

    def as_dict(self) -> dict[str, Any]:
        """Plain data, as `--json` prints it."""
        return {
            "scenario": self.scenario,
            "engines": list(self.engines),
            "passed": all(
                run["verdict"] == SOUND and run["end"] not in (LOST, RAISED)
                for runs in self.runs.values() for run in runs
            ),
            "agree": not self.disagreements(),
            "verdict": self.verdict(),
            "parted_at": min(self.parted().values(), key=lambda at: math.inf if math.isnan(at) else at),
            "parted": {" ".join(pair): at for pair, at in self.parted().items()},
            "metrics": self.metrics(),
            "results": self.results,
        }  # fmt: skip

    def parted(self) -> dict[tuple[str, str], float]:
        """The time [s] at which the first walkers of each pair of engines part; nan if they never do."""
        return {(a, b): parted_at(self.first[a], self.first[b]) for a, b in combinations(self.engines, 2)}

    def metrics(self) -> dict[str, dict[str, Any]]:
        """Every metric: in each engine, with intervals where there are any; their spread; the thesis's number."""
        thesis = self.results[self.engines[0]]["thesis"]
        return {name: self._metric(name) | ({"thesis": thesis[name]} if name in thesis else {}) for name in METRICS}

    def _metric(self, name: str) -> dict[str, Any]:
        values = {engine: result["summary"][name] for engine, result in self.results.items()}
        intervals = {engine: self._interval(name, engine) for engine in values}
        return {
            **values,
            "intervals": {engine: list(interval) for engine, interval in intervals.items() if interval is not None},
            "spread": spread(list(values.values())),
        }

    def _interval(self, name: str, engine: str) -> tuple[float, float] | None:
        """The 95 % interval of a metric over an engine's runs: of those that walked where any did; None of one."""
        runs = self.runs[engine]
        if METRICS[name].kind == "count":
            count, total = int(self.results[engine]["summary"][name]), len(runs)
            low, high = wilson(min(count, total), total)
            return (low * total, high * total) if total > 1 and name in ("walked", "falls") else None
        walkers = [run for run in runs if run["walked"]] or runs
        estimate = means([run[name] for run in walkers if math.isfinite(run[name])])
        return None if math.isnan(estimate.low) else (estimate.low, estimate.high)

    def disagreements(self) -> list[Disagreement]:
        """Pairs of engines that do not agree."""
        parted = self.parted()
        found = [(pair, self._differing(*pair)) for pair in parted]
        return [Disagreement(pair, metrics, parted[pair]) for pair, metrics in found if metrics]

    def _differing(self, a: str, b: str) -> tuple[str, ...]:
        """Metrics in which two engines differ by more than chance and by what matters."""
        out = []
        one, other = self.runs[a], self.runs[b]
        walked = [sum(bool(run["walked"]) for run in runs) for runs in (one, other)]
        if len(one) == 1 or len(other) == 1:
            if walked[0] != walked[1]:
                out.append("walked")
        elif same_rate(walked[0], walked[1], len(one), len(other)) < UNLIKELY:
            out.append("walked")
        started = list(zip(one, other, strict=True))
        pairs = [(x, y) for x, y in started if x["walked"] and y["walked"]] or started
        for name in JUDGED:
            both = [(x[name], y[name]) for x, y in pairs if math.isfinite(x[name]) and math.isfinite(y[name])]
            if not both:
                continue
            size = max(abs(math.fsum(column) / len(both)) for column in zip(*both, strict=True))
            found = means([y - x for x, y in both])
            if abs(found.change) > MARGIN * size and (len(both) == 1 or found.p < UNLIKELY):
                out.append(name)
        return tuple(out)

    def verdict(self) -> str:
        """One sentence: *agree*, or *differ*: who, in what, from when on."""
        found = self.disagreements()
        if not found:
            spreads = {name: spread([r["summary"][name] for r in self.results.values()]) for name in JUDGED}
            parts = [f"walked {self._of('walked', self.engines)}"]
            parts += [f"{name.replace('_', ' ')} within {100 * one:.1f} %" for name, one in spreads.items()
                      if math.isfinite(one)]  # fmt: skip
            return f"agree: {'; '.join(parts)}"
        if len(self.engines) > 2:
            for engine in self.engines:
                if all(engine in one.engines for one in found) and len(found) == len(self.engines) - 1:
                    others = [other for other in self.engines if other != engine]
                    return self._differ(f"{engine} from {_and(others)}", found, (engine, *others))
        if len(found) == 1:
            return self._differ(_and(found[0].engines), found, found[0].engines)
        return self._differ("; ".join(_and(one.engines) for one in found), found, self.engines)

    def _differ(self, who: str, found: Sequence[Disagreement], engines: Sequence[str]) -> str:
        names = [name for name in ("walked", *JUDGED) if any(name in one.metrics for one in found)]
        what = "; ".join(f"{name.replace('_', ' ')} {self._of(name, engines)}" for name in names)
        at = min((one.parted_at for one in found), key=lambda at: math.inf if math.isnan(at) else at)
        when = "although the first walkers stay together" if math.isnan(at) else f"from {at:.2f} s on"
        return f"differ: {who}, in {what}, {when}"

    def _of(self, name: str, engines: Sequence[str]) -> str:
        if name == "walked":
            return _and([f"{self.results[e]['summary'][name]} of {len(self.runs[e])} in {e}" for e in engines])
        return _and([f"{METRICS[name].text(self.results[e]['summary'][name])} in {e}" for e in engines])


def _and(words: Sequence[str]) -> str:
    return " and ".join(filter(None, (", ".join(words[:-1]), words[-1])))


def spread(values: Sequence[float]) -> float:
    """Range of values relative to the largest; nan where one is none, or where all are only rounding."""
    largest = max(map(abs, values))
    return (max(values) - min(values)) / largest if largest > 1e-9 and all(map(math.isfinite, values)) else math.nan


def apart(one: Trajectory, other: Trajectory) -> np.ndarray:
    """(n,) [m] by which base, joints of the legs and end of the trunk of two walkers differ most while both are up."""
    n = min(len(one), len(other))
    places = (np.concatenate([t.base[:n, None, :3], t.figure[:n]], axis=1) for t in (one, other))
    return np.abs(np.subtract(*places)).max(axis=(1, 2))


def parted_at(one: Trajectory, other: Trajectory) -> float:
    """The time [s] at which two walkers first differ by `PARTED`; nan if they never do while both are up."""
    far = apart(one, other) > PARTED
    return float(one.time[np.argmax(far)]) if far.any() else math.nan


def compare(name: str, title: str, changes: Sequence[str], jobs: Jobs, engines: Sequence[str] = DEFAULT) -> Comparison:
    """Runs a scenario in several engines.

    Args:
        name: Name or path of the scenario.
        title: What to call it.
        changes: `--set` changes.
        jobs: Number of processes, or a cluster.
        engines: Names of at least two engines.

    Raises:
        InputError: It cannot be run, or not in all of them.
    """
    if len(engines) < 2:
        raise InputError("--engines: expected at least two engines to compare, such as mujoco,home,drake")
    plans, results, first = {engine: in_engine(name, changes, engine) for engine in engines}, {}, {}
    description = ""
    for engine, plan in plans.items():
        description = plan.scenario.description
        if len(plan) == 1:
            first[engine], row = campaign.run_one(plan, 0)
            rows = [row]
        else:
            with campaign.rows_of(plan, range(len(plan)), jobs) as finished:
                rows = sorted(finished, key=lambda row: row.index)
            first[engine] = campaign.run_one(plan, 0)[0]
        results[engine] = result_of(title, plan, rows)
    return Comparison(title, description, plans, results, first)


def in_engine(name: str, changes: Sequence[str], engine: str) -> Plan:
    """The plan of a scenario in an engine; what is wrong with that nobody asked for on the command line."""
    here = f"engine={engine}"
    try:
        return plan_of(name, [*changes, here])
    except InputError as error:
        plan_of(name, changes)  # if it is wrong in any engine, that is said
        raise InputError(f"compare: in the engine '{engine}': {str(error).removeprefix('--set: ')}") from None


OWN = ("comparison.json", "causes.json")


def write(comparison: Comparison, folder: Path) -> None:
    """Writes comparison.json, and the scenario that it is of.

    Args:
        comparison: What to write.
        folder: Where; made if it does not exist.

    Raises:
        InputError: It cannot be written, or something else is there.
    """
    may_fill(folder, "--out", OWN)
    plans = comparison.plans
    files = {
        "comparison.json": dumps(comparison.as_dict(), indent=1),
        "scenario.toml": to_toml(plans.get(MUJOCO, plans[comparison.engines[0]]).scenario),
    }
    write_into(folder, files)
