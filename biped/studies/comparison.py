"""The same scenario in both engines: every metric side by side, with its gap, and the time until the walkers part."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from biped.base.errors import InputError
from biped.base.json import dumps
from biped.base.replacing import may_fill
from biped.base.writing import write_into
from biped.ensemble import campaign
from biped.ensemble.backend import Jobs
from biped.ensemble.plan import Plan
from biped.ensemble.results import result_of
from biped.ensemble.rows import LOST, RAISED
from biped.measure.trajectory import Trajectory
from biped.measure.verdict import SOUND
from biped.robot.planar.tree import absolute
from biped.scenario.metrics import METRICS
from biped.scenario.reading import to_toml
from biped.studies.planned import plan_of

ENGINES = ("home", "mujoco")
PARTED = 0.05
"""[m, rad] by which two walkers must differ in one of the nine absolute coordinates to have parted."""


class Comparison(NamedTuple):
    """One scenario in both engines.

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

    def as_dict(self) -> dict[str, Any]:
        """Plain data, as `--json` prints it."""
        rows = [self.results[engine]["runs"] for engine in ENGINES]
        return {
            "scenario": self.scenario,
            "passed": all(
                run["verdict"] == SOUND and run["end"] not in (LOST, RAISED) for runs in rows for run in runs
            ),
            "parted_at": parted_at(*(self.first[engine] for engine in ENGINES)),
            "metrics": self.metrics(),
            "results": self.results,
        }

    def metrics(self) -> dict[str, dict[str, float]]:
        """Every metric: its value in each engine, the gap between them, and the thesis's number where it has one."""
        home, foreign = (self.results[engine]["summary"] for engine in ENGINES)
        thesis = self.results["home"]["thesis"]
        return {
            name: {
                "home": home[name],
                "mujoco": foreign[name],
                "gap": gap(home[name], foreign[name]),
                **({"thesis": thesis[name]} if name in thesis else {}),
            }
            for name in METRICS
        }


def gap(home: float, foreign: float) -> float:
    """Relative difference (foreign - home) / |home|; nan where home has only rounding to divide by."""
    return (foreign - home) / abs(home) if abs(home) > 1e-9 else math.nan


def parted_at(home: Trajectory, foreign: Trajectory) -> float:
    """The time [s] at which two walkers first differ by `PARTED`; nan if they never do while both are up."""
    n = min(len(home), len(foreign))
    apart = np.abs(absolute(home.q[:n]) - absolute(foreign.q[:n])).max(axis=1) > PARTED
    return float(home.time[np.argmax(apart)]) if apart.any() else math.nan


def compare(name: str, title: str, changes: Sequence[str], jobs: Jobs) -> Comparison:
    """Runs a scenario in both engines.

    Args:
        name: Name or path of the scenario.
        title: What to call it.
        changes: `--set` changes.
        jobs: Number of processes, or a cluster.

    Raises:
        InputError: It cannot be run, or not in both engines.
    """
    plans, results, first = {engine: _in_engine(name, changes, engine) for engine in ENGINES}, {}, {}
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


def _in_engine(name: str, changes: Sequence[str], engine: str) -> Plan:
    """The plan of a scenario in an engine; what is wrong with that nobody asked for on the command line."""
    here = f"engine={engine}"
    try:
        return plan_of(name, [*changes, here])
    except InputError as error:
        plan_of(name, changes)  # if it is wrong in any engine, that is said
        raise InputError(f"compare: in the engine '{engine}': {str(error).removeprefix('--set: ')}") from None


OWN = ("comparison.json",)


def write(comparison: Comparison, folder: Path) -> None:
    """Writes comparison.json, and the scenario that it is of.

    Args:
        comparison: What to write.
        folder: Where; made if it does not exist.

    Raises:
        InputError: It cannot be written, or something else is there.
    """
    may_fill(folder, "--out", OWN)
    files = {
        "comparison.json": dumps(comparison.as_dict(), indent=1),
        "scenario.toml": to_toml(comparison.plans["mujoco"].scenario),
    }
    write_into(folder, files)
