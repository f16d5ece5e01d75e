"""From a results folder to what is looked at: recordings and figures of its runs, simulated again where needed.

A run is replayed from its scenario and its number, which is exact and cheaper than keeping every trajectory. Except one
of a law of somebody's own: whoever looks at results does not ask for the law to be run, so only what was kept is shown.
"""

from __future__ import annotations

import sys
import zipfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from biped.base.errors import InputError
from biped.base.files import label
from biped.base.text import plain
from biped.ensemble import campaign
from biped.ensemble.plan import Plan
from biped.measure.trajectory import WIDTH, Trajectory
from biped.robot.model import compile_foreign
from biped.scenario.reading import read_scenario, to_toml
from biped.show.words import harmless
from biped.studies.run import newest_recording, results_at

FALLEN = 3
"""Most runs that fell shown in one recording."""

DRAWN = 100
"""Most runs drawn in one figure."""


def chosen(rows: Sequence[Mapping[str, Any]]) -> list[tuple[str, int]]:
    """Runs worth looking at: (what, index).

    The fastest walker, the median one, up to three that fell, and one that did neither.
    """
    if len(rows) == 1:
        return [("run", rows[0]["index"])]
    walkers = sorted((row for row in rows if row["walked"]), key=lambda row: row["speed"])
    picked = []
    if walkers:
        picked.append(("best", walkers[-1]["index"]))
    if len(walkers) > 2:
        picked.append(("median", walkers[len(walkers) // 2]["index"]))
    fallen = [row["index"] for row in rows if row["fell"]][:FALLEN]
    others = [row for row in rows if not row["fell"] and not row["walked"]][:1]
    return [
        *picked,
        *((f"fell_{index}", index) for index in fallen),
        *(("stood" if row["end"] == "completed" else row["end"], row["index"]) for row in others),
    ]


def record_runs(path: Path, plan: Plan, result: Mapping[str, Any], known: Mapping[int, Trajectory]) -> None:
    """Writes one recording of the runs worth looking at, simulating those whose trajectory is not known.

    Args:
        path: The .rrd file.
        plan: The ensemble.
        result: Its result object.
        known: Trajectories that need not be simulated again, by run number.
    """
    runs = {index: known[index] if index in known else campaign.simulate(plan.run(index))
            for _, index in chosen(result["runs"])}  # fmt: skip
    _record(path, plan, result, runs)


def _record(path: Path, plan: Plan, result: Mapping[str, Any], runs: Mapping[int, Trajectory]) -> None:
    """Writes a recording of those of the chosen runs whose trajectory is there."""
    from biped.show.recording import Recorded, record

    model = compile_foreign(plan.model, plan.scenario, visuals=True).model
    text = to_toml(plan.scenario)
    rows = {row["index"]: row for row in result["runs"]}
    checks = [tuple(check.values()) for check in result["checks"]]
    title, alone = result["scenario"], len(rows) == 1
    shown = [
        Recorded(
            name=title.replace("/", "-") if alone else name,
            title=title if alone else f"{title}, run {index}",
            trajectory=runs[index],
            model=model,
            metrics=rows[index],
            checks=checks,
            scenario_text=text,
        )
        for name, index in chosen(result["runs"])
        if index in runs
    ]
    record(path, shown, title=result["scenario"])


def _loaded(path: Path) -> Trajectory:
    """A kept trajectory, which may be anybody's file.

    Raises:
        InputError: It is none, or would take more memory than it has bytes.
    """
    try:
        with zipfile.ZipFile(path) as whole:
            packed = [part.filename for part in whole.infolist() if part.compress_type != zipfile.ZIP_STORED]
        if packed:
            raise InputError(f"{path}: not a trajectory: {plain(packed[0])} is compressed")
        trajectory = Trajectory.load(path)
        log = trajectory.log
        if len(log) == 0 or log.shape[1] != WIDTH or log.dtype != float or not trajectory.tick > 0.0:
            raise InputError(f"{path}: not a trajectory: expected rows of {WIDTH} numbers")
    except (zipfile.BadZipFile, OSError, TypeError, ValueError, KeyError, RecursionError) as error:
        raise InputError(f"{path}: not a trajectory: {str(error)[:200]}") from None
    return trajectory


class Kept:
    """What a results folder kept, and what can be made again of it without running anybody's law.

    Args:
        folder: The results folder.

    Attributes:
        plan: The plan of its scenario.
        result: Its result object.

    Raises:
        InputError: It is no results folder.
    """

    def __init__(self, folder: Path):
        self._folder = folder
        self.result = harmless(results_at(folder))
        self.plan = Plan(read_scenario(str(folder / "scenario.toml"), looking=True))

    def trajectory(self, index: int) -> Trajectory | None:
        """The trajectory of a run: kept, or made again; None of a law's run that was not kept.

        Of a run of a campaign that fell, only the last seconds were kept.
        """
        rows = self.result["runs"]
        whole, ending = self._folder / "trajectory.npz", self._folder / "failures" / f"run-{index:05d}.npz"
        if len(rows) == 1 and whole.is_file():
            return _loaded(whole)
        if self.plan.scenario.law is None:
            return campaign.simulate(self.plan.run(index))
        return _loaded(ending) if ending.is_file() else None

    def again(self, index: int) -> str:
        """What to do to see a law's run that was not kept."""
        return (
            f"{label(self._folder)}: run {index} is of the law {self.plan.scenario.law}, which is not run for a look, "
            f"and its trajectory was not kept; to make it again, if you trust the law: biped run "
            f"{self._folder / 'scenario.toml'} --only {index} --record --trust"
        )


def recording_of(path: Path | None) -> Path:
    """The recording of a results folder, made now if there is none; or the .rrd file itself; or the newest.

    Raises:
        InputError: It is neither, or its runs can only be made again by running somebody's law.
    """
    if path is None:
        return newest_recording()
    if path.suffix == ".rrd":
        if not path.is_file():
            raise InputError(f"view: no recording {path}; expected an .rrd file or a results folder")
        return path
    recording = path / "recording.rrd"
    if not recording.is_file():
        kept = Kept(path)
        picked = [index for _, index in chosen(kept.result["runs"])]
        found = {index: kept.trajectory(index) for index in picked}
        runs = {index: trajectory for index, trajectory in found.items() if trajectory is not None}
        if not runs:
            raise InputError(kept.again(picked[0]))
        _record(recording, kept.plan, kept.result, runs)
    return recording


def plot_results(folder: Path, out: Path | None = None) -> list[Path]:
    """Draws the figures of a results folder; returns the files.

    A single run gets stroboscopic view, velocity, torso angle, phase portraits and, if pushed, the response; a
    campaign its rates, velocities, costs and failures, and the stroboscopic view of its median walker. Velocities are
    left out, with a word, where a law would have to be run for them.

    Args:
        folder: The results folder.
        out: Where the figures go; default: its `figures/`.

    Raises:
        InputError: It is no results folder, or its run can only be made again by running somebody's law.
    """
    kept = Kept(folder)
    from biped.show import figures

    result, rows = kept.result, kept.result["runs"]
    out = folder / "figures" if out is None else out
    if len(rows) == 1:
        trajectory = kept.trajectory(rows[0]["index"])
        if trajectory is None:
            raise InputError(kept.again(rows[0]["index"]))
        return figures.plot_run(trajectory, out, title=result["scenario"], window=kept.plan.scenario.interval)
    files = figures.plot_campaign(rows, result.get("points", []), out, title=result["scenario"])
    if kept.plan.scenario.law is not None:
        print(f"biped: no velocities.png: {kept.again(rows[0]['index'])}", file=sys.stderr)
        return files
    drawn = rows[:: max(1, len(rows) // DRAWN)][:DRAWN]
    trajectories = [campaign.simulate(kept.plan.run(row["index"])) for row in drawn]
    files.append(out / "velocities.png")
    figures.plot_ensemble(trajectories, files[-1], title=result["scenario"])
    return files
