"""Pieces of HTML: everything that is not markup already is text, so nobody's words make anything of the page.

Charts are inline SVG: a frame with scales, and marks in it; colours are classes that the style sheet fills in.
"""

import math
from collections.abc import Iterable, Sequence
from html import escape
from typing import Any

import numpy as np

from biped.base.errors import plain
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


WIDTH, HEIGHT = 440.0, 250.0
"""Units of a chart that is half a page wide, about pixels."""
_MOST = 500
"""Most corners of a curve: more cannot be seen."""

Range = tuple[float, float]


class Frame:
    """A chart: scales, axes, and the marks that were added.

    Args:
        x: Range of the abscissa.
        y: Range of the ordinate.
        across: What the abscissa is, with its unit.
        up: What the ordinate is, with its unit; it stands above the axis.
        ticks: Names of whole numbers on the abscissa where it is not a number.
        rungs: The same for the ordinate.
        log: Whether both axes are logarithmic.
        width: Of the chart.
        height: Likewise.
        left: Room for the ordinate's numbers.
        square: Whether a unit is as long on both axes; the abscissa is widened.
    """

    def __init__(
        self, x: Range, y: Range, across: str, up: str, *, ticks: Sequence[str] | None = None,
        rungs: Sequence[str] | None = None, log: bool = False, width: float = WIDTH, height: float = HEIGHT,
        left: float = 46.0, square: bool = False,
    ):  # fmt: skip
        self._log = log
        self.width, self.height = width, height
        self._box = left, 26.0, width - 12.0, height - 40.0  # left, top, right, bottom
        self._x, self._y = (math.log10(x[0]), math.log10(x[1])) if log else _some(x), _some(y)
        if log:
            self._y = math.log10(y[0]), math.log10(y[1])
        if square:
            a, b, c, d = self._box
            half = 0.5 * (self._y[1] - self._y[0]) * (c - a) / (d - b)
            middle = 0.5 * (self._x[0] + self._x[1])
            self._x = middle - half, middle + half
        self._words = across, up
        self._ticks, self._rungs = ticks, rungs
        self._marks: list[Markup] = []

    def at(self, x: float, y: float) -> tuple[float, float]:
        """Where a point is in the drawing."""
        if self._log:
            x, y = math.log10(x), math.log10(y)
        left, top, right, bottom = self._box
        return (
            left + (x - self._x[0]) / (self._x[1] - self._x[0]) * (right - left),
            bottom - (y - self._y[0]) / (self._y[1] - self._y[0]) * (bottom - top),
        )

    def add(self, mark: Markup) -> None:
        """Adds a mark in the drawing's own units."""
        self._marks.append(mark)

    def line(self, x: Iterable[float], y: Iterable[float], class_: str) -> None:
        """A curve; it breaks where it is not finite."""
        points = np.column_stack([np.asarray(x, float), np.asarray(y, float)])
        points = points[:: max(1, math.ceil(len(points) / _MOST))]
        word, out = "M", []
        for a, b in points:
            if not (math.isfinite(a) and math.isfinite(b)):
                word = "M"
                continue
            p, q = self.at(a, b)
            out.append(f"{word}{p:.1f} {q:.1f}")
            word = "L"
        self.add(tag("path", d="".join(out), class_=f"line {class_}"))

    def dot(self, x: float, y: float, class_: str, size: float = 3.0, said: str | None = None) -> None:
        """A dot; `said` appears when it is pointed at."""
        p, q = self.at(x, y)
        inner = () if said is None else (tag("title", said),)
        self.add(tag("circle", *inner, cx=round(p, 1), cy=round(q, 1), r=size, class_=f"dot {class_}"))

    def whisker(self, x: float, interval: Range, class_: str) -> None:
        """An interval upwards, with a bar at either end."""
        (p, low), (_, high) = self.at(x, interval[0]), self.at(x, interval[1])
        d = f"M{p:.1f} {low:.1f}V{high:.1f}M{p - 3:.1f} {low:.1f}h6M{p - 3:.1f} {high:.1f}h6"
        self.add(tag("path", d=d, class_=f"line {class_}"))

    def rect(self, x: Range, y: Range, class_: str, said: str | None = None, fill: str | None = None) -> None:
        """A filled rectangle."""
        (a, b), (c, d) = self.at(x[0], y[1]), self.at(x[1], y[0])
        inner = () if said is None else (tag("title", said),)
        self.add(tag("rect", *inner, x=round(a, 2), y=round(b, 2), width=round(max(c - a, 0.3), 2),
                     height=round(d - b, 2), class_=class_, fill=fill))  # fmt: skip

    def band(self, x: Range, class_: str) -> None:
        """A strip over the whole height."""
        low, high = max(x[0], self._x[0]), min(x[1], self._x[1])
        if high > low:
            self.rect((low, high), self._y, class_)

    def level(self, y: float, class_: str, word: str = "") -> None:
        """A horizontal line over the whole width, named at its right end; none where it is outside."""
        if not self._y[0] <= y <= self._y[1]:
            return
        left, _, right, _ = self._box
        _, q = self.at(self._x[0] if not self._log else 10 ** self._x[0], y)
        self.add(tag("path", d=f"M{left} {q:.1f}H{right}", class_=f"line {class_}"))
        if word:
            self.add(tag("text", word, x=right, y=round(q - 4, 1), text_anchor="end", class_="tick"))

    def word(self, x: float, y: float, word: str, class_: str = "tick", anchor: str = "middle", fill: str | None = None,
             down: float = 4.0) -> None:  # fmt: skip
        """A word at a point."""
        p, q = self.at(x, y)
        self.add(tag("text", word, x=round(p, 1), y=round(q + down, 1), text_anchor=anchor, class_=class_, fill=fill))

    def svg(self, name: str) -> Markup:
        """The chart; `name` is what is read aloud of it."""
        return tag("svg", self._axes(), *self._marks, viewBox=f"0 0 {self.width:g} {self.height:g}", role="img",
                   aria_label=name, class_="chart" if self.width <= WIDTH else "chart long")  # fmt: skip

    def _axes(self) -> Markup:
        left, top, right, bottom = self._box
        across, up = self._words
        out = [
            tag("text", up, x=2, y=13, class_="axis"),
            tag("text", across, x=(left + right) / 2, y=self.height - 5, text_anchor="middle", class_="axis"),
        ]
        for value, word in _rungs(self._y, self._rungs, self._log, 5):
            q = bottom - (value - self._y[0]) / (self._y[1] - self._y[0]) * (bottom - top)
            if self._rungs is None:
                out.append(tag("path", d=f"M{left} {q:.1f}H{right}", class_="grid"))
            out.append(tag("text", word, x=left - 6, y=round(q + 4, 1), text_anchor="end", class_="tick"))
        for value, word in _rungs(self._x, self._ticks, self._log, 7):
            p = left + (value - self._x[0]) / (self._x[1] - self._x[0]) * (right - left)
            if self._ticks is None:
                out.append(tag("path", d=f"M{p:.1f} {top}V{bottom}", class_="grid"))
            out.append(tag("text", word, x=round(p, 1), y=bottom + 15, text_anchor="middle", class_="tick"))
        return join(out)


