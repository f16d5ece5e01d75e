"""Charts as inline SVG: a frame with scales, and marks in it; colours are classes that the style sheet fills in."""

import math
from collections.abc import Iterable, Sequence

import numpy as np

from biped.show.page.html import Markup, join, tag

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
