"""Results as one HTML page that people look at: no network, no library; phone, paper, light and dark.

A section a result: `campaign` (run, ensemble, sweep), `comparisons`, `studies`. Everything that stands in a result is
text (`html`); the one script is known to the page by its hash, and no other runs.
"""

import base64
import hashlib
import json
from collections.abc import Callable, Sequence
from pathlib import Path

from biped.base.writing import Kind, may_write, write_text
from biped.show.page import campaign, comparisons, studies
from biped.show.page.html import Markup, join, tag
from biped.studies.folders import writing

MOST = 3_000_000
"""[bytes] that a page should stay below."""

KIND = Kind("a page of biped", (".html", ".htm"), (b"Made by biped.",))

_SECTIONS: dict[str, Callable[[Path], Markup]] = {
    "campaign": campaign.section,
    "comparison": comparisons.comparison_section,
    "search": studies.search_section,
    "stability": studies.stability_section,
    "standard": studies.standard_section,
    "diff": comparisons.difference_section,
    "regress": studies.regression_section,
}


def write_page(results: Sequence[Path], out: Path, title: str) -> None:
    """Writes one page of results.

    Args:
        results: Folders of `run`, `compare`, `diff`, `tune`, `stability` or `standard`, or a file of what
            `regress --json` printed.
        out: The HTML file; a page that is there is replaced, anything else is not.
        title: Of the page.

    Raises:
        InputError: Something is no result, something else is there, or the page cannot be written.
    """
    may_write(out, "--html", KIND)
    write_sections([_SECTIONS[kind_of(path)](path) for path in results], out, title)


def write_sections(sections: Sequence[Markup], out: Path, title: str) -> None:
    """Writes one page of sections.

    Raises:
        InputError: It cannot be written, or something else is there.
    """
    may_write(out, "--html", KIND)
    with writing(f"--html {out}"):
        write_text(out, page(title, sections))


def kind_of(path: Path) -> str:
    """The kind of result that a path holds: a key of the sections."""
    if path.is_file():
        return "regress"
    for name, kind in (
        ("comparison.json", "comparison"), ("stability.json", "stability"), ("standard.json", "standard"),
        ("diff.json", "diff"),
    ):  # fmt: skip
        if (path / name).is_file():
            return kind
    return "search" if _has_conditions(path / "result.json") else "campaign"


def _has_conditions(file: Path) -> bool:
    try:
        found = json.loads(file.read_bytes())
    except (OSError, ValueError, RecursionError):
        return False  # whoever reads it as a campaign says what is wrong with it
    return isinstance(found, dict) and "conditions" in found and "runs" in found and "checks" not in found


def page(title: str, sections: Sequence[Markup]) -> str:
    """A whole page of sections."""
    here = Path(__file__).parent
    style, script = ((here / name).read_text(encoding="utf-8") for name in ("style.css", "player.js"))
    hashed = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    policy = f"default-src 'none'; style-src 'unsafe-inline'; script-src 'sha256-{hashed}'; img-src data:"
    head = tag(
        "head",
        tag("meta", charset="utf-8"),
        tag("meta", http_equiv="Content-Security-Policy", content=policy),
        tag("meta", name_="viewport", content="width=device-width, initial-scale=1"),
        tag("title", title),
        tag("style", Markup(style)),
    )
    foot = tag("footer", "Made by biped. Intervals are of 95 %; means are over the runs that walked, in the window.")
    body = tag("body", tag("header", tag("h1", title)), tag("main", *sections), foot, tag("script", Markup(script)))
    return join([Markup("<!DOCTYPE html>\n"), tag("html", head, body, lang="en"), Markup("\n")])
