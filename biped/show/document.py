"""A document as plain records: what a result says, before it is known whether a terminal, Markdown or a page shows it.

Results become documents (`biped.show.results`, `comparisons`, `standing`); `terminal.show`, `markdown.text` and
`page.html.blocks` draw any document. All words in it may be a stranger's: each of the three shows them as text.
"""

from pathlib import Path
from typing import Literal, NamedTuple, TypeAlias

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
