"""Ways to fall as a document."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from biped.show.document import Document, Heading, Paragraph, Table, Words


def document_of(found: Mapping[str, Any]) -> Document:
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
        Paragraph(f"{found['runs']} runs in all; {found['falls']} of {found['plain']} plain ones fell."),
        Table(("fell", "at [s]", "|z|² found", "made likelier", "scenario"), rows, (0, 4)),
        Paragraph(note, note=True),
    )
