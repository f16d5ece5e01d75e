"""Charts of an ensemble: speed against cost, how runs ended, and which drawn value explains those that did not walk.

Of a sweep: how many reached their goal at every point, as a line with intervals or as a map, and the cost.
"""

import math
from collections.abc import Mapping, Sequence
from typing import Any

from biped.base.statistics import enough_for, wilson
from biped.ensemble.checks import GOALS
from biped.ensemble.results import goal_at, threshold_words
from biped.measure.metrics.walking import kind_of
from biped.scenario.metrics import HEAD, METRICS
from biped.show.document import between, percent, value_of
from biped.show.page.html import Frame, Markup, around, card, key_words, legend, scroll, setting, shade, table, tag
from biped.show.results import real
from biped.studies.sensitivity import LEAST, Share

Rows = Sequence[Mapping[str, Any]]
_DOTS = 1500
"""Most runs drawn as dots."""


def costs(rows: Rows, thesis: Mapping[str, float]) -> Markup | None:
    """Speed of every walker against its net cost of transport, and the thesis's."""
    walkers = [row for row in rows if row["walked"] and real(row["speed"]) and real(row["cost_of_transport"])]
    if not walkers:
        return None
    theirs = thesis if {"speed", "cost_of_transport"} <= thesis.keys() else None
    drawn = walkers[:: max(1, -(-len(walkers) // _DOTS))]
    speeds, spent = [row["speed"] for row in drawn], [row["cost_of_transport"] for row in drawn]
    frame = Frame(
        around([*speeds, *([theirs["speed"]] if theirs else [])], 0.1),
        around([*spent, *([theirs["cost_of_transport"]] if theirs else [])], 0.1), "speed [m/s]",
        "net cost of transport",
    )  # fmt: skip
    for row in drawn:
        frame.dot(row["speed"], row["cost_of_transport"], "accent", 3.0, f"run {row['index']}")
    if theirs:
        frame.dot(theirs["speed"], theirs["cost_of_transport"], "other", 6.0, "the thesis")
    key = legend([("accent", "runs that walked"), *([("other", "the thesis")] if theirs else [])])
    note = None if len(drawn) == len(walkers) else f"{len(drawn)} of {len(walkers)} drawn."
    return card("Speed against cost of transport", key, frame.svg("speed against cost of transport"), note=note)


def endings(rows: Rows, goal: str = "walked") -> Markup:
    """How runs ended: every kind with its count, its interval and when."""
    kinds: dict[str, list[float]] = {}
    for row in rows:
        kinds.setdefault(kind_of(row), []).append(row["time"])
    order = sorted(kinds, key=lambda kind: (not kind.startswith(goal), -len(kinds[kind])))
    lines = []
    for kind in order:
        times, share = kinds[kind], len(kinds[kind]) / len(rows)
        colour = "good" if kind.startswith(goal) else "quiet" if kind.startswith(("stood", "stayed")) else ""
        when = ""
        if kind != "walked" and min(times) < max(row["time"] for row in rows):
            when = f" after {min(times):.1f} – {max(times):.1f} s" if len(times) > 1 else f" after {times[0]:.1f} s"
        bar = tag("div", tag("i", class_=colour or None, style=f"width:{100 * share:.1f}%"), class_="track")
        low, high = wilson(len(times), len(rows))
        count = tag("span", f"{len(times)} ", tag("small", f"({between(low, high)})"), class_="n")
        lines.append(tag("div", tag("span", kind, tag("small", when, class_="about")), count, bar, class_="end"))
    return card("How runs ended", tag("div", *lines, class_="ends"), note="In brackets 95 % intervals of the rates.")


def causes(shares: Sequence[Share], rows: Rows, goal: str = "walked", space: bool = False) -> list[Markup]:
    """Which drawn value explains the runs that missed their goal."""
    title = f"What explains the runs that did not {GOALS[goal]}"
    failed = sum(not row[goal] for row in rows)
    if not shares:
        if failed == 0:
            return []
        if failed == len(rows):
            why = f"No run {goal}: what was drawn made no difference."
        elif len(rows) < LEAST:
            why = f"{len(rows)} runs are too few to say; it takes {LEAST}."
        else:
            why = "Nothing was drawn that is a single number or word."
        return [card(title, tag("p", why, class_="about"))]
    shown = shares[:8]
    height = 34.0 * len(shown) + 66.0
    high = max(0.05, *(share.interval[1] for share in shown))
    low = min(0.0, *(share.index for share in shown))
    frame = Frame((low, high), (-0.5, len(shown) - 0.5),
                  "share of the variance explained", "", rungs=[""] * len(shown), height=height,
                  left=12.0)  # fmt: skip
    for i, share in enumerate(shown):
        y = float(len(shown) - 1 - i)
        kind = "accent" if share.sure else "quiet"
        (a, q), (b, _) = frame.at(share.interval[0], y - 0.2), frame.at(share.interval[1], y - 0.2)
        frame.add(tag("path", d=f"M{a:.1f} {q:.1f}H{b:.1f}M{a:.1f} {q - 3:.1f}v6M{b:.1f} {q - 3:.1f}v6",
                      class_=f"line {kind}"))  # fmt: skip
        frame.dot(share.index, y - 0.2, kind, 4.0, f"{share.index:.3f}")
        left, _ = frame.at(low, y)
        frame.add(tag("text", key_words(share.name, space), x=round(left, 1), y=round(q - 8, 1)))
    sure = [share for share in shares if share.sure]
    names = ", ".join(key_words(share.name, space) for share in sure[:3])
    said = f"Explains more than chance: {names}." if sure else "Nothing that was drawn explains more than chance would."
    more = (
        f" {len(shares)} values were looked at: of twenty without effect, one shows by chance."
        if len(shares) > 1
        else ""
    )
    cards = [card(title, tag("p", said), frame.svg("sensitivities with intervals"),
                  note="First-order sensitivity Var(E[y|x])/Var(y) with its 95 % interval." + more)]  # fmt: skip
    return [*cards, _by_class((sure or list(shares))[0], goal, space)]


def _by_class(share: Share, goal: str, space: bool) -> Markup:
    """How many missed their goal in each class of one drawn value."""
    count = len(share.labels)
    labels = share.labels if count <= 4 else [label.split(" … ")[0] for label in share.labels]
    across = key_words(share.name, space) + (", from" if labels != share.labels else "")
    frame = Frame((-0.6, count - 0.4), (0.0, 100.0), across, f"did not {GOALS[goal]} [%]", ticks=labels)
    for i, (failed, runs) in enumerate(zip(share.failed, share.runs, strict=True)):
        low, high = wilson(failed, runs)
        rate = failed / runs
        frame.rect((i - 0.32, i + 0.32), (0.0, 100.0 * rate), "bar bad", f"{share.labels[i]}: {failed} of {runs}")
        frame.whisker(i, (100.0 * low, 100.0 * high), "")
    return card(f"By {key_words(share.name, space)}", frame.svg(f"failures by {share.name}"),
                note="Runs sorted by this value, in classes of equal size; bars are 95 % intervals.")  # fmt: skip


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


def enough_words(rate: float, runs: int) -> str | None:
    """How many runs at a point it takes to claim a rate, where there are fewer."""
    enough = enough_for(rate)
    if enough is None or runs >= enough:
        return None
    return f"{runs} runs at a point cannot claim a rate of {percent(rate)}: that takes {enough}, all of which walk."
