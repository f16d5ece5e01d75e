"""Causes of a difference for people: which was changed to what, and how much of the difference that takes away."""

from __future__ import annotations

import math

from biped.show.document import Document, Heading, Paragraph, Table, Words
from biped.studies.causes import EXPLAINED, Why


def document_of(found: Why) -> Document:
    """The causes as a document: the verdict, and every cause at its best setting.

    Args:
        found: Of one engine against another, or of two settings of one.
    """
    named = found.named
    rows = tuple(
        (
            Words(one.cause, "strong" if one.cause in named else ""), one.setting, f"{100.0 * one.explained:.1f} %",
            "–" if math.isnan(one.parted_at) else f"{one.parted_at:.2f}",
        )
        for one in found.tried
    )  # fmt: skip
    note = (f"Each cause by itself, in {found.moved}, until it behaves like {found.towards}; named are those that take "
            f"away at least {100 * EXPLAINED:.0f} % of where base and legs differ, moment by moment.")  # fmt: skip
    return (
        Heading(f"{found.scenario}: why {found.moved} differs from {found.towards}"),
        Paragraph(Words(found.verdict(), "strong")),
        Table(("cause", "best setting", "explains", "1 cm apart at [s]"), rows, (0, 1)),
        Paragraph(note, note=True),
    )
