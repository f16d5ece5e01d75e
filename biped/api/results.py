"""Results as Python has them: of runs, of a comparison of two results, and of one of engines."""

from __future__ import annotations

import tempfile
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from biped.base.errors import InputError
from biped.ensemble import campaign
from biped.ensemble.checks import judgement
from biped.ensemble.columns import StoredRows, batches
from biped.ensemble.results import table_of
from biped.studies import comparison
from biped.studies.diff import Difference as FoundDifference
from biped.studies.run import ScenarioResult, save

if TYPE_CHECKING:
    import pyarrow

    from biped.measure.trajectory import Trajectory


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
        from biped.show.viewer import open_viewer

        open_viewer(self.record(Path(tempfile.mkdtemp(prefix="biped-")) / "recording.rrd"))


class Differed:
    """The change from one result to another, run by run of the same seeds.

    Args:
        found: As from `biped.studies.diff`.

    Attributes:
        passed: Whether nothing became worse.
        worse: Names of the metrics that did.
        worst: The run to look at, with its seed, its outcome and the command that makes it again; None: there is none.
    """

    def __init__(self, found: FoundDifference):
        self._found = found
        self.passed: bool = found.passed
        self.worse: list[str] = found.worse
        self.worst: dict[str, Any] | None = found.worst_as_dict()

    def __repr__(self) -> str:
        from biped.show.comparisons import headline

        return f"<{len(self._found.pairs)} pairs of runs: {headline(self._found)}>"

    def _repr_html_(self) -> str:
        """Its verdict and every metric as a table, which a notebook shows below the cell."""
        from biped.show.comparisons import difference_document
        from biped.show.page.html import blocks, join

        return str(join(blocks(difference_document(self._found))))

    @cached_property
    def metrics(self) -> pyarrow.Table:
        """A row per metric: its value in both, the change with its interval, and the verdict."""
        rows = self._found.as_dict()["metrics"]
        flat = [
            {"metric": name, "low": row["interval"][0], "high": row["interval"][1], **row} for name, row in rows.items()
        ]
        return table_of([{key: value for key, value in row.items() if key != "interval"} for row in flat])


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
        from biped.show.comparisons import draw

        comparison.write(self._found, Path(folder))
        draw(self._found, Path(folder))
        return Path(folder)

    def show(self) -> None:
        """Opens a recording in the rerun viewer: MuJoCo's walker, and those of the other engines as ghosts."""
        from biped.show.viewer import open_viewer

        open_viewer(self.save(tempfile.mkdtemp(prefix="biped-")) / "recording.rrd")
