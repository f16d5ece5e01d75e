"""Tables of what was judged, in Markdown, and where they stand in the docs."""

from __future__ import annotations

import math
import re
from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping
from pathlib import Path

from tests.lies.judge import FALSE, HONEST, LIES, MEASURES, Judged

Noted = Mapping[tuple[str, int], Judged]
"""By kind and number."""
DOCS = Path(__file__).parents[2] / "docs"
PAGES = {"sums": "reliability.md", "confusion": "reliability.md", "floor": "reliability.md", "power": "reliability.md",
         "honest": "results.md"}  # fmt: skip
MEANS = ("force", "moment", "speed")


def write(tables: Mapping[str, str]) -> None:
    """Puts tables into the docs, each between the two marks of its name."""
    for name, table in tables.items():
        path = DOCS / PAGES[name]
        text = path.read_text(encoding="utf-8")
        whole = re.compile(f"(<!-- lies: {name} -->\n).*?(<!-- end -->)", re.DOTALL)
        path.write_text(whole.sub(lambda found, table=table: found[1] + table + found[2], text), encoding="utf-8")


def _table(head: Iterable[str], rows: Iterable[Iterable[object]]) -> str:
    head = list(head)
    lines = [head, ["---"] * len(head), *rows]
    return "".join(f"| {' | '.join(str(cell) for cell in line)} |\n" for line in lines)


def sums(found: Noted) -> str:
    """Every kind: how many, and how many of them were taken for what they are not."""
    rows = []
    for kind in dict.fromkeys(kind for kind, _ in found if kind in FALSE):
        ends = Counter(one.found for (of, _), one in found.items() if of == kind)
        wrong = sum(ends[end] for end in FALSE[kind])
        rows.append((kind, sum(ends.values()), " or ".join(FALSE[kind]), wrong))
    return _table(("kind", "cases", "must not be", "were"), rows)


def confusion(found: Noted) -> str:
    """What was judged against what it was found to be."""
    of = {one: noted for one, noted in found.items() if one[0] in FALSE}
    order = [*LIES, "alarm", "held", "diverged", "doubtful", "refused", "idle", "fell", "stayed up"]
    ends = [end for end in order if end in LIES or any(noted.found == end for noted in of.values())]
    counts = Counter((kind, noted.group, noted.found) for (kind, _), noted in of.items())
    groups = dict.fromkeys(sorted({(kind, group) for kind, group, _ in counts}, key=lambda one: _place(*one)))
    return _table(("of", "group", *ends), ((kind, group, *(counts[kind, group, end] or "" for end in ends))
                                           for kind, group in groups))  # fmt: skip


def _place(kind: str, group: str) -> tuple[int, str]:
    return list(FALSE).index(kind), group


def floor(found: Noted) -> str:
    """The most that nothing explains of honest runs, per mille: over 0.2 s, over 2 s."""
    most: dict[tuple[str, str, bool], dict[str, float]] = defaultdict(dict)
    count: Counter[tuple[str, str, bool]] = Counter()
    for (kind, _), one in found.items():
        if kind not in HONEST or not one.numbers:
            continue
        key = kind, one.group, bool(one.numbers["sampled"])
        count[key] += 1
        for name in (f"{mean} {long}" for mean in MEANS for long in ("short", "long")):
            most[key][name] = max(most[key].get(name, 0.0), one.numbers[name])
    rows = []
    for kind, group, sampled in sorted(most, key=lambda key: (_place(*key[:2]), key[2])):
        cells = most[kind, group, sampled]
        means = (", ".join(f"{1000.0 * cells[f'{mean} {long}']:.3g}" for long in ("short", "long")) for mean in MEANS)
        rows.append((kind, group + (", sampled" if sampled else ""), count[kind, group, sampled], *means))
    return _table(("of", "group", "runs", "force", "moment", "speed"), rows)


def power(found: Noted) -> str:
    """The weakest help of every group that was caught: its median kind and the worst of its kinds."""
    groups: dict[tuple[str, str], list[Judged]] = defaultdict(list)
    for (kind, _), one in found.items():
        if kind == "power":
            groups[one.group, one.numbers["unit"]].append(one)
    rows = []
    for (group, unit), some in groups.items():
        caught = sorted(one.numbers["weakest"] for one in some if one.found == "caught")
        ends = Counter(one.found for one in some)
        weakest = (f"{caught[len(caught) // 2]:.2g}", f"{caught[-1]:.2g}") if caught else ("–", "–")
        rows.append((group, len(some), ends["missed"] or "", ends["idle"] or "", unit, *weakest))
    head = ("help", "kinds", "missed", "idle", "1 is", "weakest that is caught, median", "of the worst kind")
    return _table(head, rows)


def honest(found: Noted) -> str:
    """Slip, sinking, tilt and weight on the feet of honest runs that walked, stood or sat: how they are spread."""
    rows = []
    for end in LIES:
        some = [one.numbers for (kind, _), one in found.items() if kind in HONEST and one.found == end]
        for name in MEASURES:
            values = sorted(one[name] for one in some if not math.isnan(one.get(name, math.nan)))
            if values:
                cells = (values[int(share * (len(values) - 1))] for share in (0.0, 0.01, 0.5, 0.99, 1.0))
                rows.append((end, name, len(values), *(f"{value:.3g}" for value in cells)))
    return _table(("honest runs that", "", "runs", "least", "1 %", "median", "99 %", "most"), rows)
