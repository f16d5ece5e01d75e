"""Records of trials, benchmarks, policies and model files as documents."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from biped.base.files import label
from biped.robot.report import ModelReport
from biped.robot.robot import Robot
from biped.show.document import Block, Document, Heading, Items, Kind, Line, Paragraph, Table, Words
from biped.show.results import number
from biped.studies.policy import Check
from biped.studies.policy.trials import CardTrial, Measured

if TYPE_CHECKING:
    from biped.studies.bench.costs import CampaignCost, PolicyCost, StepCost
    from biped.studies.bench.throughput import Guarded, Throughput
    from biped.studies.surveys import SurveyedModel
    from biped.studies.tune.least import Least
    from biped.studies.tune.robot import Trial


def trials_document(trials: Sequence[Trial]) -> Document:
    """How far shipped gaits came on a robot."""
    rows = tuple(
        (one.gait, f"{one.assist:g}", *("  ".join(f"{value:.2f}" if math.isfinite(value) else "–" for value in values)
                                        for values in (one.times, one.distances)))
        for one in trials
    )  # fmt: skip
    heads = ("gait", "Q_d share", "s until it fell, from each posture", "m it came")
    search = (
        "searching from those that came furthest; biped tune takes the search itself too: scenario.toml in its folder"
    )
    return Table(heads, rows), Paragraph(search)


def least_document(found: Least) -> Document:
    """The deviation left at every step of the way back."""
    conditions = list(found.steps[0]["tallies"])
    rows = []
    for step in found.steps:
        values = [f"{step[key]:.4g}" if step["restored"] else "" for key in ("before", "after")]
        tallies = ("/".join(map(str, step["tallies"][name])) for name in conditions)
        rows.append((str(step["changed"]), step["restored"], *values, *tallies))
    table = Table(("changed", "put back", "from", "to", *conditions), tuple(rows), (1,))
    return table, Paragraph(f"results in {label(found.folder)}/")


def throughput_document(measured: Throughput) -> Document:
    """One block per part."""
    units = {
        "tick": "µs a tick (ratios without unit)",
        "home": "µs a tick of the home engine",
        "contacts": "µs of mj_step by points on the ground",
        "campaign": "s of CPU, their ratio to as many bare steps, s by the clock",
        "cold_start": "s of CPU",
    }
    blocks: list[Block] = [Heading(f"loop: {measured.loop}")]
    for part, unit in units.items():
        costs = getattr(measured, part).items()
        blocks.append(Table((part, unit), tuple((str(key), number(value)) for key, value in costs)))
    for title, column, costs in (("scenes", "scene", measured.scenes), ("robots of any kind", "run", measured.robots)):
        if costs is not None:
            blocks += costs_document(title, column, costs)
    if measured.features is not None:
        rows = tuple(
            (name, *(number(price[key]) for key in ("tick", "ratio", "memory")), ", ".join(price["only_imported"]))
            for name, price in measured.features.items()
        )
        blocks.append(Heading("features of a scene, each in a process of its own"))
        blocks.append(Table(("feature", "µs a tick", "x mj_step", "MB", "what only it imports"), rows, (0, 4)))
    return tuple(blocks)


def _costs(cost: Mapping[str, Any]) -> tuple[float, ...]:
    """µs a tick, and ratios."""
    ratio = cost["closed_loop"] / cost["physics"]
    return (*(cost[key] for key in ("physics", "steps", "closed_loop", "metrics")), ratio, cost["with_metrics"],
            cost["strict"])  # fmt: skip


def costs_document(title: str, column: str, costs: Mapping[str, Mapping[str, Any]]) -> Document:
    """Prices of runs beside those of bare steps."""
    heads = (column, "physics", "steps", "loop", "metrics", "loop / physics", "with metrics / physics", "/ steps",
             "ticks are looped over")  # fmt: skip
    rows = tuple((name, *map(number, _costs(cost)), cost["loop"]) for name, cost in costs.items())
    return (
        Heading(f"{title}: µs a tick, and ratios; steps: those in compiled code"),
        Table(heads, rows, (0, len(heads) - 1)),
    )


def walking_document(result: Mapping[str, Any]) -> Document:
    """Every setting with its errors and its cost, and the recommendations."""
    heads = ("setting", "CPU s/s", "error [rad]", "speed", "cost of transport", "lost [J/step]", "depth [mm]", "slip",
             "fell")  # fmt: skip
    rows = tuple(
        (row["label"], f"{row['cpu_per_second']:.4f}", f"{row['error']:.1e}", _percent(row, "speed"),
         _percent(row, "cost_of_transport"), f"{row['loss_per_step']:.2f}", f"{1e3 * row['penetration']:.2f}",
         f"{row['slip']:.4f}", str(row["fell"]))
        for row in result["cases"]
    )  # fmt: skip
    best: list[Line] = [
        (f"{one['engine']}, cheapest within {one['level']:.1%}: ", Words(one["label"] or "none of these", "strong"))
        for one in result["recommended"]
    ]
    words = (f"error after {result['horizon']:g} s against steps of 1/64 ms (median of starts); steady gait against "
             "1/8 ms with 95 % half-width; MuJoCo's by RK4")  # fmt: skip
    return Heading(result["scenario"]), Paragraph(words), Table(heads, rows), Items(tuple(best))


def _percent(row: Mapping[str, Any], metric: str) -> str:
    return f"{100.0 * row[f'{metric}_shift']:+.2f} ± {100.0 * row[f'{metric}_shift_half_width']:.2f} %"


def campaigns_document(costs: Sequence[CampaignCost]) -> Document:
    """The clock's times of processes here and of a cluster, and their ratios."""
    heads = ("runs", "of [s]", "here", "cluster", "cluster / here", "here / CPU of runs over cores",
             "parent [ms a run]", "rows")  # fmt: skip
    rows = tuple(
        (f"{cost.runs}", f"{cost.duration:g}", f"{cost.here:.1f}", f"{cost.cluster:.1f}",
         f"{cost.cluster / cost.here:.3f}", f"{cost.here / cost.work:.3f}", f"{cost.parent:.4f}",
         "the same bytes" if cost.same else Words("DIFFERENT", "bad"))
        for cost in costs
    )  # fmt: skip
    title = "Campaigns, seconds by the clock: processes here; a cluster here with as many workers"
    return Heading(title), Table(heads, rows, (len(heads) - 1,))


