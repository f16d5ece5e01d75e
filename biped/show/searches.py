"""The result of a search in words and rows, for the terminal and for a page."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from biped.base.files import label
from biped.base.statistics import same_rate, wilson
from biped.show.document import Document, Paragraph, Table, between
from biped.show.results import number

if TYPE_CHECKING:
    from biped.studies.tune import Tuned

CONDITIONS = ("condition", "walked", "95 % interval", "before", "speed [m/s]", "before", "cost of transport", "before")
"""Heads of the rows of `conditions_of`."""


def search_document(tuned: Tuned) -> Document:
    """How many runs of each condition walked, with the gait that was found and with the one before it."""
    found, result = tuned.as_dict(), tuned.found
    told = f"On seeds never used before. {verdict_of(found)}"
    if not result.generation:
        told += " It found nothing better than the gait that it began with, which is the answer."
    elif result.cost >= result.start_cost:
        told += " The gait that the search began with is no worse than what it found."
    made = f"{tuned.runs} runs, {found['runs_per_second']:.1f} a second; gait in {label(tuned.gait)}"
    return Table(CONDITIONS, tuple(conditions_of(found))), Paragraph(told), Paragraph(made)


def verdict_of(found: Mapping[str, Any]) -> str:
    """How many runs of all conditions walk, before and after, and the objective.

    Args:
        found: What `biped tune --json` prints.
    """
    conditions = found["conditions"].values()
    walked, runs = (sum(one[key] for one in conditions) for key in ("walked", "runs"))
    before = sum(one["before"]["walked"] for one in conditions)
    if not runs:
        return "No runs."
    sure = "more than chance explains" if same_rate(walked, before, runs, runs) < 0.05 else "within chance"
    return (
        f"Walks {walked} of {runs} ({between(*wilson(walked, runs))}), {before} before: {sure}. Objective "
        f"{number(found['objective'])}, {number(found['before'])} before."
    )


def conditions_of(found: Mapping[str, Any]) -> list[tuple[str, ...]]:
    """A row for every condition: runs that walked, their speed and cost, each before too.

    Args:
        found: What `biped tune --json` prints.
    """
    rows = []
    for name, one in found["conditions"].items():
        was = one["before"]
        row = (
            name, f"{one['walked']} of {one['runs']}", between(*wilson(one["walked"], one["runs"])),
            f"{was['walked']} of {was['runs']}", number(one["speed"]), number(was["speed"]),
            number(one["cost_of_transport"]), number(was["cost_of_transport"]),
        )  # fmt: skip
        rows.append(tuple("–" if cell == "None" else cell for cell in row))
    return rows
