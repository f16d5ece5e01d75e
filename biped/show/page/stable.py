"""The section of `biped stability`: what a gait is as a limit cycle, in every engine at every time step."""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import msgspec

from biped.show.page.html import Markup, card, chip, table, tag
from biped.show.page.plot import Frame, legend
from biped.show.results import number
from biped.show.results_folder import read_as
from biped.studies.stability.basin import FELL, RETURNED, WALKS

Number = int | float | None
_KINDS = ("accent", "other", "good", "push")


class _Fit(msgspec.Struct):
    kick: float
    fell: int
    walks: int
    radius: Number
    interval: tuple[Number, Number]
    explained: Number
    multipliers: list[tuple[float, float]]


class _Size(msgspec.Struct):
    size: float
    after: list[Number]
    fell: int
    walks: int


class _Exponent(msgspec.Struct):
    value: Number
    half_width: Number


class _Basin(msgspec.Struct):
    lean: list[float]
    speed: list[float]
    states: int
    fell: list[list[int]]
    walks: list[list[int]]
    returned: list[list[int]]


class _Gait(msgspec.Struct):
    engine: str
    timestep: float
    failed: str = ""
    kind: str = ""
    strides: int = 0
    period: Number = None
    period_std: Number = None
    fell: int = 0
    walks: int = 0
    exponent: _Exponent | None = None
    sizes: list[_Size] = []
    fit: _Fit | None = None
    basin: _Basin | None = None


class _Studied(msgspec.Struct):
    scenario: str
    stable: bool
    gaits: list[_Gait]


def section(folder: Path) -> Markup:
    """The section of a stability study's folder.

    Raises:
        InputError: It is broken.
    """
    file = folder / "stability.json"
    found = read_as(file, _Studied, "what biped stability writes", "biped stability SCENARIO")
    measured = [gait for gait in found["gaits"] if gait.get("fit")]
    kinds = {_place(gait): _KINDS[i % len(_KINDS)] for i, gait in enumerate(measured)}
    said = "; ".join(f"{_place(gait)}: {gait.get('kind') or gait.get('failed')}" for gait in found["gaits"])
    head = [
        tag("h2", f"{found['scenario']}: the gait as a limit cycle"),
        tag("p", chip(found["stable"], "✓ kicks die out", "✗ kicks do not die out"), f"{said}.", class_="verdict"),
    ]
    cards = [_sizes(measured, kinds), _circle(measured, kinds)] if measured else []
    cards += [_basin(gait) for gait in measured if gait.get("basin")]
    return tag("section", *head, _numbers(found["gaits"]), tag("div", *cards, class_="cards"))


def _place(gait: Mapping[str, Any]) -> str:
    return f"{gait['engine']}, {1e3 * gait['timestep']:g} ms"


def _numbers(gaits: Sequence[Mapping[str, Any]]) -> Markup:
    lines = []
    for gait in gaits:
        fit, exponent = gait.get("fit"), gait.get("exponent")
        if fit is None:
            lines.append((_place(gait), gait.get("failed", ""), *[""] * 5))
            continue
        low, high = fit["interval"]
        lyapunov = f"{number(exponent['value'])} ± {number(exponent['half_width'])}" if exponent else "–"
        lines.append(
            (
                _place(gait),
                gait["kind"],
                gait["strides"],
                f"{number(gait['period'])} ± {number(gait['period_std'])}",
                lyapunov,
                f"{number(fit['radius'])} ({number(low)} – {number(high)})",
                f"{fit['fell']} of {fit['walks']}",
            )
        )
    head = ("where", "to small disturbances", "strides", "stride [s]", "Lyapunov exponent per return",
            "largest multiplier (95 %)", "kicked walks that fell")  # fmt: skip
    return table(head, lines, words=(0, 1))


def _sizes(gaits: Sequence[Mapping[str, Any]], kinds: Mapping[str, str]) -> Markup:
    drawn = {_place(gait): [(row["size"], row["after"][-1]) for row in gait["sizes"]
                            if row["after"] and row["after"][-1] and row["size"] > 0.0] for gait in gaits}  # fmt: skip
    values = [
        value for rows in drawn.values() for pair in rows for value in pair if math.isfinite(value) and value > 0.0
    ]
    if not values:
        return card("Kicks", tag("p", "No pair of walks got three returns far.", class_="about"))
    span = 10.0 ** math.floor(math.log10(min(values))), 10.0 ** math.ceil(math.log10(max(values)) + 1e-9)
    frame = Frame(span, span, "size of the kick", "distance after three returns", log=True, left=52.0)
    frame.line(span, span, "quiet dash thin")
    for place, rows in drawn.items():
        frame.line([a for a, _ in rows], [b for _, b in rows], f"{kinds[place]}")
        for a, b in rows:
            frame.dot(a, b, kinds[place], 3.5, f"{place}: {a:g} becomes {b:.2g}")
    key = legend([(kinds[place], place) for place in drawn])
    return card("What becomes of kicks", key, frame.svg("kicks after three returns"),
                note="Below the dashed line a kick has shrunk, above it has grown; natural units.")  # fmt: skip


def _circle(gaits: Sequence[Mapping[str, Any]], kinds: Mapping[str, str]) -> Markup:
    reach = max([1.0, *(math.hypot(*m) for gait in gaits for m in gait["fit"]["multipliers"])]) * 1.12
    frame = Frame((-reach, reach), (-reach, reach), "real", "imaginary", square=True)
    turn = [2.0 * math.pi * i / 120 for i in range(121)]
    frame.line([math.cos(a) for a in turn], [math.sin(a) for a in turn], "quiet")
    for gait in gaits:
        for re, im in gait["fit"]["multipliers"]:
            for side in (im, -im) if im else (im,):
                frame.dot(re, side, kinds[_place(gait)], 4.0, f"{math.hypot(re, im):.3f}")
    key = legend([(kind, place) for place, kind in kinds.items()])
    return card("Multipliers of the fitted map", key, frame.svg("multipliers in the unit circle"),
                note="Inside the circle disturbances die out.")  # fmt: skip


def _basin(gait: Mapping[str, Any]) -> Markup:
    cut = gait["basin"]
    lean, speed = [math.degrees(a) for a in cut["lean"]], cut["speed"]
    a, b = (0.5 * abs(values[1] - values[0]) if len(values) > 1 else 0.5 for values in (lean, speed))
    frame = Frame(
        (min(lean) - a, max(lean) + a),
        (min(speed) - b, max(speed) + b),
        "torso leans further forward by [°]",
        "moves faster by [m/s]",
    )
    words = ((RETURNED, "good", "back on the gait"), (WALKS, "other", "up, not back"), (FELL, "bad", "fell"))
    for i, x in enumerate(lean):
        for j, y in enumerate(speed):
            counts = {name: cut[name][i][j] for name, _, _ in words}
            total, left = max(1, cut["states"]), x - a
            said = f"{x:+.0f}°, {y:+.1f} m/s: " + ", ".join(f"{counts[n]} {w}" for n, _, w in words)
            for name, kind, _ in words:
                width = 2.0 * a * counts[name] / total
                if width > 0.0:
                    frame.rect((left, left + width), (y - b, y + b), f"dot {kind}", said)
                left += width
    key = legend([(kind, said) for _, kind, said in words])
    return card(
        f"Basin of attraction, {_place(gait)}",
        key,
        frame.svg("a slice through the basin of attraction"),
        note=f"{cut['states']} states of the gait changed at every cell; the plain gait is in the middle.",
    )
