"""The section of a results folder: a single run, an ensemble or a sweep; verdict first, then what stands behind it."""

import shlex
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from biped.base.files import label
from biped.ensemble.checks import GOALS, goal_of, judgement
from biped.measure.metrics.walking import outcome
from biped.measure.trajectory import Trajectory
from biped.scenario.laws import own_law
from biped.show.page import claims, ensembles, motion
from biped.show.page.frames import frames_of
from biped.show.page.html import Markup, card, judged, key_words, setting, table, tag
from biped.show.page.player import PlayedRun, walks
from biped.show.replay import of_numbers, spread
from biped.show.results import failures
from biped.show.results_folder import ResultsFolder, chosen
from biped.show.words import harmless, value_of
from biped.studies.sensitivity import explained

READ = 20_000
"""Most runs that charts are made of."""
_LISTED, _MOST = 8, 200
"""Runs that did not walk that are listed at once, and at most."""


def section(folder: Path) -> Markup:
    """The section of a results folder.

    Raises:
        InputError: It is none, or is broken.
    """
    kept = ResultsFolder(folder)
    result, scenario = kept.result, kept.plan.scenario
    rows, summary, points = _looked_at(result["runs"]), result["summary"], result.get("points", [])
    made = len(result["runs"])
    goal, space, alone = goal_of(result), kept.space, made == 1
    path = shlex.quote(label(folder / "scenario.toml"))
    head = [
        tag("h2", result["scenario"]),
        tag("p", f"{scenario.description}. " if scenario.description else "", _runs_line(kept), class_="about"),
        tag("p", judged(judgement(result)), claims.alone(rows[0]) if alone else
            f"{claims.headline(summary, made, goal)}; {failures(summary)}.", class_="verdict"),
        claims.expectations(result["checks"], made),
        claims.unseen(summary, rows, points, made, goal),
        tag("code", f"biped run {path}{_only(kept)}{_trust(kept)}", class_="command"),
    ]  # fmt: skip
    body = []
    if points:
        body += [tag("h3", "Along the sweep"), _cards(*ensembles.sweep(points, result["thresholds"], space)),
                 ensembles.points_table(points, space)]  # fmt: skip
    if not alone:
        shares = explained(kept.plan, rows, goal)
        spread = ensembles.endings(rows, goal), ensembles.costs(rows, result["thesis"])
        if len(rows) < made:
            body.append(tag("p", f"What follows is of {len(rows)} of the {made} runs, evenly spread.", class_="about"))
        body += [tag("h3", "How the runs went"), _cards(*spread, *ensembles.causes(shares, rows, goal, space))]
    shown = _played(kept, rows)
    if shown:
        body += [tag("h3", "The walk"), _cards(card("", walks([one for one, _, _ in shown]), wide=True))]
        whose = "the run" if alone else f"run {shown[0][2]}"
        body += [tag("h3", f"Inside {whose}"), *motion.charts(shown[0][1], scenario.interval)]
    else:
        body.append(tag("p", kept.again(rows[0]["index"]), class_="about"))
    if not points:
        body += [tag("h3", "Numbers"), claims.numbers(summary, result["thesis"], rows, made)]
    if not alone:
        body.append(_failed(folder, kept, rows, goal))
    return tag("section", *head, *body)


def _cards(*cards: Markup | None) -> Markup:
    return tag("div", *cards, class_="cards")


def _runs_line(kept: ResultsFolder) -> str:
    """The runs of a campaign in a line."""
    s, count = kept.plan.scenario, len(kept.result["runs"])
    runs = "" if count == 1 else f"{count} runs of "
    slope = f", slope {value_of(s.ground.slope)}°" if s.ground.slope else ""
    ground = s.ground
    tiles = f", tiles of ±{value_of(ground.tiles.height)} m" if ground.tiles.height else ""
    steps = f", steps of {value_of(ground.steps.rise)} m" if ground.steps.rise else ""
    jitter = f", starts jittered by {value_of(s.start.jitter)} rad" if s.start.jitter else ""
    law = f", law {s.law}" if s.law else f", contacts {s.actuation.contacts}"
    gait = f"gait {s.controller}" if s.controller else f"{Path(s.model).name}"
    return f"{runs}{s.duration:g} s in {s.engine}, {gait}{law}{slope}{tiles}{steps}{jitter}, seed {s.seed}."


def _only(kept: ResultsFolder) -> str:
    rows = kept.result["runs"]
    return f" --only {rows[0]['index']}" if len(rows) == 1 and len(kept.plan) > 1 else ""


def _trust(kept: ResultsFolder) -> str:
    return " --trust" if own_law(kept.plan.scenario.law) else ""


def _looked_at(runs: Sequence[Mapping[str, Any]]) -> list[Mapping[str, Any]]:
    """The runs as rows, of very many some, evenly spread."""
    if len(runs) <= READ:
        return list(runs)
    numbers = of_numbers(runs, spread(runs, READ))
    return [harmless(numbers[index]) for index in sorted(numbers)]


def _played(kept: ResultsFolder, rows: list[Mapping[str, Any]]) -> list[tuple[PlayedRun, Trajectory, int]]:
    """The runs that are shown with their numbers, of those whose trajectory is there or can be made again."""
    out = []
    for name, row in chosen(rows):
        trajectory = kept.trajectory(row["index"])
        if trajectory is None:
            continue
        values = ", ".join(setting(key, value, kept.space) for key, value in row.get("values", {}).items())
        index, became = row["index"], outcome(row) + (f"; {values}" if values else "")
        frames = frames_of(trajectory, kept.model(index))
        out.append((PlayedRun(name, f"Run {index}: {became}.", frames), trajectory, index))
    return out


def _failed(folder: Path, kept: ResultsFolder, rows: list[Mapping[str, Any]], goal: str) -> Markup | None:
    """Runs that missed their goal, each with the command that shows it."""
    failed, count = [row for row in rows if not row[goal]], len(kept.result["runs"]) - int(kept.result["summary"][goal])
    if not failed:
        return None
    keys = list(dict.fromkeys(key for row in failed for key in row.get("values", {})))
    path = shlex.quote(label(folder / "scenario.toml"))

    def line(row: Mapping[str, Any]) -> tuple[Any, ...]:
        again = tag("code", f"biped run {path} --only {row['index']} --record{_trust(kept)}")
        values = (value_of(row.get("values", {}).get(key)) for key in keys)
        return (row["index"], outcome(row), *values, again)

    head = ("run", "what became of it", *(key_words(key, kept.space) for key in keys), "to see it again")
    words = (1, len(head) - 1)
    listed = table(head, map(line, failed[:_LISTED]), words)
    more = None
    if len(failed) > _LISTED:
        all_of_them = count <= min(len(failed), _MOST)
        opening = (
            f"All {count} runs that did not {GOALS[goal]}" if all_of_them else f"{min(len(failed), _MOST)} of them"
        )
        more = tag("details", tag("summary", opening),
                   table(head, map(line, failed[_LISTED:_MOST]), words))  # fmt: skip
    return tag("div", tag("h3", f"Runs that did not {GOALS[goal]}: {count}"), listed, more)
