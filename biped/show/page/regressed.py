"""The section of what `biped regress --json` printed: every scenario against its recorded numbers."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import msgspec

from biped.scenario.metrics import METRICS
from biped.show.page.html import Markup, card, chip, table, tag
from biped.show.page.plot import Frame
from biped.show.page.read import read_as
from biped.studies.regress.compare import DIGITS, GONE, NEW, PHYSICS, RUNS, SAME, UNLIKELY

Number = int | float | None
_WORDS = {SAME: "same", DIGITS: "digits changed", PHYSICS: "changed", RUNS: "other runs are made of it now",
          NEW: "no reference", GONE: "no scenario"}  # fmt: skip


class _Moved(msgspec.Struct):
    old: Number
    new: Number
    change: Number
    within: bool


class _Verdict(msgspec.Struct):
    scenario: str
    verdict: str
    runs: int
    identical: int
    walked: tuple[int, int]
    fell: tuple[int, int]
    likely: float
    metrics: dict[str, _Moved]
    passed: bool


class _Outcome(msgspec.Struct):
    verdicts: list[_Verdict]
    passed: bool
    stopped: bool = False


def section(file: Path) -> Markup:
    """The section of a file.

    Raises:
        InputError: It is no outcome of a regression run.
    """
    found = read_as(file, _Outcome, "what biped regress --json prints", "biped regress --json > regress.json")
    verdicts = found["verdicts"]
    single = [one for one in verdicts if one["scenario"] != "altogether"]
    failed = [one for one in single if not one["passed"]]
    said = f"{len(single) - len(failed)} of {len(single)} scenarios as recorded."
    if found.get("stopped"):
        said += " It was stopped before the others."
    head = [
        tag("h2", "Regression: then and now"),
        tag("p", chip(found["passed"]), said, class_="verdict"),
        tag("div", tag("p", tag("strong", "What this could not see")),
            tag("p", "Each scenario is at most twelve runs: a count must change by about half of them to show "
                     f"(p < {UNLIKELY:g}); digits show any change on the platform that they were recorded on."),
            class_="unseen"),
    ]  # fmt: skip
    order = sorted(verdicts, key=lambda one: one["passed"])
    return tag("section", *head, _table(order), _moved(single))


def _table(verdicts: list[Mapping[str, Any]]) -> Markup:
    lines = []
    for one in verdicts:
        lines.append((
            one["scenario"], chip(one["passed"], "✓", "✗"), _WORDS.get(one["verdict"], one["verdict"]),
            f"{one['identical']} of {one['runs']}", _counts(one["walked"]), _counts(one["fell"]),
            *(_mean(name, one["metrics"].get(name)) for name in ("speed", "cost_of_transport", "double_support")),
        ))  # fmt: skip
    head = ("scenario", "", "", "same bits", "walked", "fell", "speed [m/s]", "cost of transport", "double support")
    return table(head, lines, words=(0, 1, 2))


def _counts(pair: tuple[int, int]) -> str:
    old, new = pair
    return str(new) if old == new else f"{old} → {new}"


def _mean(name: str, moved: Mapping[str, Any] | None) -> str:
    if moved is None:
        return "–"
    text = METRICS[name].text
    return text(moved["new"]) if moved["old"] == moved["new"] else f"{text(moved['old'])} → {text(moved['new'])}"


def _moved(verdicts: list[Mapping[str, Any]]) -> Markup | None:
    """Walking runs then against now, where anything moved."""
    found = [one for one in verdicts if one["walked"][0] != one["walked"][1] and one["runs"]]
    if not found:
        return None
    frame = Frame((-3.0, 103.0), (-3.0, 103.0), "walked then [%]", "walked now [%]", square=False)
    frame.line([0.0, 100.0], [0.0, 100.0], "quiet dash thin")
    for one in found:
        then, now = (100.0 * count / one["runs"] for count in one["walked"])
        frame.dot(then, now, "good" if one["passed"] else "bad", 5.0, f"{one['scenario']}: {_counts(one['walked'])}")
    return tag(
        "div",
        card(
            "What moved",
            frame.svg("walking runs then and now"),
            note="On the dashed line nothing changed; below it fewer walk now.",
        ),
        class_="cards",
    )