def regress_document(guarded: Guarded) -> Document:
    """One line per scenario."""
    from biped.studies.bench.throughput import ELSEWHERE, SAME, SLOWER

    rows = []
    for one in guarded.timed:
        kind: Kind = "good" if one.result in (SAME, ELSEWHERE) else "bad"
        old = (one.old.loop, one.old.metrics) if one.old else (None, None)
        ratios = (f"{new:.2f}" if then is None else f"{then:.2f} → {new:.2f}"
                  for then, new in zip(old, (one.new.loop, one.new.metrics), strict=True))  # fmt: skip
        slower = Words(f"slower by {one.slower:.0%}", "doubt") if one.slower > SLOWER else ""
        rows.append((one.scenario, Words(one.result, kind), *ratios, slower))
    return (Table(("scenario", "result", "closed loop / mj_step", "with metrics", ""), tuple(rows), (0, 1, 2, 3, 4)),)


def policy_document(file: object, cost: PolicyCost) -> Document:
    """Seconds of one core, and ratios to bare steps and network calls."""
    rows = [("bare steps of MuJoCo, from Python", f"{cost.steps:.3f}", ""),
            ("bare calls of the network", f"{cost.network:.3f}", "")]  # fmt: skip
    for name, loop in (("the run", cost.loop), ("the run, logged at the network's calls", cost.sparse)):
        if loop is not None:
            rows.append((name, f"{loop:.3f}", f"{cost.ratio(loop):.2f}"))
    blocks = [Heading(str(file)), Table((f"of {cost.seconds:g} s", "core [s]", "ratio"), tuple(rows))]
    if cost.one is not None and cost.two is not None:
        words = (f"{cost.runs} runs of {cost.seconds:g} s by the clock: {cost.one:.1f} s in one process, "
                 f"{cost.two:.1f} s in two: {cost.two / cost.one:.2f}; of bare steps {cost.bare:.2f}")  # fmt: skip
        blocks.append(Paragraph(words))
    return tuple(blocks)


