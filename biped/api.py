"""biped from Python: load, run, sweep and compare scenarios; what comes back is data with names and units.

    import biped

    result = biped.run("level_fast", **{"ground.slope": 2, "randomise.runs": 50})
    result.summary["speed"]            # m/s
    result.runs.to_pandas()            # one row per run (an Arrow table)
    result.trajectory.u                # (n, 6) joint torques [N m] of the first run
    result.show()                      # in the rerun viewer

Changes are keys of the scenario with Python's values, as after `--set`; see docs/scenarios.md.
"""

from __future__ import annotations

import logging
import tempfile
from collections.abc import Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from biped.base.errors import InputError
from biped.base.progress import Progress, silent
from biped.ensemble import campaign
from biped.ensemble.checks import judgement
from biped.ensemble.columns import StoredRows, batches
from biped.ensemble.results import table_of
from biped.robot.law_factory import Factory, factory_of
from biped.scenario.inline import setting
from biped.scenario.keys import Scenario
from biped.studies import comparison
from biped.studies.diff import study
from biped.studies.making import ScenarioResult
from biped.studies.planned import plan_of, title_of
from biped.studies.run import run_plan, save

if TYPE_CHECKING:
    import pyarrow

    from biped.measure.trajectory import Trajectory


_tell = logging.getLogger("biped").warning


class Loaded(NamedTuple):
    """A scenario that can be run as it is or changed further.

    Attributes:
        name: What it was loaded by: a name in scenarios/ or a path.
        changes: What was changed, as after `--set`.
        law: The control law given as a Python object; None: the scenario's own.
    """

    name: str
    changes: tuple[str, ...]
    law: Factory | None

    @property
    def scenario(self) -> Scenario:
        """Every key with its value; gains are written out."""
        return plan_of(self.name, self.changes, self.law).scenario

    def changed(self, **changes: Any) -> Loaded:
        """The same scenario with more changes."""
        return self._replace(changes=(*self.changes, *(setting(key, value) for key, value in changes.items())))


def load(name: str | Path | Loaded, *, law: Any = None, **changes: Any) -> Loaded:
    """Reads, changes and checks a scenario.

    Args:
        name: Name in scenarios/, or path of a scenario file.
        law: A control law: `path.py:Class`, or a Python object. That is a class or function called with a `Setup`
            before every run, or an instance, of which every run gets a copy (`biped.control.planar.user`).
        **changes: Keys with their values, e.g. `**{"ground.slope": 2}`.

    Raises:
        InputError: Something in it cannot be used.
    """
    found = name if isinstance(name, Loaded) else Loaded(str(name), (), None)
    found = found.changed(**changes)
    if isinstance(law, str):
        found = found.changed(law=law)
    elif law is not None:
        found = found._replace(law=factory_of(law))
    plan_of(found.name, found.changes, found.law)  # complaints come now
    return found


