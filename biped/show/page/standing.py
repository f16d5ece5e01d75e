"""The section of `biped standard`: the table, and how many runs reached the goal at every value that was tried."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import msgspec

from biped.base.statistics import wilson
from biped.show.page.html import Markup, blocks, card, tag
from biped.show.page.plot import Frame, legend
from biped.show.results_folder import read_as
from biped.show.standing import FILE, document_of
from biped.show.words import between, literal

Number = int | float | None
_KINDS = ("accent", "other", "good", "push", "bad", "quiet")
"""Classes of the gaits' curves; beyond so many they repeat, dashed."""


class _Test(msgspec.Struct):
    name: str
    title: str
    description: str
    goal: str
    rate: float
    key: str | None
    of: str
    times: float
    unit: str
    shows: list[str]


class _Tried(msgspec.Struct):
    value: Number
    reached: int
    runs: int
    numbers: dict[str, Number]
    interval: tuple[float, float]


class _Limit(msgspec.Struct):
    holds_to: Number
    sure_to: Number
    fails_at: Number
    surely_fails_at: Number


class _Standing(msgspec.Struct):
    test: str
    gait: str
    scale: float
    tried: list[_Tried]
    limit: _Limit | None


class _StandingFile(msgspec.Struct):
    gaits: list[str]
    changes: list[str]
    tests: list[_Test]
    standings: list[_Standing]


def section(folder: Path) -> Markup:
    """The section of a folder of `biped standard`.

    Raises:
        InputError: It is broken.
    """
    found = read_as(folder / FILE, _StandingFile, "what biped standard writes", "biped standard GAIT…")
    searched = [test for test in found["tests"] if test["key"] is not None]
    cards = [card for test in searched if (card := _curves(found, test)) is not None]
    curves = [tag("h3", "Runs that reached the goal, by what was asked of them"), tag("div", *cards, class_="cards")]
    return tag(
        "section", tag("h2", f"Standard tests: {', '.join(found['gaits'])}"),
        *blocks(document_of(found)), *(curves if cards else ()),
    )  # fmt: skip


def _curves(found: Mapping[str, Any], test: Mapping[str, Any]) -> Markup | None:
    """Shares of runs at every value, with their intervals, a curve a gait."""
    there = [one for one in found["standings"] if one["test"] == test["name"] and one["tried"]]
    if not there:
        return None
    values = [one["scale"] * test["times"] * tried["value"] for one in there for tried in one["tried"]]
    unit = f" [{test['unit']}]" if test["unit"] else ""
    low, high = min(0.0, *values), max(0.0, *values)
    frame = Frame((low, high), (0.0, 100.0), f"{literal(test['title'])}{unit}", "runs [%]")
    frame.level(100.0 * test["rate"], "quiet dash", f"holds: {100.0 * test['rate']:g} %")
    keys = []
    for one in there:
        at = found["gaits"].index(one["gait"])
        kind = _KINDS[at % len(_KINDS)] + (" dash" if at >= len(_KINDS) else "")
        x = [one["scale"] * test["times"] * tried["value"] for tried in one["tried"]]
        share = [100.0 * tried["reached"] / max(1, tried["runs"]) for tried in one["tried"]]
        frame.line(x, share, kind)
        for place, tried, height in zip(x, one["tried"], share, strict=True):
            interval = between(*wilson(tried["reached"], tried["runs"]))
            said = f"{one['gait']}: {tried['reached']} of {tried['runs']} at {place:.3g} {test['unit']} ({interval})"
            frame.dot(place, height, _KINDS[at % len(_KINDS)], said=said)
        keys.append((kind, one["gait"]))
    return card(test["title"], legend(keys), frame.svg(test["title"]), note=test["description"])