def engines_document(costs: Mapping[str, StepCost]) -> Document:
    """µs of a step in Drake and in MuJoCo, and their ratios."""
    heads = (
        "a step of",
        "mj_step [µs]",
        "Drake's update [µs]",
        "x mj_step",
        "the engine's step [µs]",
        "x mj_step",
        "MB",
    )
    rows = tuple(
        (kind, f"{cost.mujoco:.1f}", f"{cost.update:.1f}", f"{cost.update / cost.mujoco:.1f}", f"{cost.step:.1f}",
         f"{cost.step / cost.mujoco:.1f}", f"{cost.memory:.0f}")
        for kind, cost in costs.items()
    )  # fmt: skip
    return (Table(heads, rows),)


def checks_document(file: Path, checks: Sequence[Check]) -> Document:
    """Which checks a card passed."""
    rows = tuple(
        (one.name, Words("passed" if one.passed else "FAILED", "good" if one.passed else "bad"), one.words)
        for one in checks
    )
    failed = sum(not one.passed for one in checks)
    words = (f"{failed} of {len(checks)} failed: before the policy, doubt the card (docs/your-policy.md)" if failed
             else "all passed")  # fmt: skip
    return Heading(label(file)), Table(("check", "", "result"), rows, (0, 1, 2)), Paragraph(words)


def faults_document(trials: Sequence[CardTrial]) -> Document:
    """Which injected faults were found, and by what; of several cards in how many."""
    faults, rows = [one for trial in trials for one in trial.faults], []
    for name in dict.fromkeys(one.name for one in faults):
        found = [one.found for one in faults if one.name == name]
        by = dict.fromkeys(one for one in found if one)
        rows.append((name, ", ".join(by) or "–", f"{sum(map(bool, found))} of {len(found)}"))
    alarms = [(trial.card, one) for trial in trials for one in trial.alarms]
    wrong, right = len({(card, one.name) for card, one in alarms}), sum(trial.right for trial in trials)
    return (
        Heading(", ".join(label(Path(trial.card)) for trial in trials)),
        Table(("fault", "found by", "in"), tuple(rows), (0, 1, 2)),
        Paragraph(f"{sum(bool(one.found) for one in faults)} of {len(faults)} found"),
        Items(tuple(f"alarm: {label(Path(card))}, {one.name}: {one.found}" for card, one in alarms)),
        Paragraph(f"{wrong} of {right} right cards raised an alarm"),
    )


def measured_document(file: Path, row: Measured) -> Document:
    """A policy's speed and cost, and what it walks through."""
    rows = (
        (f"speed, {row.asked:g} m/s asked for", f"{row.speed:.3f} m/s" if row.lasted else "fell"),
        ("cost of transport", f"{row.cost:.3f}"),
        *((one.name, f"{'>= ' if one.most else ''}{one.value:.3g} {one.unit}") for one in row.limits),
    )
    return Heading(label(file)), Table(("measured", "value"), rows, (0, 1))


PARTS = 3
"""Of a path, so many from its end on tell models apart that are called scene.xml."""


def model_document(found: ModelReport) -> Document:
    """A robot as it is read, or the fault in it and the lines to write."""
    robot = found.robot
    by = "" if found.description is None else f", described by {label(found.description)}"
    blocks: list[Block] = [Heading((label(found.file), by))]
    if robot is not None:
        blocks += _parts(robot, found.parts)
    blocks += _rows(
        [(Words("fault", "bad"), fault) for fault in found.faults] + [("note", note) for note in found.notes]
    )
    if robot is not None:
        blocks += _use(found, robot)
    return tuple(blocks)


