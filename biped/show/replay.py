"""From a results folder to what is looked at: recordings and figures of its runs, simulated again where needed."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from biped.base.errors import InputError
from biped.ensemble import campaign
from biped.ensemble.plan import Plan
from biped.measure.trajectory import Trajectory
from biped.robot.model import compile_foreign
from biped.scenario.reading import to_toml
from biped.show.kept import Kept
from biped.studies.run import newest_recording

FALLEN = 3
"""Most runs that fell shown in one recording."""

DRAWN = 8
"""Most runs that stayed up drawn in one figure: each is made again, and figures are a matter of seconds."""
FELL = 60
"""Most runs that fell drawn in one figure: their last seconds were kept."""


def chosen(rows: Sequence[Mapping[str, Any]]) -> list[tuple[str, int]]:
    """Runs worth looking at: (what, index).

    The fastest walker, the median one, up to three that did not stay up, and one that did without walking.
    """
    if len(rows) == 1:
        return [("run", rows[0]["index"])]
    walkers = sorted((row for row in rows if row["walked"]), key=lambda row: row["speed"])
    picked = []
    if walkers:
        picked.append(("best", walkers[-1]["index"]))
    if len(walkers) > 2:
        picked.append(("median", walkers[len(walkers) // 2]["index"]))
    fallen = [("fell" if row["fell"] else "doubtful", row["index"]) for row in rows if row["end"] != "completed"]
    still = [("stayed_up", row["index"]) for row in rows if row["end"] == "completed" and not row["walked"]]
    return picked + [(f"{how}_{index}", index) for how, index in (*fallen[:FALLEN], *still[:1])]


def spread(rows: Sequence[Any], most: int) -> list[Any]:
    """At most so many of the rows, evenly spread over all of them."""
    count = min(most, len(rows))
    return [rows[i * len(rows) // count] for i in range(count)]


def record_runs(path: Path, plan: Plan, result: Mapping[str, Any], known: Mapping[int, Trajectory]) -> None:
    """Writes one recording of the runs worth looking at, simulating those whose trajectory is not known.

    Args:
        path: The .rrd file.
        plan: The ensemble.
        result: Its result object.
        known: Trajectories that need not be simulated again, by run number.
    """
    runs = {index: known[index] if index in known else campaign.run_one(plan, index)[0]
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
    trajectories = _drawn(kept)
    files.append(out / "velocities.png")
    title = f"{result['scenario']}: {result['summary']['walked']} of {len(rows)} walked"
    if len(trajectories) < len(rows):
        stood = sum(t.end == "completed" for t in trajectories)
        title += f" ({stood} of those that stayed up and the last seconds of {len(trajectories) - stood} others drawn)"
    figures.plot_ensemble(trajectories, files[-1], title=title)
    return files


def _drawn(kept: Kept) -> list[Trajectory]:
    """Some of the runs that stayed up, from the slowest to the fastest, and what was kept of those that did not."""
    rows = kept.result["runs"]
    up = sorted((row for row in rows if row["end"] == "completed"), key=lambda row: row["speed"] or 0.0)
    down = [row for row in rows if row["end"] != "completed"]
    found = [campaign.simulate(kept.plan.run(row["index"])) for row in spread(up, DRAWN)]
    ends = [kept.ending(row["index"]) for row in spread(down, FELL)]
    shown = found + [end for end in ends if end is not None]
    return shown or [campaign.simulate(kept.plan.run(rows[0]["index"]))]
