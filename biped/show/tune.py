"""Results of a search for gains, as documents."""

from __future__ import annotations

from typing import TYPE_CHECKING

from biped.base.files import label
from biped.show.document import Document, Items, Paragraph, Table

if TYPE_CHECKING:
    from collections.abc import Sequence

    from biped.studies.tune.least import Least
    from biped.studies.tune.robot import Trial
    from biped.studies.tune.tuned import Tuned


def document_of(tuned: Tuned) -> Document:
    """The gait file and what finding it took."""
    lines = tuple(tuned.gait.read_text(encoding="utf-8").splitlines())
    rate = f"{tuned.runs / tuned.seconds:.1f} a second"
    return Items(lines), Paragraph(f"{tuned.runs} runs, {rate}; gait in {label(tuned.gait)}")


def trials_document(trials: Sequence[Trial], changes: Sequence[str]) -> Document:
    """How far shipped gaits came on a robot, and the changes that make the search one for it."""
    rows = tuple(
        (one.gait, f"{one.assist:g}", *("  ".join(f"{value:.2f}" for value in values)
                                        for values in (one.times, one.distances)))
        for one in trials
    )  # fmt: skip
    search = "searching: biped tune tune/any " + " ".join(f"--set '{change}'" for change in changes)
    heads = ("gait", "Q_d share", "s until it fell, from three starts", "m it came")
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