def models_document(rows: Sequence[SurveyedModel]) -> Document:
    """Models in a row each, and how many are recognised and stand."""
    lines = []
    for row in rows:
        name = "/".join(Path(row.file).parts[-PARTS:])
        if row.refused:
            lines.append((name, "", "", "", f"refused: {row.refused}"))
            continue
        stands = "" if row.stood is None else "yes" if row.stood else f"no: {row.end}"
        feet = " + ".join(str(count) for count in row.feet)
        lines.append((name, f"{row.mass:.4g} kg", str(row.actuators), feet, stands))
    known = [row for row in rows if not row.refused]
    tried = [row for row in known if row.stood is not None]
    words = f"{len(known)} of {len(rows)} recognised"
    words += f", {sum(bool(row.stood) for row in tried)} of {len(tried)} stand" if tried else ""
    heads = ("model", "mass", "actuators", "contact points", "stands")
    return Table(heads, tuple(lines), (0, 4)), Paragraph(words)


def _use(found: ModelReport, robot: Robot) -> list[Block]:
    """The settings a robot runs with, and a scenario to start from."""
    laws = [f"law = '{name}'" for name in found.laws] + ["a policy's card (law = 'card.toml')"]
    general = f"{', '.join(laws)}, or a law of your own (law = 'path.py:Class')"
    rows: list[tuple[Line, str]] = [("laws", general)] if found.not_planar else [
        ("laws", "law = 'thesis', which needs no key, for this is a planar biped of seven links"),
        ("", f"with robot = {{}} in the scenario also {general}"),
    ]  # fmt: skip
    if found.not_planar and found.not_spatial:
        reason = found.not_spatial.partition(f"model '{robot.name}': ")[2] or found.not_spatial
        rows.append(("", f"not law = 'thesis': {reason}"))
    if found.physics:
        rows.append(("physics", found.physics))
    start = [f'law = "{found.laws[-1]}"']
    if not found.not_planar:
        start = ['controller = "normal"    # the gait of the human; biped list names others',
                 f'start.posture = "{robot.start}"']  # fmt: skip
    lines = (f'model = "{label(found.file)}"', *start, "duration = 5.0",
             *(('simulation.physics = "file"',) if found.physics else ()))  # fmt: skip
    advice = "Save this as first.toml, for example, and type: biped run first.toml --record"
    return [*_rows(rows), Paragraph(advice), Items(tuple(Words(line, "code") for line in lines))]


def _parts(robot: Robot, parts: dict[str, str]) -> list[Block]:
    rows: list[tuple[Line, str]] = [("base", f"{robot.base}, moves {robot.freedom}")]
    for foot in robot.feet:
        places = ", ".join(f"({', '.join(f'{x:.3g}' for x in place)})" for place in foot.points)
        count = f"{len(foot.points)} contact point{'s' if len(foot.points) > 1 else ''}"
        rows.append(("foot", f"{foot.name}, {count}, x, y, z [m] in its body's frame: {places}"))
    starts = ", ".join(robot.starts) or "none"
    rows += [
        ("mass", f"{robot.mass:.4g} kg"),
        ("leg", f"{robot.leg:.3g} m from the first hip joint to the sole"),
        *parts.items(),
        ("start", f"{robot.start or 'all coordinates at zero'}; keyframes of the file: {starts}"),
    ]
    drives = []
    for drive in robot.drives:
        limit = f"{drive.limit:g} N m" if drive.limited else "none"
        servo = f", {drive.stiffness:g} N m/rad" if drive.kind == "position" else ""
        drives.append((drive.name, drive.kind + servo, drive.joint, limit))
    said: list[Block] = [Paragraph(robot.description)] if robot.description else []
    return [*said, *_rows(rows), Table(("actuator", "kind", "joint", "torque limit"), tuple(drives), (0, 1, 2))]


def _rows(rows: Sequence[tuple[Line, str]]) -> list[Block]:
    """Heads, each with words that wrap beside it."""
    return [Table(("", ""), tuple(rows), (0, 1))] if rows else []
