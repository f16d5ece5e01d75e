"""Sections of studies: `biped stability`, `tune` and `standard`, and what `biped regress --json` printed."""

import json
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import msgspec

from biped.base.errors import InputError
from biped.base.statistics import wilson
from biped.base.typed import convert
from biped.show.document import between, literal
from biped.show.page.html import Frame, Markup, around, blocks, card, chip, join, legend, table, tag
from biped.show.references import table_of
from biped.show.results import number
from biped.show.results_folder import Number, read_as, stored
from biped.show.searches import CONDITIONS, conditions_of, verdict_of
from biped.show.standing import FILE, document_of
from biped.studies.regress.references import UNLIKELY
from biped.studies.stability.basin import FELL, RETURNED, WALKS

_KINDS = ("accent", "other", "good", "push")


_FIT = stored({
    "kick": float, "fell": int, "walks": int, "radius": Number, "interval": tuple[Number, Number], "explained": Number,
    "multipliers": list[tuple[float, float]],
})  # fmt: skip
_CUT = stored({
    "lean": list[float], "speed": list[float], "states": int, "fell": list[list[int]], "walks": list[list[int]],
    "returned": list[list[int]],
})  # fmt: skip
_STUDIED = stored({"scenario": str, "stable": bool, "gaits": [{
    "engine": str, "timestep": float, "failed?": str, "kind?": str, "strides?": int, "period?": Number,
    "period_std?": Number, "fell?": int, "walks?": int,
    "exponent?": stored({"value": Number, "half_width": Number}) | None,
    "sizes?": [{"size": float, "after": list[Number], "fell": int, "walks": int}],
    "fit?": _FIT | None, "basin?": _CUT | None,
}]})  # fmt: skip


def stability_section(folder: Path) -> Markup:
    """The section of a stability study's folder.

    Raises:
        InputError: It is broken.
    """
    file = folder / "stability.json"
    found = read_as(file, _STUDIED, "what biped stability writes", "biped stability SCENARIO")
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


_TALLY = {"walked": int, "runs": int, "speed": Number, "cost_of_transport": Number}
_TUNED = stored({
    "scenario": str, "gait": str, "objective": Number, "before": Number, "keys": dict[str, Number], "runs": int,
    "conditions": dict[str, stored({**_TALLY, "before": _TALLY})],
})  # fmt: skip
_GENERATION = stored({"index": int, "costs": list[float], "walked": int, "runs": int, "recheck?": Number})


def search_section(folder: Path) -> Markup:
    """The section of a search's folder.

    Raises:
        InputError: It is broken.
    """
    found = read_as(folder / "result.json", _TUNED, "what biped tune writes", "biped tune SCENARIO")
    head = [
        tag("h2", f"{found['scenario']}: a search for gains"),
        tag("p", *_verdict(found), class_="verdict"),
        tag("p", "Scores are of seeds on which nothing was decided.", class_="about"),
        tag("code", found["gait"], class_="command"),
    ]
    conditions = [tag("h3", "Conditions"), table(CONDITIONS, conditions_of(found))]
    return tag("section", *head, *conditions, _settings(found["keys"]), *_generations(folder))


def _verdict(found: Mapping[str, Any]) -> list[Any]:
    better = found["objective"] is not None and found["before"] is not None and found["objective"] < found["before"]
    runs = any(one["runs"] for one in found["conditions"].values())
    return [chip(better, "✓ better", "✗ not better") if runs else None, verdict_of(found)]


def _settings(keys: Mapping[str, Any]) -> Markup | None:
    if not keys:
        return None
    lines = [(tag("code", key), number(value)) for key, value in keys.items()]
    return join([tag("h3", "Settings found with it"), table(("key", "value"), lines)])


