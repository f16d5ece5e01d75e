"""Falls as documents: how likely one is, and in which ways; on a terminal, in Markdown, and in docs/certify.md.

`python -m biped.show.certify TITLE=FOLDER…` writes a table of results folders into docs/certify.md.
"""

import json
import math
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from biped.base.statistics import trials_as_narrow
from biped.base.writing import dumps, write_text
from biped.show.document import DOCS, Block, Document, Heading, Items, Paragraph, Table, Words, filled, markdown

PAGE, TEMPLATE, DATA = DOCS / "certify.md", DOCS / "certify.in.md", DOCS / "certify.json"
_SCORES = {
    "learned": "log odds of a fall within some 2 s, learned from runs under stronger disturbances, above the usual",
    "margin": "how far the extrapolated centre of mass is beyond the feet that stand, above the usual, in leg lengths",
    "drop": "how far the centre of mass has come down, above the usual, in leg lengths",
    "lean": "lean of the base, above the usual, in rad",
}


def document_of(found: Mapping[str, Any]) -> Document:
    """The probability with what it rests on.

    Args:
        found: As `biped.studies.certify.Certified.as_dict` gives it.
    """
    plain, low, high = found["plain"], *found["interval"]
    blocks: list[Block] = [
        Heading(f"{found['scenario']}: how likely is a fall", 1),
        Paragraph(Words(_headline(found), "strong" if found["reached"] else "doubt")),
        Table(
            ("", "estimate", "95 % interval"),
            (
                (f"a fall within {found['duration']:g} s", _number(found["probability"]), _span(low, high)),
                ("a fall within 100 steps", *_cells(found["per_100_steps"])),
                ("mean steps to a fall", *_cells(found["steps_to_fall"])),
            ),
        ),
        Items(tuple(_remarks(found))),
    ]
    if found["levels"]:
        names = [*(f"{level:.3f}" for level in found["levels"]), "a fall"]
        product, rows = 1.0, []
        for name, share in zip(names, found["shares"], strict=False):
            product *= share
            rows.append((name, f"{share:.3f}", _number(product)))
        blocks.append(Table(("level", "share that reaches it", "product"), tuple(rows)))
        blocks.append(Paragraph(f"Levels are of the score '{found['score']}': {_SCORES[found['score']]}.", note=True))
    if found.get("patterns"):
        rows = tuple((f"{one['by']:.2f}", f"{one['spread']:.2f}", f"{one['share']:.2f}") for one in found["patterns"])
        blocks.append(Table(("shift along a pattern", "spread along it", "share of the shifted runs"), rows))
    leads = "pattern leads to" if found["method"] == "shifting" else "level leads to"
    note = (
        f"{plain['runs']} runs were plain. A way to fall that no {leads} is seen by them alone: one rarer than "
        f"{3.0 / max(plain['runs'], 1):.2g} a run would most likely not have been seen."
    )
    return (*blocks, Paragraph(note, note=True))


def _headline(found: Mapping[str, Any]) -> str:
    if found["probability"] == 0.0:
        return f"no fall in {found['runs']} runs"
    words = "" if found["reached"] else "; wider than asked for: raise --most"
    times = found["interval"][1] / found["probability"]
    return f"p = {_number(found['probability'])} by {found['method']}, within a factor of {times:.2f}{words}"


def _remarks(found: Mapping[str, Any]) -> list[Words | str]:
    plain = found["plain"]
    lines: list[Words | str] = [
        f"{found['runs']} runs in all; {plain['falls']} of the {plain['runs']} plain ones fell, by which p is "
        f"{_span(*plain['interval'])}",
        f"a plain run takes {plain['steps']:.1f} steps in {plain['seconds']:.1f} s",
    ]
    p, (low, high) = found["probability"], found["interval"]
    if found["method"] == "shifting":
        lines.append(f"the weights of the shifted runs that fell are worth {found['effective']:.1f} falls")
    if found["method"] != "counting" and p > 0.0:
        runs = _number(trials_as_narrow(p, low, high))
        lines.append(f"plain counting would take {runs} runs for an interval as narrow")
    if plain["other"]:
        lines.append(Words(f"{plain['other']} plain runs neither fell nor were completed: counted as no fall", "doubt"))
    if found["doubt"]:
        lines.append(Words(found["doubt"], "bad"))
    return lines


