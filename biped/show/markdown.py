"""Documents in Markdown; somebody's words stay words in it."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from biped.base.text import markdown_table
from biped.base.writing import write_into
from biped.show.document import Document, Heading, Items, Line, Paragraph, Picture, Table, literal, pieces

DOCS = Path(__file__).parents[2] / "docs"
_MARKS = {"strong": "**", "bad": "**", "doubt": "**", "emphasis": "*"}
"""Marks around a piece of a line."""


def text(content: Document) -> str:
    """A document in Markdown, which ends with a line feed."""
    return "\n\n".join(_block(block) for block in content) + "\n"


def write(content: Document, folder: Path, name: str) -> None:
    """Writes a document into a results folder.

    Raises:
        InputError: It cannot be written.
    """
    write_into(folder, {name: text(content)})


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
        return "`" + plain_code(words) + "`"
    mark = _MARKS.get(kind, "")
    return mark + "\n".join(literal(part) for part in words.split("\n")) + mark


def plain_code(words: str) -> str:
    """Somebody's words between backticks, which they cannot end."""
    return words.replace("`", "'").replace("|", "/").replace("\n", " ")
