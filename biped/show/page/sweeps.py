"""Charts of a sweep: how many reached their goal at every point, as a line with intervals or as a map, and the cost."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

from biped.ensemble.sweeps import goal_at, threshold_words
from biped.scenario.metrics import HEAD, METRICS
from biped.show.page.claims import enough_words
from biped.show.page.html import Markup, between, card, key_words, percent, scroll, setting, table, tag, value_of
from biped.show.page.plot import Frame, around, legend, shade

Points = Sequence[Mapping[str, Any]]
MAP_FROM = 16
"""Points of a sweep of two keys above which it is a map."""
_KINDS = ("accent", "bad", "good", "other", "push", "quiet")


def sweep(points: Points, thresholds: Points, space: bool = False) -> list[Markup]:
    """Cards of a sweep."""
    keys = list(points[0]["values"])
    large = len(keys) == 2 and len(points) > MAP_FROM
    cards = [_map(points, keys, space) if large else _rates(points, keys, space)]
    if not large and goal_at(points[0])[0] == "walked":  # who has to stand has no speed
        cards += [_means(points, keys, name, space) for name in ("speed", "cost_of_transport")]
    cards.append(_words(thresholds, points, space))
    return cards


def points_table(points: Points, space: bool = False) -> Markup:
    """Every point of a sweep with its interval and its means."""
    keys = list(points[0]["values"])
    rows = [
        (*(value_of(point["values"][key]) for key in keys), f"{goal_at(point)[1]} of {point['runs']}",
         between(*point["interval"]), point["falls"], *(METRICS[name].text(point[name]) for name in HEAD))
        for point in points
    ]  # fmt: skip
    head = (
        *(key_words(key, space) for key in keys),
        goal_at(points[0])[0],
        "95 % interval",
        "fell",
        *(METRICS[name].words for name in HEAD),
    )
    return tag("details", tag("summary", f"All {len(points)} points as numbers"), table(head, rows, words=()))


def _words(thresholds: Points, points: Points, space: bool) -> Markup:
    said = [
        tag("p", _sentence(threshold_words({**found, "key": key_words(found["key"], space)}))) for found in thresholds
    ]
    if not said:
        said = [tag("p", "No threshold: the first swept key has no size, or points are missing.")]
    elif (few := enough_words(thresholds[0]["rate"], min(point["runs"] for point in points))) is not None:
        said.append(tag("p", few, class_="about"))
    return card("How far it holds", *said)


def _sentence(words: str) -> str:
    return words[0].upper() + words[1:] + "."


def _axis(points: Points, key: str) -> tuple[list[Any], list[float], list[str] | None]:
    """Values of a key, where they stand on an axis, and their names where they are no numbers."""
    values = list(dict.fromkeys(point["values"][key] for point in points))
    if all(isinstance(value, int | float) and not isinstance(value, bool) for value in values):
        values.sort()
        return values, [float(value) for value in values], None
    return values, [float(i) for i in range(len(values))], [value_of(value) for value in values]


def _groups(points: Points, keys: list[str], space: bool) -> list[tuple[str, list[Mapping[str, Any]]]]:
    if len(keys) == 1:
        return [("", list(points))]
    first = list(dict.fromkeys(point["values"][keys[0]] for point in points))
    return [(setting(keys[0], value, space), [p for p in points if p["values"][keys[0]] == value]) for value in first]


def _framed(
    points: Points, keys: list[str], y: tuple[float, float], up: str, space: bool
) -> tuple[Frame, dict[Any, float], float]:
    values, places, names = _axis(points, keys[-1])
    low, high = (-0.5, len(values) - 0.5) if names else around(places)
    frame = Frame((low, high), y, key_words(keys[-1], space), up, ticks=names)
    return frame, dict(zip(values, places, strict=True)), (high - low) * 0.012


def _rates(points: Points, keys: list[str], space: bool) -> Markup:
    goal = goal_at(points[0])[0]
    frame, place, aside = _framed(points, keys, (0.0, 100.0), f"{goal} [%]", space)
    groups = _groups(points, keys, space)
    for i, (name, mine) in enumerate(groups):
        kind = _KINDS[i % len(_KINDS)]
        x = [place[p["values"][keys[-1]]] + aside * (i - 0.5 * (len(groups) - 1)) for p in mine]
        if len(place) == len(mine):
            order = sorted(range(len(mine)), key=x.__getitem__)
            frame.line([x[j] for j in order], [100.0 * mine[j]["rate"] for j in order], f"{kind} thin")
        for at, p in zip(x, mine, strict=True):
            low, high = (100.0 * bound for bound in p["interval"])
            frame.whisker(at, (low, high), kind)
            count = f"{goal_at(p)[1]} of {p['runs']} ({between(*p['interval'])})"
            said = f"{name} {value_of(p['values'][keys[-1]])}: {count}"
            frame.dot(at, 100.0 * p["rate"], kind, 4.0, said.strip())
    key = None if len(groups) == 1 else legend([(_KINDS[i % len(_KINDS)], name) for i, (name, _) in enumerate(groups)])
    return card(f"How many {goal}", key, frame.svg(f"rate of runs that {goal} along the sweep"),
                note="Bars are Wilson's 95 % intervals.")  # fmt: skip


def _means(points: Points, keys: list[str], metric: str, space: bool) -> Markup:
    unit = METRICS[metric].unit
    found = [point for point in points if point[metric] is not None and math.isfinite(point[metric])]
    title = METRICS[metric].words
    if not found:
        return card(title.capitalize(), tag("p", "None: nothing walked far enough.", class_="about"))
    y = around(point[metric] for point in found)
    frame, place, _ = _framed(points, keys, y, f"{title} [{unit}]" if unit else f"{title} (net)", space)
    for i, (_, mine) in enumerate(_groups(found, keys, space)):
        kind = _KINDS[i % len(_KINDS)]
        at = sorted((place[p["values"][keys[-1]]], p[metric]) for p in mine)
        frame.line([x for x, _ in at], [value for _, value in at], f"{kind} thin")
        for x, value in at:
            frame.dot(x, value, kind, 4.0, METRICS[metric].text(value))
    return card(f"{title.capitalize()} of those that walked", frame.svg(f"{title} along the sweep"))


def _map(points: Points, keys: list[str], space: bool) -> Markup:
    up, across = keys
    rows, columns = ([v for v in _axis(points, key)[0]] for key in keys)
    height = 26.0 * len(rows) + 70.0
    width = max(440.0, 48.0 * len(columns) + 90.0)
    frame = Frame(
        (-0.5, len(columns) - 0.5),
        (-0.5, len(rows) - 0.5),
        key_words(across, space),
        key_words(up, space),
        ticks=[value_of(v) for v in columns],
        rungs=[value_of(v) for v in rows],
        width=width,
        height=height,
    )
    for p in points:
        i, j = rows.index(p["values"][up]), columns.index(p["values"][across])
        fill, ink = shade(p["rate"])
        count = f"{goal_at(p)[1]} of {p['runs']} ({between(*p['interval'])})"
        said = f"{value_of(rows[i])}, {value_of(columns[j])}: {count}"
        frame.rect((j - 0.48, j + 0.48), (i - 0.46, i + 0.46), "", said, fill)
        frame.add(tag("text", percent(p["rate"]).removesuffix(" %"), **_at(frame, j, i), text_anchor="middle",
                      class_="cell", style=f"fill:{ink}"))  # fmt: skip
    fewest, goal = min(p["runs"] for p in points), goal_at(points[0])[0]
    return card(f"{'Push map' if any(key.startswith('push.') for key in keys) else 'Map'}: how many {goal} [%]",
                scroll(frame.svg(f"rate of runs that {goal} over two keys"), "map"), wide=True,
                note=f"{fewest} runs a cell at least. Dark: none {goal}; light: all did.")  # fmt: skip


def _at(frame: Frame, x: float, y: float) -> dict[str, float]:
    p, q = frame.at(x, y)
    return {"x": round(p, 1), "y": round(q + 4.0, 1)}