def _generations(folder: Path) -> list[Markup]:
    """How the search went, generation by generation."""
    journal = _journal(folder / "runs.jsonl")
    if len(journal) < 2:
        return []
    at = [one["index"] for one in journal]
    best, middle = ([sorted(one["costs"])[part(len(one["costs"]))] for one in journal]
                    for part in (lambda _: 0, lambda n: n // 2))  # fmt: skip
    checked = [one for one in journal if one.get("recheck") is not None]
    frame = Frame(
        (1, at[-1]), around([*best, *middle, *(one["recheck"] for one in checked)]), "generation", "objective"
    )
    frame.line(at, middle, "quiet")
    frame.line(at, best, "accent")
    frame.line([one["index"] for one in checked], [one["recheck"] for one in checked], "other")
    for one in checked:
        frame.dot(one["index"], one["recheck"], "other", 4.0)
    key = legend(
        [("quiet", "median of the generation"), ("accent", "best (flattered)"), ("other", "mean gait, fresh seeds")]
    )
    rates = Frame((1, at[-1]), (0.0, 100.0), "generation", "runs that walk [%]")
    rates.line(at, [100.0 * one["walked"] / max(1, one["runs"]) for one in journal], "accent")
    cards = [
        card("Objective", key, frame.svg("objective by generation"), note="Lower is better."),
        card("Runs that walk", rates.svg("walking runs by generation"), note="All runs of each generation."),
    ]
    return [tag("h3", "The search"), tag("div", *cards, class_="cards")]


def _journal(file: Path) -> list[dict[str, Any]]:
    """The generations that a journal holds; what is not one is left out."""
    try:
        lines = file.read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{file}: cannot be read: {error}; expected the journal of the search") from None
    found = []
    for line in lines:
        try:
            record = json.loads(line)
            convert(record, _GENERATION)
        except (ValueError, RecursionError, msgspec.MsgspecError):
            continue
        if record["costs"]:
            found.append(record)
    return found


_GAIT_KINDS = ("accent", "other", "good", "push", "bad", "quiet")
"""Classes of the gaits' curves; beyond so many they repeat, dashed."""


_LIMIT = stored({"holds_to": Number, "sure_to": Number, "fails_at": Number, "surely_fails_at": Number})
_TABLE = stored({
    "gaits": list[str], "changes": list[str],
    "tests": [{
        "name": str, "title": str, "description": str, "goal": str, "rate": float, "key": str | None, "of": str,
        "times": float, "unit": str, "shows": list[str],
    }],
    "standings": [{
        "test": str, "gait": str, "scale": float, "limit": _LIMIT | None,
        "tried": [{"value": Number, "reached": int, "runs": int, "numbers": dict[str, Number],
                   "interval": tuple[float, float]}],
    }],
})  # fmt: skip


def standard_section(folder: Path) -> Markup:
    """The section of a folder of `biped standard`.

    Raises:
        InputError: It is broken.
    """
    found = read_as(folder / FILE, _TABLE, "what biped standard writes", "biped standard GAIT…")
    searched = [test for test in found["tests"] if test["key"] is not None]
    cards = [card for test in searched if (card := _curves(found, test)) is not None]
    curves = [tag("h3", "Runs that reached the goal, by what was asked of them"), tag("div", *cards, class_="cards")]
    return tag(
        "section", tag("h2", f"Standard tests: {', '.join(found['gaits'])}"),
        *blocks(document_of(found)), *(curves if cards else ()),
    )  # fmt: skip


def _curves(found: Mapping[str, Any], test: Mapping[str, Any]) -> Markup | None:
    """Shares of runs at every value, with their intervals, a curve a gait."""
    there = [one for one in found["standings"] if one["test"] == test["name"] and one["tried"]]
    if not there:
        return None
    values = [one["scale"] * test["times"] * tried["value"] for one in there for tried in one["tried"]]
    unit = f" [{test['unit']}]" if test["unit"] else ""
    low, high = min(0.0, *values), max(0.0, *values)
    frame = Frame((low, high), (0.0, 100.0), f"{literal(test['title'])}{unit}", "runs [%]")
    frame.level(100.0 * test["rate"], "quiet dash", f"holds: {100.0 * test['rate']:g} %")
    keys = []
    for one in there:
        at = found["gaits"].index(one["gait"])
        kind = _GAIT_KINDS[at % len(_GAIT_KINDS)] + (" dash" if at >= len(_GAIT_KINDS) else "")
        x = [one["scale"] * test["times"] * tried["value"] for tried in one["tried"]]
        share = [100.0 * tried["reached"] / max(1, tried["runs"]) for tried in one["tried"]]
        frame.line(x, share, kind)
        for place, tried, height in zip(x, one["tried"], share, strict=True):
            interval = between(*wilson(tried["reached"], tried["runs"]))
            said = f"{one['gait']}: {tried['reached']} of {tried['runs']} at {place:.3g} {test['unit']} ({interval})"
            frame.dot(place, height, _GAIT_KINDS[at % len(_GAIT_KINDS)], said=said)
        keys.append((kind, one["gait"]))
    return card(test["title"], legend(keys), frame.svg(test["title"]), note=test["description"])


_MOVED = stored({"old": Number, "new": Number, "change": Number, "within": bool})
_OUTCOME = stored({"passed": bool, "stopped?": bool, "verdicts": [{
    "scenario": str, "verdict": str, "runs": int, "identical": int, "walked": tuple[int, int], "fell": tuple[int, int],
    "likely": float, "metrics": dict[str, _MOVED], "passed": bool,
}]})  # fmt: skip


def regression_section(file: Path) -> Markup:
    """The section of a file.

    Raises:
        InputError: It is no outcome of a regression run.
    """
    found = read_as(file, _OUTCOME, "what biped regress --json prints", "biped regress --json > regress.json")
    verdicts = found["verdicts"]
    single = [one for one in verdicts if one["scenario"] != "altogether"]
    failed = [one for one in single if not one["passed"]]
    said = f"{len(single) - len(failed)} of {len(single)} scenarios as recorded."
    if found.get("stopped"):
        said += " It was stopped before the others."
    head = [
        tag("h2", "Regression: then and now"),
        tag("p", chip(found["passed"]), said, class_="verdict"),
        tag("div", tag("p", tag("strong", "What this could not see")),
            tag("p", "Each scenario is at most twelve runs: a count must change by about half of them to show "
                     f"(p < {UNLIKELY:g}); digits show any change on the platform that they were recorded on."),
            class_="unseen"),
    ]  # fmt: skip
    order = sorted(verdicts, key=lambda one: one["passed"])
    return tag("section", *head, *blocks((table_of(order),)), _moved_walks(single))


def _moved_walks(verdicts: list[Mapping[str, Any]]) -> Markup | None:
    """Walking runs then against now, where anything moved."""
    found = [one for one in verdicts if one["walked"][0] != one["walked"][1] and one["runs"]]
    if not found:
        return None
    frame = Frame((-3.0, 103.0), (-3.0, 103.0), "walked then [%]", "walked now [%]", square=False)
    frame.line([0.0, 100.0], [0.0, 100.0], "quiet dash thin")
    for one in found:
        then, now = (100.0 * count / one["runs"] for count in one["walked"])
        said = f"{one['scenario']}: {' → '.join(map(str, one['walked']))}"
        frame.dot(then, now, "good" if one["passed"] else "bad", 5.0, said)
    return tag(
        "div",
        card(
            "What moved",
            frame.svg("walking runs then and now"),
            note="On the dashed line nothing changed; below it fewer walk now.",
        ),
        class_="cards",
    )
