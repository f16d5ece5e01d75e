"""Pieces of HTML: everything that is not markup already is text, so nobody's words make anything of the page."""

import math
from collections.abc import Iterable, Sequence
from html import escape
from typing import Any

from biped.base.text import plain
from biped.ensemble.checks import FAILED, NOTHING, PASSED, UNDECIDED
from biped.scenario.metrics import Metric
from biped.scenario.reference import unit_of
from biped.show.document import Document, Heading, Items, Line, Paragraph, Table, pieces, value_of

_VOID = ("meta", "input", "br", "path", "line", "rect", "circle", "polyline", "polygon")


class Markup(str):
    """Text that is HTML already."""

    __slots__ = ()


def text(value: Any) -> Markup:
    """A value as HTML: markup as it is, anything else as text."""
    return value if isinstance(value, Markup) else Markup(escape(plain(value), quote=True))


def tag(name: str, *inner: Any, **attributes: Any) -> Markup:
    """An element.

    Args:
        name: Of the element.
        *inner: What is in it: markup, or text that is escaped; None is left out.
        **attributes: `class_` and `for_` without their underscore, other underscores become hyphens; None and False are
            left out, True stands without a value.
    """
    parts = [name]
    for key, value in attributes.items():
        if value is None or value is False:
            continue
        word = key.removesuffix("_").replace("_", "-")
        parts.append(word if value is True else f'{word}="{text(_short(value))}"')
    opening = " ".join(parts)
    if name in _VOID and not inner:
        return Markup(f"<{opening}/>" if name not in ("meta", "input", "br") else f"<{opening}>")
    return Markup(f"<{opening}>{join(inner)}</{name}>")


def join(parts: Iterable[Any], between: str = "") -> Markup:
    """Pieces one after the other; None is left out."""
    return Markup(between.join(text(part) for part in parts if part is not None))


def table(
    head: Sequence[Any], rows: Iterable[Sequence[Any]], words: Sequence[int] = (0,), more: int | None = None
) -> Markup:
    """A table that scrolls by itself where it is wider than the page.

    Args:
        head: Titles of columns.
        rows: Cells.
        words: Numbers of the columns that hold words; the others hold numbers and go to the right.
        more: The column of words that a phone leaves out.
    """

    def row(name: str, cells: Sequence[Any]) -> Markup:
        kinds = [(None if i in words else "n") if i != more else "more" for i in range(len(cells))]
        return tag("tr", *(tag(name, cell, class_=kind) for cell, kind in zip(cells, kinds, strict=True)))

    body = tag("tbody", *(row("td", cells) for cells in rows))
    return scroll(tag("table", tag("thead", row("th", head)), body), "table")


def blocks(content: Document) -> list[Markup]:
    """A document as HTML."""
    return [_block(block) for block in content]


def _block(block: object) -> Markup:
    match block:
        case Heading(line, level):
            return tag(f"h{min(level + 1, 6)}", *_line(line))
        case Paragraph(line, note):
            return tag("p", *_line(line), class_="about" if note else None)
        case Items(lines):
            return tag("ul", *(tag("li", *_line(line)) for line in lines))
        case Table(head, rows, words):
            return table(
                [join(_line(line)) for line in head], [[join(_line(cell)) for cell in row] for row in rows], words
            )
    raise TypeError(block)


_TAGS = {"strong": "strong", "emphasis": "em", "code": "code"}


def _line(line: Line) -> list[Markup]:
    """A line's pieces; line feeds in them are breaks."""
    out = []
    for words, kind in pieces(line):
        inner = join(words.split("\n"), tag("br"))
        name = _TAGS.get(kind, "span")
        out.append(tag(name, inner, class_=None if kind in _TAGS else kind) if kind else inner)
    return out


def card(title: Any, *inner: Any, note: Any = None, wide: bool = False, **attributes: Any) -> Markup:
    """A figure with its title above and what it means below."""
    below = None if note is None else tag("figcaption", note)
    head = tag("p", title, class_="title") if title else None
    return tag("figure", head, *inner, below, class_="card wide" if wide else "card", **attributes)


def scroll(inner: Any, name: str) -> Markup:
    """A part that scrolls by itself where it is wider than the page, by keyboard too."""
    return tag("div", inner, class_="scroll", tabindex=0, role="group", aria_label=name)


def _short(value: Any) -> Any:
    return f"{value:.6g}" if isinstance(value, float) else value


def chip(passed: bool, good: str = "✓ passed", bad: str = "✗ failed") -> Markup:
    """A verdict in a word, told by more than its colour."""
    return tag("span", good if passed else bad, class_=f"chip {'good' if passed else 'bad'}")


_CHIPS = {PASSED: ("✓ passed", "good"), FAILED: ("✗ failed", "bad"), UNDECIDED: ("? undecided", "quiet"),
          NOTHING: (NOTHING, "quiet")}  # fmt: skip


def judged(judgement: str) -> Markup:
    """A judgement on a result or a check (`biped.ensemble.checks`) as a chip."""
    words, kind = _CHIPS[judgement]
    return tag("span", words, class_=f"chip {kind}")


_WAYS = {True: ("forward", "to the left", "up"), False: ("forward", "up")}
"""Which way the components of a force go, in space and in the plane."""
_FORCES = ("push", "disturbance")


def _named(key: str, space: bool) -> tuple[str, str]:
    """A scenario key in words, and its unit: `push.0.force.0` is a push forward in N."""
    parts = key.split(".")
    if key.startswith("start: "):
        return key, "°"
    way = ""
    if parts[0] in _FORCES and parts[-2] == "force" and parts[-1].isdigit():
        ways, which = _WAYS[space], int(parts.pop())
        way = f" {ways[which]}" if which < len(ways) else ""
        parts.pop()
    words = [f"{int(part) + 1}" if part.isdigit() else part for part in parts if part != "0"]
    return " ".join(words).replace("_", " ") + way, unit_of(key)


def key_words(key: str, space: bool = False) -> str:
    """A scenario key for people, with its unit in brackets where it has one.

    Args:
        key: Dotted.
        space: Whether the robot moves in space, where a force's second component goes to the left.
    """
    words, unit = _named(key, space)
    return f"{words} [{unit}]" if unit else words


def setting(key: str, value: Any, space: bool = False) -> str:
    """A scenario key and its value for people."""
    words, unit = _named(key, space)
    return f"{words} {value_of(value)} {unit}".rstrip()


def metric_text(metric: Metric, value: Any) -> str:
    """A metric's value, large numbers written out."""
    if value is not None and metric.show == "number" and math.isfinite(value) and abs(value) >= 1000.0:
        return f"{float(f'{value:.3g}'):.0f}".replace("-", "−")
    return metric.text(value).replace("-", "−")
