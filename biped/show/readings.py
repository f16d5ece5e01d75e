"""Readings of the thesis in Markdown: verdicts on its claims, places of choice, how a search went.

`python -m biped.show.readings [FOLDER]` takes the results of `biped readings --out FOLDER` into docs/readings.json, and
writes docs/readings.md and the verdicts in docs/thesis.md from it.
"""

import json
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from biped.base.errors import markdown_table
from biped.base.statistics import wilson
from biped.base.writing import dumps, write_into, write_text
from biped.show.document import DOCS, filled, literal, replaced
from biped.studies import readings

PAGE, TEMPLATE, DATA, THESIS = (DOCS / name for name in ("readings.md", "readings.in.md", "readings.json", "thesis.md"))
FILE = "readings.json"
SHIPPED = "plastic"
PUSHES = "push_"
"""Scenarios of pushes begin with it."""
NEARLY, HALF = 0.9, 0.5
"""Parts of the printed share of walks from which a claim is reproduced, and partly reproduced."""
NAMES = {"speed": "speed m/s", "cost_of_transport": "net cost of transport", "double_support": "double support"}


def data_of(tried: Sequence[readings.TriedReading], confirmed: Sequence[readings.TriedReading]) -> dict[str, Any]:
    """The part of a study that docs/readings.json keeps."""
    return {
        "tried": [readings.as_dict(one) for one in tried],
        "confirmed": [readings.as_dict(one) for one in confirmed],
    }


def write(data: Mapping[str, Any], folder: Path) -> None:
    """Writes readings.json and readings.md into a results folder.

    Raises:
        InputError: They cannot be written.
    """
    write_into(folder, {FILE: dumps(data), "readings.md": "\n\n".join(_parts(data).values())})


def verdict(study: readings.Definition, claim: readings.Claim, outcome: readings.Outcome) -> str:
    """Whether a claim is reproduced: its share of walks, and every printed mean within one scale of the study."""
    share = outcome.walked / outcome.runs / claim.share
    near = all(_off(study, claim, outcome, name) <= 1.0 for name in claim.printed)
    if near and share >= NEARLY:
        return "reproduced"
    return "partly" if share >= HALF else "not"


def _off(study: readings.Definition, claim: readings.Claim, outcome: readings.Outcome, name: str) -> float:
    value = outcome.numbers.get(name)
    return np.inf if value is None else abs(value / claim.printed[name] - 1.0) / study.scale[name]


def verdicts(study: readings.Definition, one: readings.TriedReading, short: bool = False) -> str:
    """The table of claims under a reading, each with its verdict.

    Args:
        study: The study.
        one: The reading.
        short: Whether all pushes are one line.
    """
    rows = []
    for claim, outcome in _merged(study, one) if short else [(c, one.outcomes[c.name]) for c in study.claim]:
        low, high = wilson(outcome.walked, outcome.runs)
        printed = "" if claim.share == 1.0 else f"; thesis {claim.share:.0%}"
        walked = f"{outcome.walked} of {outcome.runs} ({low:.0%} – {high:.0%}{printed})".replace("%", " %")
        cells = [f"{claim.name} ({claim.source})", walked]
        cells += [_number(claim, outcome, name) for name in NAMES]
        rows.append((*cells, verdict(study, claim, outcome)))
    numbers = (f"{words} (thesis)" for words in NAMES.values())
    return markdown_table(("claim", "walked (95 %)", *numbers, "verdict"), rows)


def _merged(study: readings.Definition, one: readings.TriedReading) -> list[tuple[readings.Claim, readings.Outcome]]:
    """Claims and outcomes, all pushes counted together."""
    out: list[tuple[readings.Claim, readings.Outcome]] = []
    rest = [claim for claim in study.claim if not claim.printed]
    pushes = [claim for claim in rest if claim.scenario.startswith(PUSHES)]
    for same in (pushes, *([claim] for claim in rest if claim not in pushes)):
        outcomes = [one.outcomes[claim.name] for claim in same]
        runs, walked = (sum(getattr(outcome, name) for outcome in outcomes) for name in ("runs", "walked"))
        name = same[0].name if len(same) == 1 else f"{len(same)} pushes of 200 N"
        out.append((msgspec.structs.replace(same[0], name=name), readings.Outcome(runs, walked, {})))
    return [(claim, one.outcomes[claim.name]) for claim in study.claim if claim.printed] + out


