"""Charts of an ensemble: speed against cost, how runs ended, and which drawn value explains those that did not walk."""

from collections.abc import Mapping, Sequence
from typing import Any

from biped.base.statistics import wilson
from biped.ensemble.checks import GOALS
from biped.measure.metrics.walking import kind_of
from biped.show.page.html import Markup, between, card, key_words, tag
from biped.show.page.plot import Frame, around, legend
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