def _cells(values: Sequence[float | None]) -> tuple[str, str]:
    value, low, high = (math.nan if one is None else one for one in values)
    return _number(value), _span(low, high)


def _span(low: float, high: float) -> str:
    return f"{_number(low)} … {_number(high)}"


def _number(value: float) -> str:
    """A number of any size in few digits."""
    if math.isinf(value):
        return "∞"
    if math.isnan(value):
        return "–"
    return f"{value:.2g}" if value == 0.0 or value < 0.01 else f"{value:,.3g}" if value < 1000.0 else f"{value:,.0f}"


def summary_of(found: Sequence[Mapping[str, Any]]) -> Document:
    """A table with a row for each of several results, titled by whoever keeps them."""
    heads = ("", "method", "runs", "levels", "p", "95 % interval", "plain runs alone", "steps to a fall", "interval")
    rows = tuple(
        (one["title"], one["method"], str(one["runs"]), str(len(one["levels"])), _number(one["probability"]),
         _span(*one["interval"]), f"{one['plain']['falls']} of {one['plain']['runs']}", *_cells(one["steps_to_fall"]))
        for one in found
    )  # fmt: skip
    return (Table(heads, rows, (0, 1)),)


def reference_document(found: Sequence[Mapping[str, Any]]) -> Document:
    """How often intervals hold probabilities that are known."""
    heads = ("", "known", "mean estimate", "intervals that hold it", "95 % interval", "below it", "runs", "factor",
             "plain runs for the same / runs")  # fmt: skip
    rows = tuple(
        (one["name"], _number(one["known"]), _number(one["mean"]), f"{one['held']} of {one['repeats']}",
         f"{100.0 * one['interval'][0]:.0f} – {100.0 * one['interval'][1]:.0f} %", str(one["below"]),
         _number(one["runs"]), f"{one['factor']:.2f}", f"{one['saving']:,.3g}")
        for one in found
    )  # fmt: skip
    return (Table(heads, rows, (0,)),)


def page(kept: Sequence[Mapping[str, Any]]) -> str:
    """The text of docs/certify.md."""
    return filled(TEMPLATE, {"tables": markdown(summary_of(kept)).rstrip()})


def stored() -> list[dict[str, Any]]:
    """Results that docs/certify.md shows."""
    return json.loads(DATA.read_bytes()) if DATA.exists() else []


def ways_document(found: Mapping[str, Any]) -> Document:
    """The ways to fall and what each takes.

    Args:
        found: As `biped.studies.find.Failures.as_dict` gives it.
    """
    ways = len(found["found"])
    stands = f" that {found['against']} stands" if found["against"] else ""
    head = f"{ways} {'way' if ways == 1 else 'ways'} to fall{stands}" if ways else f"no fall{stands} found"
    rows = tuple(
        (one["way"], f"{one['end']:.2f}", f"{one['before']:.1f}", f"{one['squares']:.1f}", Words(one["file"], "code"))
        for one in found["found"]
    )
    note = (
        "|z|²: sum of the squares of the standard normals that a run draws, as it was found and made as likely as it "
        "falls alike; less is likelier, by exp(−|z|²/2), and a plain run has about as much as it draws numbers. `biped "
        "run FILE` makes a failure again, `biped check FILE` fails until it stands."
    )
    return (
        Heading(f"{found['scenario']}: ways to fall", 1),
        Paragraph(Words(head, "bad" if ways else "strong")),
        Paragraph(
            f"{found['runs']} runs in all; {found['falls']} of {found['plain']} plain ones fell. {found['distinct']} "
            f"falls have different forces in the second before, in {found['cells']} pairs of a way and a step."
        ),
        Table(("fell", "at [s]", "|z|² found", "made likelier", "scenario"), rows, (0, 4)),
        Paragraph(note, note=True),
    )


def main(argv: Sequence[str]) -> None:
    """Takes results folders, `TITLE=FOLDER` each, into the page beside its other rows; without any, writes it anew."""
    if argv:
        found = {one["title"]: one for one in stored()}
        for word in argv:
            title, _, folder = word.rpartition("=")
            found[title] = json.loads((Path(folder) / "certify.json").read_bytes()) | {"title": title, "folder": ""}
        write_text(DATA, dumps(list(found.values()), indent=1))
    write_text(PAGE, page(stored()))


if __name__ == "__main__":
    main(sys.argv[1:])