class Result:
    """The result of a scenario's runs.

    Args:
        done: As from `biped.studies.run`.

    Attributes:
        scenario: The scenario as run, every key written out.
        passed: Whether all its expectations hold; None if nothing was expected, or if there are too few runs to tell.
        summary: Means over the runs by metric, with counts and intervals; names and units in docs/scenarios.md.
        checks: Every expectation: name, value, expected, passed, why.
        points: Of a sweep, an entry per point; else empty.
        thresholds: Of a sweep, where walking ends; else empty.
    """

    def __init__(self, done: ScenarioResult):
        self._done = done
        self.scenario = done.plan.scenario
        self.passed: bool | None = done.result["passed"]
        self.summary: dict[str, Any] = done.result["summary"]
        self.checks: list[dict[str, Any]] = done.result["checks"]
        self.points: list[dict[str, Any]] = done.result.get("points", [])
        self.thresholds: list[dict[str, Any]] = done.result.get("thresholds", [])
        self._trajectories = dict(done.trajectories)

    def __repr__(self) -> str:
        s, count = self.summary, len(self._done.result["runs"])
        return (f"<{self._done.result['scenario']} in {self.scenario.engine}: {s['walked']:.0f} of {count} walked, "
                f"{s['speed']:.3g} m/s, {judgement(self._done.result)}>")  # fmt: skip

    def _repr_html_(self) -> str:
        """Its verdict, metrics and checks as a table, which a notebook shows below the cell."""
        from biped.show.page.html import blocks, join
        from biped.show.results import document_of

        return str(join(blocks(document_of(self._done.result, self.scenario.description))))

    @cached_property
    def runs(self) -> pyarrow.Table:
        """One row per run with every metric, as runs.parquet has it; `.to_pandas()` where pandas is installed."""
        runs = self._done.result["runs"]
        return runs.table() if isinstance(runs, StoredRows) else table_of(runs)

    @property
    def trajectory(self) -> Trajectory:
        """Of the first run: arrays by name, `q`, `v`, `u`, `force` and more, with their `units`."""
        return self.replay(self._done.result["runs"][0]["index"])

    def replay(self, index: int) -> Trajectory:
        """The trajectory of a run of the ensemble, simulated again if it was not kept: the same to the last bit.

        Raises:
            InputError: There is no such run.
        """
        if index not in self._trajectories:
            known = [columns["index"] for columns in batches(self._done.result["runs"], ["index"])]
            if not any(index in numbers for numbers in known):
                low, high = min(int(some.min()) for some in known), max(int(some.max()) for some in known)
                raise InputError(f"run {index}: expected the number of a run, {low} … {high}")
            self._trajectories[index] = campaign.simulate(self._done.plan.run(index))
        return self._trajectories[index]

    def save(self, folder: str | Path) -> Path:
        """Writes the results folder that `biped run` writes; returns it.

        Raises:
            InputError: The folder holds something else, or cannot be written.
        """
        return save(self._done, Path(folder))

    def record(self, path: str | Path) -> Path:
        """Writes a recording for the rerun viewer: the run, or of an ensemble those worth looking at.

        Raises:
            InputError: It cannot be written.
        """
        from biped.show.replay import record_runs

        record_runs(Path(path), self._done.plan, self._done.result, self._trajectories)
        return Path(path)

    def report(self, path: str | Path, title: str = "Does it walk?") -> Path:
        """Writes the HTML page that `biped report --html` writes; returns it.

        Raises:
            InputError: It cannot be written.
        """
        from biped.show.page import write_page

        with tempfile.TemporaryDirectory(prefix="biped-") as folder:
            write_page([self.save(Path(folder) / "result")], Path(path), title)
        return Path(path)

    def video(self, path: str | Path, only: int | None = None, **cut: Any) -> Path:
        """Writes a clip, *.mp4 or *.gif; returns it.

        Args:
            path: The file.
            only: Number of the run; default: the walker of median speed.
            **cut: As in `biped.show.film.Cut`: `width`, `start`, `end`, `slow`, `eye` and more.

        Raises:
            InputError: Nothing here can draw or encode, or the file cannot be written.
        """
        from biped.show.film import Cut, film

        with tempfile.TemporaryDirectory(prefix="biped-") as folder:
            film([self.save(Path(folder) / "result")], Path(path), Cut(**cut), only)
        return Path(path)

    def show(self) -> None:
        """Opens the recording in the rerun viewer; in a notebook with `rerun-notebook`, below the cell."""
        from biped.show.recording.viewer import open_viewer

        open_viewer(self.record(Path(tempfile.mkdtemp(prefix="biped-")) / "recording.rrd"))


def run(
    name: str | Path | Loaded,
    *,
    law: Any = None,
    jobs: int | None = None,
    cluster: str | None = None,
    progress: Progress = silent,
    **changes: Any,
) -> Result:
    """Runs a scenario, a single run or an ensemble; nothing is written.

    Args:
        name: Name, path, or as from `load`.
        law: See `load`.
        jobs: Number of processes of an ensemble; default: all cores.
        cluster: Workers elsewhere instead, as after `--cluster`: a Dask scheduler's address, `local:N`, or a file.
        progress: Told of every finished run (`biped.base.progress`).
        **changes: See `load`.

    Raises:
        InputError: Something cannot be used.
        RunError: A run could not be carried out.
    """
    loaded = load(name, law=law, **changes)
    plan = plan_of(loaded.name, loaded.changes, loaded.law)
    with campaign.workers_at(jobs, cluster, False, _tell) as workers:
        return Result(run_plan(title_of(loaded.name), plan, workers, progress))


def check(name: str | Path | Loaded, **arguments: Any) -> Result:
    """Runs a scenario that expects something; `passed` and `checks` of the result say whether it holds.

    Args:
        name: Name, path, or as from `load`.
        **arguments: As of `run`.

    Raises:
        InputError: Nothing is expected, or something cannot be used.
    """
    law = arguments.get("law")
    keys = {key: value for key, value in arguments.items() if key not in ("law", "jobs", "cluster", "progress")}
    if not load(name, law=law, **keys).scenario.expect:
        raise InputError('check: expect: missing; expected bounds of metrics, e.g. expect={"falls": {"max": 0}}')
    return run(name, **arguments)