def _number(claim: readings.Claim, outcome: readings.Outcome, name: str) -> str:
    value, printed = outcome.numbers.get(name), claim.printed.get(name)
    words = "–" if value is None else f"{value:.3f}"
    return words if printed is None else f"{words} ({printed:g})"


def confirmation(confirmed: Sequence[readings.TriedReading]) -> str:
    """Named readings and the best of a search, on seeds that no search has seen."""
    rows = []
    for one in readings.best(confirmed):
        runs, walked = (sum(getattr(o, name) for o in one.outcomes.values()) for name in ("runs", "walked"))
        rows.append((_named(one), f"{one.score:.3f}", f"{walked} of {runs}"))
    return markdown_table(("reading", "score", "walked"), rows)


def _named(one: readings.TriedReading) -> str:
    changes = ", ".join(f"`{key} = {_value(value)}`" for key, value in one.changes.items())
    return f"`{one.reading}`{f' with {changes}' if changes else ''}"


def _value(value: Any) -> str:
    return (
        str(value).lower() if isinstance(value, bool) else f"{value:g}" if isinstance(value, float) else literal(value)
    )


def distribution(tried: Sequence[readings.TriedReading]) -> str:
    """How many readings were tried, how their scores are spread, and the best."""
    if not tried:
        return "No reading has been tried."
    scores = np.array([one.score for one in tried])
    quantiles = np.quantile(scores, [0.0, 0.25, 0.5, 0.75, 1.0])
    words = ", ".join(f"{name} {value:.3f}" for name, value in zip(
        ("least", "lower quartile", "median", "upper quartile", "most"), quantiles, strict=True))  # fmt: skip
    counts, edges = np.histogram(scores, bins=8)
    spread = ((f"{low:.3f} – {high:.3f}", n) for low, high, n in zip(edges[:-1], edges[1:], counts, strict=True))
    top = ((rank, _named(one), f"{one.score:.3f}") for rank, one in enumerate(readings.best(tried)[:5], 1))
    tables = markdown_table(("score", "readings"), spread), markdown_table(("rank", "reading", "score"), top)
    return "\n\n".join([f"{len(tried)} readings were tried. Scores: {words}.", *tables])


def places(study: readings.Definition, tried: Sequence[readings.TriedReading]) -> str:
    """Every place of choice: what the thesis says, the alternatives, and what each alone does to the score."""
    base = readings.based(study)
    zero = next((one.score for one in tried if not one.changes), None)
    alone = {next(iter(one.changes.items())): one.score for one in tried if len(one.changes) == 1}
    rows = []
    for place in study.place:
        cells = []
        for value in place.values:
            if base[place.key] == value:
                cells.append(f"**{_value(value)}**")
            elif zero is not None and (place.key, value) in alone:
                cells.append(f"{_value(value)}: {alone[place.key, value] - zero:+.3f}".replace("-", "−"))
            else:
                cells.append(f"{_value(value)}: not tried")
        rows.append((f"`{place.key}`", literal(place.thesis), "; ".join(cells)))
    return markdown_table(("key", "what the thesis says", "alternatives: change of the score"), rows)


def _parts(data: Mapping[str, Any]) -> dict[str, str]:
    study = readings.definition()
    tried, confirmed = ([readings.from_dict(one) for one in data[name]] for name in ("tried", "confirmed"))
    parts = {"places": places(study, tried), "search": distribution(tried), "confirmation": confirmation(confirmed)}
    for one in confirmed:
        if not one.changes:
            parts[f"verdicts of {one.reading}"] = verdicts(study, one)
    return parts


def page(data: Mapping[str, Any]) -> str:
    """The text of docs/readings.md."""
    return filled(TEMPLATE, _parts(data))


def thesis(data: Mapping[str, Any]) -> str:
    """The text of docs/thesis.md with the verdicts of the shipped reading."""
    shipped = next(
        readings.from_dict(one) for one in data["confirmed"] if one["reading"] == SHIPPED and not one["changes"]
    )
    return replaced(
        THESIS.read_text(encoding="utf-8"), "verdicts", verdicts(readings.definition(), shipped, short=True)
    )


def stored() -> dict[str, Any]:
    """The generated parts of the pages."""
    return json.loads(DATA.read_bytes())


def main(argv: Sequence[str]) -> None:
    """Takes a results folder into the pages; without one, writes the pages anew."""
    if argv:
        write_text(DATA, (Path(argv[0]) / FILE).read_text(encoding="utf-8"))
    write_text(PAGE, page(stored()))
    write_text(THESIS, thesis(stored()))


if __name__ == "__main__":
    main(sys.argv[1:])
