"""From a results folder to what is looked at: recordings, figures and a report of its runs.

Runs are simulated again where needed.
"""

import sys
from collections.abc import Collection, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from biped.base.errors import InputError
from biped.base.files import is_file
from biped.base.writing import Kind, may_add, may_write, write_text
from biped.control.planar.setup import believed_forces
from biped.ensemble import campaign
from biped.ensemble.columns import StoredRows, batches, smallest
from biped.ensemble.guard import numbered
from biped.ensemble.plan import Plan
from biped.measure.trajectory import Trajectory
from biped.scenario.keys import Scenario
from biped.scenario.laws import own_law
from biped.scenario.reading import read_scenario, to_toml
from biped.scenario.vary import points_of
from biped.show.document import Block, Heading, Line, Picture, Words, harmless, markdown
from biped.show.results import document_of
from biped.show.results_folder import ResultsFolder
from biped.studies.folders import newest_recording, results_at, writing

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
    picked, count = [], sum(int(columns["walked"].sum()) for columns in batches(rows, ["walked"]))
    if count:
        picked.append(("best", _walker(rows, count - 1)))
    if count > 2:
        picked.append(("median", _walker(rows, count // 2)))
    fallen: list[tuple[str, int]] = []
    still: list[tuple[str, int]] = []
    for columns in batches(rows, ("index", "end", "walked")):
        up = columns["end"] == "completed"
        for place in np.flatnonzero(~up)[: FALLEN - len(fallen)]:
            fallen.append((str(columns["end"][place]), int(columns["index"][place])))
        for place in np.flatnonzero(up & ~columns["walked"])[: 1 - len(still)]:
            still.append(("stayed_up", int(columns["index"][place])))
    return picked + [(f"{how}_{index}", index) for how, index in (*fallen, *still)]


def _walker(rows: Sequence[Mapping[str, Any]], rank: int) -> int:
    """The number of the run that so many slower walkers precede; of equally fast ones, the first go before."""

    def speeds() -> Iterator[np.ndarray]:
        return (columns["speed"][columns["walked"]] for columns in batches(rows, ("walked", "speed")))

    speed = smallest(speeds, rank)
    rank -= sum(int((piece < speed).sum()) for piece in speeds())
    for columns in batches(rows, ("index", "walked", "speed")):
        alike = columns["index"][columns["walked"] & (columns["speed"] == speed)]
        if rank < alike.size:
            return int(alike[rank])
        rank -= alike.size
    raise AssertionError


def spread(rows: Sequence[Mapping[str, Any]], most: int) -> list[int]:
    """Numbers of at most so many of the runs, evenly spread over all of them."""
    return _some(np.concatenate([columns["index"] for columns in batches(rows, ["index"])]).tolist(), most)


def of_numbers(rows: Sequence[Mapping[str, Any]], numbers: Collection[int]) -> dict[int, Mapping[str, Any]]:
    """The rows of some runs, by their numbers."""
    if isinstance(rows, StoredRows):
        return {row["index"]: row for row in rows.of(numbers)}
    found, at = {}, 0
    for columns in batches(rows, ["index"]):
        for place in np.flatnonzero(np.isin(columns["index"], list(numbers))):
            found[int(columns["index"][place])] = rows[at + int(place)]
        at += columns["index"].size
    return found


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

    model = plan.visual_model
    text = to_toml(plan.scenario)
    rows = result["runs"]
    checks = [dict(check) for check in result["checks"]]
    title, alone = result["scenario"], len(rows) == 1
    picked = chosen(rows)
    metrics = of_numbers(rows, {index for _, index in picked})
    shown = [
        Recorded(
            name=title.replace("/", "-") if alone else name,
            title=title if alone else f"{title}, run {index}",
            trajectory=runs[index],
            model=model,
            metrics=metrics[index],
            checks=checks,
            scenario_text=text,
            believed=partial(believed_forces, plan.run(index)),
        )
        for name, index in picked
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
        if not is_file(path):
            raise InputError(f"view: no recording {path}; expected an .rrd file or a results folder")
        return path
    recording = path / "recording.rrd"
    if not is_file(recording):
        kept = ResultsFolder(path)
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
    kept = ResultsFolder(folder)
    from biped.show import figures

    result, rows = kept.result, kept.result["runs"]
    out = folder / "figures" if out is None else out
    if len(rows) == 1:
        trajectory = kept.trajectory(rows[0]["index"])
        if trajectory is None:
            raise InputError(kept.again(rows[0]["index"]))
        return figures.plot_run(trajectory, out, title=result["scenario"], window=kept.plan.scenario.interval)
    files = figures.plot_campaign(rows, result.get("points", []), out, title=result["scenario"])
    if own_law(kept.plan.scenario.law):
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


def _drawn(kept: ResultsFolder) -> list[Trajectory]:
    """Some of the runs that stayed up, and what was kept of those that did not."""
    rows = kept.result["runs"]
    up, down = [], []
    for columns in batches(rows, ("index", "end")):
        stood = columns["end"] == "completed"
        up += columns["index"][stood].tolist()
        down += columns["index"][~stood].tolist()
    found = [campaign.simulate(kept.plan.run(index)) for index in _some(up, DRAWN)]
    ends = [kept.ending(index) for index in _some(down, FELL)]
    shown = found + [end for end in ends if end is not None]
    return shown or [campaign.simulate(kept.plan.run(rows[0]["index"]))]


def _some(numbers: Sequence[int], most: int) -> list[int]:
    """At most so many numbers, evenly spread."""
    count = min(most, len(numbers))
    return [numbers[i * len(numbers) // count] for i in range(count)]


MARK = "<!-- written by biped report -->"
KIND = Kind("a report of biped", (".md", ".markdown"), (MARK.encode(),))


def write_report(folders: Sequence[Path], out: Path, title: str) -> None:
    """Writes a report of results folders, its figures in a folder beside it.

    Args:
        folders: Results folders.
        out: The Markdown file; figures go to a folder of the same name without suffix.
        title: First heading.

    Raises:
        InputError: A folder holds no results, the report cannot be written, or something else is there.
    """
    may_write(out, "--out", KIND)
    blocks: list[Block] = [Heading(title, 1)]
    taken: set[Path] = set()
    for folder in folders:
        result = harmless(results_at(folder))
        scenario = read_scenario(str(folder / "scenario.toml"), looking=True)
        beside = next(path for path in numbered(out.with_suffix(""), folder.resolve().name) if path not in taken)
        taken.add(beside)
        may_add(beside, "--out")
        figures = plot_results(folder, beside)
        drawn = [figure.relative_to(out.parent) for figure in figures]
        blocks += document_of(
            result, scenario.description, _setting(result, scenario, _command(folder, result, scenario))
        )
        blocks += [Picture(figure.stem, figure) for figure in drawn]
    with writing(f"--out {out}"):
        write_text(out, f"{markdown(tuple(blocks))}\n{MARK}\n")


def _command(folder: Path, result: Mapping[str, Any], scenario: Scenario) -> str:
    """The command that repeats a folder's runs: by the scenario's name only if that alone gives the same."""
    try:
        plan = Plan(read_scenario(result["scenario"], looking=True), checked=True)
        name = result["scenario"] if plan.scenario == Plan(scenario, checked=True).scenario else ""
    except InputError:
        name = ""
    runs = result["runs"]
    several = scenario.randomise.runs * len(points_of(scenario)) > 1
    only = f" --only {runs[0]['index']}" if several and len(runs) == 1 else ""
    trust = " --trust" if own_law(scenario.law) else ""
    return f"biped run {name or folder / 'scenario.toml'}{only}{trust}"


def _setting(result: Mapping[str, Any], scenario: Scenario, command: str) -> Line:
    """How runs were made, in a line."""
    start = scenario.start
    starts = "projected onto the ground" if start.settle else "as printed"
    return (Words(command, "code"), f": {len(result['runs'])} × {scenario.duration:g} s, jitter {start.jitter:g} rad, "
            f"contacts {scenario.actuation.contacts}, starts {starts}")  # fmt: skip
