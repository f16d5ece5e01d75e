"""The section of `biped tune`: what the gait that was found scores on unseen seeds, and how the search went."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import msgspec

from biped.base.errors import InputError
from biped.base.statistics import same_rate, wilson
from biped.base.typed import convert
from biped.show.page.html import Markup, card, chip, join, table, tag
from biped.show.page.plot import Frame, around, legend
from biped.show.results import number
from biped.show.results_folder import read_as
from biped.show.words import between

Number = int | float | None


class _Tally(msgspec.Struct):
    walked: int
    runs: int
    speed: Number
    cost_of_transport: Number


class _Condition(_Tally):
    before: _Tally


class _Tuned(msgspec.Struct):
    scenario: str
    gait: str
    objective: Number
    before: Number
    conditions: dict[str, _Condition]
    keys: dict[str, Number]
    runs: int


class _Generation(msgspec.Struct):
    index: int
    costs: list[float]
    walked: int
    runs: int
    recheck: Number = None


def section(folder: Path) -> Markup:
    """The section of a search's folder.

    Raises:
        InputError: It is broken.
    """
    found = read_as(folder / "result.json", _Tuned, "what biped tune writes", "biped tune SCENARIO")
    conditions = found["conditions"].values()
    walked, runs = (sum(one[key] for one in conditions) for key in ("walked", "runs"))
    before = sum(one["before"]["walked"] for one in conditions)
    head = [
        tag("h2", f"{found['scenario']}: a search for gains"),
        tag("p", *_verdict(found, walked, before, runs), class_="verdict"),
        tag("p", "Scores are of seeds on which nothing was decided.", class_="about"),
        tag("code", found["gait"], class_="command"),
    ]
    return tag(
        "section", *head, tag("h3", "Conditions"), _conditions(found), _settings(found["keys"]), *_search(folder)
    )


def _verdict(found: Mapping[str, Any], walked: int, before: int, runs: int) -> list[Any]:
    if not runs:
        return ["No runs."]
    better = found["objective"] is not None and found["before"] is not None and found["objective"] < found["before"]
    p = same_rate(walked, before, runs, runs)
    sure = "more than chance explains" if p < 0.05 else "within chance"
    return [chip(better, "✓ better", "✗ not better"),
            f"Walks {walked} of {runs} ({between(*wilson(walked, runs))}), {before} before: {sure}. Objective "
            f"{number(found['objective'])}, {number(found['before'])} before."]  # fmt: skip


def _conditions(found: Mapping[str, Any]) -> Markup:
    lines = []
    for name, one in found["conditions"].items():
        was = one["before"]
        lines.append((
            name, f"{one['walked']} of {one['runs']}", between(*wilson(one["walked"], one["runs"])),
            f"{was['walked']} of {was['runs']}", number(one["speed"]), number(was["speed"]),
            number(one["cost_of_transport"]), number(was["cost_of_transport"]),
        ))  # fmt: skip
    lines = [[("–" if cell == "None" else cell) for cell in line] for line in lines]
    head = ("condition", "walked", "95 % interval", "before", "speed [m/s]", "before", "cost of transport", "before")
    return table(head, lines)


def _settings(keys: Mapping[str, Any]) -> Markup | None:
    if not keys:
        return None
    lines = [(tag("code", key), number(value)) for key, value in keys.items()]
    return join([tag("h3", "Settings found with it"), table(("key", "value"), lines)])


def _search(folder: Path) -> list[Markup]:
    """How the search went, generation by generation."""
    journal = _journal(folder / "runs.jsonl")
    if len(journal) < 2:
        return []
    at = [one["index"] for one in journal]
    best, middle = ([sorted(one["costs"])[part(len(one["costs"]))] for one in journal]
                    for part in (lambda _: 0, lambda n: n // 2))  # fmt: skip
    checked = [one for one in journal if one.get("recheck") is not None]
    frame = Frame(
        (1, at[-1]), around([*best, *middle, *(one["recheck"] for one in checked)]), "generation", "objective"
    )
    frame.line(at, middle, "quiet")
    frame.line(at, best, "accent")
    frame.line([one["index"] for one in checked], [one["recheck"] for one in checked], "other")
    for one in checked:
        frame.dot(one["index"], one["recheck"], "other", 4.0)
    key = legend(
        [("quiet", "median of the generation"), ("accent", "best (flattered)"), ("other", "mean gait, fresh seeds")]
    )
    rates = Frame((1, at[-1]), (0.0, 100.0), "generation", "runs that walk [%]")
    rates.line(at, [100.0 * one["walked"] / max(1, one["runs"]) for one in journal], "accent")
    cards = [
        card("Objective", key, frame.svg("objective by generation"), note="Lower is better."),
        card("Runs that walk", rates.svg("walking runs by generation"), note="All runs of each generation."),
    ]
    return [tag("h3", "The search"), tag("div", *cards, class_="cards")]


def _journal(file: Path) -> list[dict[str, Any]]:
    """The generations that a journal holds; what is not one is left out."""
    try:
        lines = file.read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{file}: cannot be read: {error}; expected the journal of the search") from None
    found = []
    for line in lines:
        try:
            record = json.loads(line)
            convert(record, _Generation)
        except (ValueError, RecursionError, msgspec.MsgspecError):
            continue
        if record["costs"]:
            found.append(record)
    return found