class Differed:
    """The change from one result to another, run by run of the same seeds.

    Args:
        found: As from `biped.studies.diff`.

    Attributes:
        passed: Whether nothing became worse.
        worse: Names of the metrics that did.
        worst: The run to look at, with its seed, its outcome and the command that makes it again; None: there is none.
    """

    def __init__(self, found: study.Difference):
        self._found = found
        self.passed: bool = found.passed
        self.worse: list[str] = found.worse
        self.worst: dict[str, Any] | None = found.worst_as_dict()

    def __repr__(self) -> str:
        from biped.show.diff import headline

        return f"<{len(self._found.pairs)} pairs of runs: {headline(self._found)}>"

    def _repr_html_(self) -> str:
        """Its verdict and every metric as a table, which a notebook shows below the cell."""
        from biped.show.diff import document_of
        from biped.show.page.html import blocks, join

        return str(join(blocks(document_of(self._found))))

    @cached_property
    def metrics(self) -> pyarrow.Table:
        """A row per metric: its value in both, the change with its interval, and the verdict."""
        rows = self._found.as_dict()["metrics"]
        flat = [
            {"metric": name, "low": row["interval"][0], "high": row["interval"][1], **row} for name, row in rows.items()
        ]
        return table_of([{key: value for key, value in row.items() if key != "interval"} for row in flat])


def diff(
    first: Result | str | Path, second: Result | str | Path, margin: float = study.MARGIN, metrics: Sequence[str] = ()
) -> Differed:
    """Compares two results run by run, paired by seed.

    Args:
        first: The result that is compared with, or its folder.
        second: The one that is judged.
        margin: A change within this share is none that matters.
        metrics: Names of those that are compared; default: all.

    Raises:
        InputError: They have no runs in common, or a metric is unknown.
    """
    with tempfile.TemporaryDirectory(prefix="biped-") as folder:
        folders = [
            one.save(Path(folder) / name) if isinstance(one, Result) else Path(one)
            for one, name in ((first, "first"), (second, "second"))
        ]
        found = study.of_folders(folders[0], folders[1], margin, metrics)
        found.as_dict()  # reads what it needs of the folders
    return Differed(found)


def sweep(
    name: str | Path | Loaded, over: Mapping[str, Sequence[Any]], *, law: Any = None, jobs: int | None = None,
    cluster: str | None = None, progress: Progress = silent, **changes: Any,
) -> Result:  # fmt: skip
    """Runs an ensemble at every combination of values of one or two keys.

    Args:
        name: Name, path, or as from `load`.
        over: Keys with the values that they take, e.g. `{"ground.slope": range(-5, 6)}`.
        law: See `load`.
        jobs: Number of processes; default: all cores.
        cluster: See `run`.
        progress: Told of every finished run.
        **changes: See `load`; `randomise.runs` is the number of runs at every point.

    Returns:
        The result; its `points` and `thresholds` say how the walk changes.
    """
    table = {key: list(values) for key, values in over.items()}
    return run(name, law=law, jobs=jobs, cluster=cluster, progress=progress, **changes, sweep=table)


class Compared:
    """One scenario in several engines.

    Args:
        found: As from `biped.studies.comparison`.

    Attributes:
        passed: Whether no run diverged.
        results: The result object of each engine, by name.
        trajectories: Trajectory of the first run in each engine, by name.
        parted_at: [s] when base or legs of two of the walkers first differ by 0.05 m; nan if they never do.
        verdict: One sentence: whether the engines agree, or who differs, in what, and from when on.
    """

    def __init__(self, found: comparison.Comparison):
        self._found = found
        told = found.as_dict()
        self.passed: bool = told["passed"]
        self.results: dict[str, dict[str, Any]] = found.results
        self.trajectories: dict[str, Trajectory] = found.first
        self.parted_at: float = told["parted_at"]
        self.verdict: str = told["verdict"]

    @cached_property
    def metrics(self) -> pyarrow.Table:
        """A row per metric: its value and interval in each engine, their spread, and the thesis's number if any."""
        return table_of([{"metric": name, "thesis": None, **row} for name, row in self._found.metrics().items()])

    def save(self, folder: str | Path) -> Path:
        """Writes comparison.json, figures and a recording, as `biped compare` does; returns the folder."""
        from biped.show.side_by_side import draw

        comparison.write(self._found, Path(folder))
        draw(self._found, Path(folder))
        return Path(folder)

    def show(self) -> None:
        """Opens a recording in the rerun viewer: MuJoCo's walker, and the last engine's as a ghost."""
        from biped.show.recording.viewer import open_viewer

        open_viewer(self.save(tempfile.mkdtemp(prefix="biped-")) / "recording.rrd")


def compare(
    name: str | Path | Loaded,
    *,
    engines: Sequence[str] = comparison.DEFAULT,
    jobs: int | None = None,
    cluster: str | None = None,
    **changes: Any,
) -> Compared:
    """Runs a scenario in several engines.

    Args:
        name: Name, path, or as from `load`.
        engines: Names of at least two engines.
        jobs: Number of processes of an ensemble; default: all cores.
        cluster: See `run`.
        **changes: See `load`.

    Raises:
        InputError: Something cannot be used.
    """
    loaded = load(name, **changes)
    if loaded.law is not None:
        raise InputError("compare: law: expected in a file (law = 'path.py:Class'), got a Python object")
    with campaign.workers_at(jobs, cluster, False, _tell) as workers:
        return Compared(comparison.compare(loaded.name, title_of(loaded.name), loaded.changes, workers, engines))
