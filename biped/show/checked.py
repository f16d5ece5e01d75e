"""Checks of several scenarios as a table in Markdown: what a CI job adds to its summary."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from biped.base.replacing import Kind
from biped.base.writing import write_text
from biped.ensemble.checks import FAILED, NOTHING, judgement, word_of
from biped.show.document import Heading, Line, Paragraph, Table, Words
from biped.show.markdown import text
from biped.show.results import KINDS, number

MARK = "<!-- written by biped check -->"
KIND = Kind("a summary of biped check", (), (MARK.encode(),))
_HEADS = ("scenario", "metric", "value", "expected", "verdict")


def summary_of(results: Sequence[Mapping[str, Any]]) -> str:
    """The checks of several scenarios in Markdown: a verdict, and a row for each check.

    Args:
        results: Result objects as `--json` prints them.
    """
    words = [judgement(result) for result in results]
    failed = words.count(FAILED)
    verdict = f"{failed} of {len(words)} scenarios failed" if failed else f"{len(words)} scenarios, none failed"
    rows: list[tuple[Line, ...]] = []
    for result in results:
        name, count = result["scenario"], len(result["runs"])
        for check in result["checks"]:
            word = word_of(check)
            of = f" of {count}" if check["name"] in ("walked", "stood", "sat", "falls") else ""
            row = (name, check["name"], f"{number(check['value'])}{of}", check["expected"], Words(word, KINDS[word]))
            rows.append(row)
        if not result["checks"]:
            rows.append((name, "–", "–", "–", NOTHING))
    blocks = (Heading("Does it walk?", 2), Paragraph(Words(verdict, "bad" if failed else "strong")))
    return text((*blocks, Table(_HEADS, tuple(rows), (0, 1, 3, 4)))) + f"\n{MARK}\n"


def write_summary(path: Path, results: Sequence[Mapping[str, Any]]) -> None:
    """Writes it.

    Raises:
        OSError: It cannot be written.
    """
    write_text(path, summary_of(results))
