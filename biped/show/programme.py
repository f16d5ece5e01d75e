"""The thesis's programme, condition by condition: docs/thesis-programme.md, from results folders of `thesis/*`.

`python -m biped.show.programme FOLDER…` takes results folders into the page and draws their figures beside it; without
any, it writes the page anew.
"""

import json
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from biped.base.writing import dumps, write_text
from biped.ensemble.results import goal_at
from biped.scenario.metrics import HEAD, METRICS
from biped.scenario.reading import read_scenario
from biped.show.document import DOCS, Block, Document, Heading, Items, Paragraph, Picture, Table, Words, markdown, share
from biped.show.replay import plot_results
from biped.show.results import causes_of, number
from biped.studies.folders import results_at

PAGE, TEMPLATE, DATA = (DOCS / f"thesis-programme{suffix}" for suffix in (".md", ".in.md", ".json"))
FIGURES = DOCS / "thesis-programme"
DRAWN = ("rates.png", "velocities.png")
"""Figures that the page shows; the others say the same as its tables."""
MARK = "<!-- programme -->"
_LISTED = 12
"""Most points of a sweep that stand one below the other; more are laid out by both keys."""


def taken(folder: Path) -> dict[str, Any]:
    """The part of a scenario's results that is kept.

    Raises:
        InputError: The folder holds no results.
    """
    result = results_at(folder)
    scenario = read_scenario(str(folder / "scenario.toml"), looking=True)
    points = [
        {"values": point["values"], "walked": goal_at(point)[1], "runs": point["runs"], "falls": point["falls"]}
        | {name: point[name] for name in HEAD}
        for point in result["points"]
    ]
    return {
        "scenario": result["scenario"],
        "description": scenario.description,
        "duration": scenario.duration,
        "reading": scenario.reading or "clipped",
        "contacts": scenario.actuation.contacts,
        "starts": "projected onto the ground" if scenario.start.settle else "as printed",
        "walked": result["summary"]["walked"],
        "falls": result["summary"]["falls"],
        "runs": len(result["runs"]),
        "causes": causes_of(result["runs"]),
        "points": points,
    }


def document_of(found: Sequence[Mapping[str, Any]]) -> Document:
    """One table of what walked, then a section for each scenario."""
    head = ("scenario", "duration", "reading", "contacts", "starts", "walked (95 %)", "fell")
    rows = tuple(
        (Words(one["scenario"], "code"), f"{one['duration']:g} s", one["reading"], one["contacts"], one["starts"],
         share(one["walked"], one["runs"]), str(one["falls"]))
        for one in found
    )  # fmt: skip
    blocks: list[Block] = [Table(head, rows, (0, 2, 3, 4))]
    for one in found:
        blocks += _section(one)
    return tuple(blocks)


def _section(one: Mapping[str, Any]) -> list[Block]:
    name = one["scenario"]
    blocks: list[Block] = [
        Heading(name),
        Paragraph(f"{one['description']}."),
        Paragraph(("Repeat it: ", Words(f"biped run {name}", "code"))),
    ]
    if one["causes"]:
        blocks += [Paragraph("Runs that did not walk:"), Items(tuple(f"{n} × {cause}" for cause, n in one["causes"]))]
    points = one["points"]
    across = len(points) > _LISTED and len(points[0]["values"]) == 2
    blocks.append(_both_keys(points) if across else _listed(points))
    folder = FIGURES / name.rpartition("/")[2]
    blocks += [Picture(Path(each).stem, (folder / each).relative_to(DOCS)) for each in DRAWN]
    return blocks


def _listed(points: Sequence[Mapping[str, Any]]) -> Table:
    keys = tuple(points[0]["values"])
    rows = tuple(
        (*(number(point["values"][key]) for key in keys), share(point["walked"], point["runs"]), str(point["falls"]),
         *(METRICS[name].text(point[name]) if point["walked"] else "–" for name in HEAD))
        for point in points
    )  # fmt: skip
    return Table((*keys, "walked (95 %)", "fell", *(METRICS[name].words for name in HEAD)), rows, ())


def _both_keys(points: Sequence[Mapping[str, Any]]) -> Table:
    """How many walked: values of the first swept key side by side, of the second one below another."""
    first, second = points[0]["values"]
    across, down = (tuple(dict.fromkeys(point["values"][key] for point in points)) for key in (first, second))
    cell = {tuple(point["values"].values()): f"{point['walked']} of {point['runs']}" for point in points}
    rows = tuple((number(value), *(cell[other, value] for other in across)) for value in down)
    return Table((f"{second} \\ {first}", *map(number, across)), rows, ())


def page(found: Sequence[Mapping[str, Any]]) -> str:
    """The text of docs/thesis-programme.md."""
    return TEMPLATE.read_text(encoding="utf-8").replace(MARK, markdown(document_of(found)).rstrip())


def stored() -> list[dict[str, Any]]:
    """The scenarios of docs/thesis-programme.md."""
    return json.loads(DATA.read_bytes()) if DATA.exists() else []


def main(argv: Sequence[str]) -> None:
    """Takes results into the page, in place of those of the same scenarios; without any, writes the page anew."""
    if argv:
        for each in argv:
            folder = FIGURES / Path(each).name
            for file in plot_results(Path(each), folder):
                if file.name not in DRAWN:
                    file.unlink()
        found = [*stored(), *(taken(Path(each)) for each in argv)]
        write_text(DATA, dumps(list({one["scenario"]: one for one in found}.values())))
    write_text(PAGE, page(stored()))


if __name__ == "__main__":
    main(sys.argv[1:])
