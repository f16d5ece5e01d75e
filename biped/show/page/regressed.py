"""The section of what `biped regress --json` printed: every scenario against its recorded numbers."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import msgspec

from biped.show.page.html import Markup, blocks, card, chip, tag
from biped.show.page.plot import Frame
from biped.show.references import table_of
from biped.show.results_folder import read_as
from biped.studies.regress.compare import UNLIKELY

Number = int | float | None


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
    return tag("section", *head, *blocks((table_of(order),)), _moved(single))


def _moved(verdicts: list[Mapping[str, Any]]) -> Markup | None:
    """Walking runs then against now, where anything moved."""
    found = [one for one in verdicts if one["walked"][0] != one["walked"][1] and one["runs"]]
    if not found:
        return None
    frame = Frame((-3.0, 103.0), (-3.0, 103.0), "walked then [%]", "walked now [%]", square=False)
    frame.line([0.0, 100.0], [0.0, 100.0], "quiet dash thin")
    for one in found:
        then, now = (100.0 * count / one["runs"] for count in one["walked"])
        said = f"{one['scenario']}: {' → '.join(map(str, one['walked']))}"
        frame.dot(then, now, "good" if one["passed"] else "bad", 5.0, said)
    return tag(
        "div",
        card(
            "What moved",
            frame.svg("walking runs then and now"),
            note="On the dashed line nothing changed; below it fewer walk now.",
        ),
        class_="cards",
    )