def steps(low: float, high: float, most: int) -> list[float]:
    """At most so many round numbers, evenly spaced, within a range."""
    width = (high - low) / max(1, most - 1)
    power = 10.0 ** math.floor(math.log10(width))
    step = next(power * factor for factor in (1.0, 2.0, 2.5, 5.0, 10.0, 20.0) if power * factor >= width * 0.999)
    first = math.ceil(low / step - 1e-9)
    return [i * step for i in range(first, math.floor(high / step + 1e-9) + 1)]


def around(values: Iterable[float], room: float = 0.06) -> Range:
    """A range that holds all finite values, with some room."""
    found = [value for value in values if value is not None and math.isfinite(value)]
    if not found:
        return 0.0, 1.0
    low, high = min(found), max(found)
    more = room * (high - low) or 0.05 * abs(high) or 0.5
    return low - more, high + more


def legend(entries: Iterable[tuple[str, str]]) -> Markup:
    """Colours and what they stand for: (class, words)."""
    return tag("p", *(tag("span", tag("i", class_=f"key {name}"), words) for name, words in entries), class_="legend")


def shade(share: float) -> tuple[str, str]:
    """Colours of a cell of a map and of the words in it: cividis, from dark (0) to light (1)."""
    anchors = ((0, 34, 78), (53, 69, 108), (102, 105, 112), (148, 142, 119), (200, 184, 102), (254, 232, 56))
    place = min(max(share, 0.0), 1.0) * (len(anchors) - 1)
    i = min(int(place), len(anchors) - 2)
    colour = [round(a + (place - i) * (b - a)) for a, b in zip(anchors[i], anchors[i + 1], strict=True)]
    return f"rgb({colour[0]},{colour[1]},{colour[2]})", "#fff" if share < 0.55 else "#111"


def _some(values: Range) -> Range:
    return values if values[1] > values[0] else (values[0] - 0.5, values[0] + 0.5)


def _rungs(span: Range, words: Sequence[str] | None, log: bool, most: int) -> list[tuple[float, str]]:
    if words is not None:
        return [(float(i), word) for i, word in enumerate(words) if span[0] <= i <= span[1]]
    if log:
        whole = range(math.ceil(span[0] - 1e-9), math.floor(span[1] + 1e-9) + 1)
        return [(float(i), f"1e{i}" if abs(i) > 2 else f"{10.0**i:g}") for i in whole][:: max(1, len(whole) // 5)]
    values = steps(*span, most)
    return [(value, f"{value:.10g}".replace("-", "−")) for value in values]
