"""From a results folder to what is looked at: recordings and figures of its runs, simulated again where needed.

A run is replayed from its scenario and its number, which is exact and cheaper than keeping every trajectory.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from biped.base.errors import InputError
from biped.ensemble import campaign
from biped.ensemble.plan import Plan
from biped.measure.trajectory import Trajectory
from biped.robot.model import compile_foreign
from biped.scenario.reading import read_scenario, to_toml
from biped.studies.run import newest_recording, results_at

FALLEN = 3
"""Most runs that fell shown in one recording."""

DRAWN = 100
"""Most runs drawn in one figure."""


def chosen(rows: Sequence[Mapping[str, Any]]) -> list[tuple[str, int]]:
    """Runs worth looking at: the fastest walker, the median one, up to three that did not stay up: (what, index)."""
    if len(rows) == 1:
        return [("run", rows[0]["index"])]
    walkers = sorted((row for row in rows if row["walked"]), key=lambda row: row["speed"])
    picked = []
    if walkers:
        picked.append(("best", walkers[-1]["index"]))
    if len(walkers) > 2:
        picked.append(("median", walkers[len(walkers) // 2]["index"]))
    fallen = [("fell" if row["fell"] else "doubtful", row["index"]) for row in rows if row["end"] != "completed"]
    return picked + [(f"{how}_{index}", index) for how, index in fallen[:FALLEN]]


def spread(rows: Sequence[Any], most: int) -> list[Any]:
    """At most so many of the rows, evenly spread over all of them."""
    count = min(most, len(rows))
    return [rows[i * len(rows) // count] for i in range(count)]


def record_runs(path: Path, plan: Plan, result: Mapping[str, Any], known: Mapping[int, Trajectory]) -> None:
    """Writes one recording of the runs worth looking at.

    Args:
        path: The .rrd file.
        plan: The ensemble.
        result: Its result object.
        known: Trajectories that need not be simulated again, by run number.
    """
    from biped.show.recording import Recorded, record

    model = compile_foreign(plan.model, plan.scenario, visuals=True).model
    text = to_toml(plan.scenario)
    rows = {row["index"]: row for row in result["runs"]}
    checks = [tuple(check.values()) for check in result["checks"]]
    shown = [
        Recorded(
            name=name,
            trajectory=known[index] if index in known else campaign.run_one(plan, index)[0],
            model=model,
            metrics=rows[index],
            checks=checks,
            scenario_text=text,
        )
        for name, index in chosen(result["runs"])
    ]
    record(path, shown, title=result["scenario"])


def plan_at(folder: Path) -> tuple[Plan, dict[str, Any]]:
    """The plan and the result object of a results folder."""
    from biped.ensemble.stored import of_plan

    result = results_at(folder)
    plan = Plan(read_scenario(str(folder / "scenario.toml")))
    of_plan(folder, plan, result)
    return plan, result


def recording_of(path: Path | None) -> Path:
    """The recording of a results folder, made now if there is none; or the .rrd file itself; or the newest.

    Raises:
        InputError: It is neither.
    """
    if path is None:
        return newest_recording()
    if path.suffix == ".rrd":
        if not path.is_file():
            raise InputError(f"view: no recording {path}; expected an .rrd file or a results folder")
        return path
    recording = path / "recording.rrd"
    if not recording.is_file():
        plan, result = plan_at(path)
        record_runs(recording, plan, result, _kept(path, result))
    return recording


def _kept(folder: Path, result: Mapping[str, Any]) -> dict[int, Trajectory]:
    file = folder / "trajectory.npz"
    if not file.is_file() or len(result["runs"]) > 1:
        return {}
    return {result["runs"][0]["index"]: Trajectory.load(file)}


def plot_results(folder: Path, out: Path | None = None) -> list[Path]:
    """Draws the figures of a results folder; returns the files.

    A single run gets stroboscopic view, velocity, torso angle, phase portraits and, if pushed, the response; a
    campaign its rates, velocities, costs and failures, and the stroboscopic view of its median walker.

    Args:
        folder: The results folder.
        out: Where the figures go; default: its `figures/`.
    """
    plan, result = plan_at(folder)
    from biped.show import figures

    kept = _kept(folder, result)
    out = folder / "figures" if out is None else out
    rows = result["runs"]
    if len(rows) == 1:
        trajectory = kept[rows[0]["index"]] if kept else campaign.run_one(plan, rows[0]["index"])[0]
        return figures.plot_run(trajectory, out, title=result["scenario"], window=plan.scenario.interval)
    files = figures.plot_campaign(rows, result.get("points", []), out, title=result["scenario"])
    trajectories = [campaign.run_one(plan, row["index"])[0] for row in spread(rows, DRAWN)]
    files.append(out / "velocities.png")
    title = f"{result['scenario']}: {result['summary']['walked']} of {len(rows)} walked"
    if len(trajectories) < len(rows):
        title += f" ({len(trajectories)} drawn)"
    figures.plot_ensemble(trajectories, files[-1], title=title)
    return files
