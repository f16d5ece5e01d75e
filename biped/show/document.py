"""A document as plain records, before it is known whether a terminal, Markdown or a page shows it; and Markdown of it.

Results become documents (`biped.show.results`, `comparisons`, `standing`); `terminal.show`, `markdown` and
`page.html.blocks` draw any document. All words in it may be a stranger's: each of the three shows them as text.

Words for people are here too: names of what is drawn, and somebody's texts, which make nothing of a page.
"""

import math
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Literal, NamedTuple, TypeAlias

from biped.base.errors import markdown_table, plain
from biped.base.statistics import wilson
from biped.base.writing import write_into

Kind = Literal["", "strong", "emphasis", "code", "good", "bad", "doubt"]


class Words(NamedTuple):
    """A piece of a line.

    Attributes:
        text: The words.
        kind: How they stand out, if they do.
    """

    text: str
    kind: Kind = ""


Line: TypeAlias = "str | Words | tuple[str | Words, ...]"
"""A line of text, perhaps in pieces."""


def pieces(line: Line) -> tuple[Words, ...]:
    """A line as pieces."""
    if isinstance(line, str):
        return (Words(line),)
    if isinstance(line, Words):
        return (line,)
    return tuple(Words(one) if isinstance(one, str) else one for one in line)


class Heading(NamedTuple):
    """The title of what follows.

    Attributes:
        line: The title.
        level: 1 of a document, 2 of a section.
    """

    line: Line
    level: int = 2


class Paragraph(NamedTuple):
    """Some sentences.

    Attributes:
        line: Their words.
        note: Whether they only explain how to read the rest.
    """

    line: Line
    note: bool = False


class Items(NamedTuple):
    """Lines that stand one below the other."""

    lines: tuple[Line, ...]


class Table(NamedTuple):
    """A table.

    Attributes:
        head: Titles of the columns.
        rows: Cells; one of several lines has them between line feeds.
        words: Numbers of the columns that hold words; the others hold numbers.
    """

    head: tuple[Line, ...]
    rows: tuple[tuple[Line, ...], ...]
    words: tuple[int, ...] = (0,)


class Picture(NamedTuple):
    """A figure in a file.

    Attributes:
        title: In words.
        path: Of the file, relative to the document's.
    """

    title: str
    path: Path


Block: TypeAlias = "Heading | Paragraph | Items | Table | Picture"
Document: TypeAlias = "tuple[Block, ...]"


STATES = {1: "stance", 2: "heel off", 3: "swing", 4: "knee straight"}
"""Leg states 1 … 4."""


def literal(text: Any) -> str:
    """Somebody's words, of which Markdown makes nothing but text: no links, pictures, cells or lines."""
    return re.sub(r"([\\`*_\[\]<>|!#~])", r"\\\1", plain(text))


def words(name: str) -> str:
    """The name of a number, for people."""
    return literal(name.replace("_", " "))


def share(count: int, runs: int) -> str:
    """So many of these runs, with Wilson's 95 % interval of the share behind them."""
    low, high = wilson(count, runs)
    return f"{count} of {runs} ({100.0 * low:.0f} – {100.0 * high:.0f} %)"


def percent(share: float) -> str:
    """A share as a percentage, with a digit behind the point where whole ones would say 0 or 100 of neither."""
    whole = 100.0 * share
    if (0.0 < whole < 1.0) or (99.0 < whole < 100.0):
        return f"{whole:.1f} %"
    return f"{whole:.0f} %"


def between(low: float, high: float) -> str:
    """An interval of shares."""
    return f"{percent(low).removesuffix(' %')} – {percent(high)}"


def value_of(value: Any) -> str:
    """A value of a setting: whole numbers in full, others with four digits."""
    if isinstance(value, list | tuple):
        return f"({', '.join(value_of(one) for one in value)})"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.4g}".replace("-", "−") if math.isfinite(value) else "–"
    return "–" if value is None else str(value).replace("-", "−") if isinstance(value, int) else str(value)


def leg_words(foot: str) -> str:
    """A leg for people, by its foot: of a body such as `right_ankle_roll_link` only which side it is on."""
    sides = [side for side in ("right", "left") if side in foot.lower().replace("-", "_").split("_")]
    return f"{sides[0] if len(sides) == 1 else foot.replace('_', ' ')} leg"


def harmless(value: Any) -> Any:
    """A result from anybody's file, all texts in it with nothing hidden and nothing that a terminal obeys."""
    if isinstance(value, dict):
        return {plain(key): harmless(inner) for key, inner in value.items()}
    if isinstance(value, list):
        return [harmless(inner) for inner in value]
    return plain(value) if isinstance(value, str) else value


DOCS = Path(__file__).parents[2] / "docs"
_MARKS = {"strong": "**", "bad": "**", "doubt": "**", "emphasis": "*"}
"""Marks around a piece of a line."""


def markdown(content: Document) -> str:
    """A document in Markdown, which ends with a line feed."""
    return "\n\n".join(_block(block) for block in content) + "\n"


def write_markdown(content: Document, folder: Path, name: str) -> None:
    """Writes a document into a results folder.

    Raises:
        InputError: It cannot be written.
    """
    write_into(folder, {name: markdown(content)})


def replaced(page: str, name: str, part: str) -> str:
    """A page with another part between its marks `<!-- NAME -->` and `<!-- end of NAME -->`."""
    before, begin, rest = page.partition(f"<!-- {name} -->")
    _, end, after = rest.partition(f"<!-- end of {name} -->")
    return f"{before}{begin}\n{part}\n{end}{after}"


def filled(template: Path, parts: Mapping[str, str]) -> str:
    """A template's text with parts in the place of their marks `<!-- NAME -->`."""
    page = template.read_text(encoding="utf-8")
    for name, part in parts.items():
        page = page.replace(f"<!-- {name} -->", part)
    return page


def _block(block: object) -> str:
    match block:
        case Heading(line, level):
            return f"{'#' * level} {_line(line)}"
        case Paragraph(line):
            return _line(line)
        case Items(lines):
            return "\n".join(f"- {_line(line)}" for line in lines)
        case Picture(title, path):
            return f"![{literal(title)}]({path.as_posix()})"
        case Table(head, rows):
            return markdown_table(_cells(head), map(_cells, rows))
    raise TypeError(block)


def _cells(cells: Sequence[Line]) -> list[str]:
    return [_line(cell).replace("\n", "<br>") for cell in cells]


def _line(line: Line) -> str:
    return "".join(_piece(one.text, one.kind) for one in pieces(line))


def _piece(words: str, kind: str) -> str:
    if kind == "code":  # between backticks all is text; it cannot end them, nor a cell
        return "`" + words.replace("`", "'").replace("|", "/").replace("\n", " ") + "`"
    mark = _MARKS.get(kind, "")
    return mark + "\n".join(literal(part) for part in words.split("\n")) + mark
