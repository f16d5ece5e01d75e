"""Gaits and policies beside each other: what each withstands, and whether the gait sensitivity norm foretells it.

`python -m biped.show.atlas FOLDER…` takes results folders of `biped standard --atlas` into docs/atlas.md, where they
replace what was known of the same gait; without any, it writes the page anew.
"""

import json
import math
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from biped.base.statistics import rank_correlation, wilson
from biped.base.writing import dumps, write_text
from biped.show.document import DOCS, Document, Paragraph, Table, filled, markdown
from biped.show.standing import FILE as STANDARD

PAGE, TEMPLATE, DATA = DOCS / "atlas.md", DOCS / "atlas.in.md", DOCS / "atlas.json"
PUSHES, RISES = ("push forward", "push backward"), ("step up", "step down")
"""Disturbances of `biped stability --norm` whose norms are shown together, as the root of their mean square."""
_LEVEL = "level"
_TESTS = {
    "push_forward": "push forward", "push_backward": "push backward", "push_sideways": "push to the left",
    "slope_up": "slope up [°]", "slope_down": "slope down [°]", "steps_up": "steps up [l]",
    "steps_down": "steps down [l]",
}  # fmt: skip
"""Tests whose limits are columns, and their headings."""
_OTHERS = {"delay": ("delay [ms]", 1000.0), "unmodelled": ("unmodelled torques [% of the limits]", 100.0)}
"""Tests whose limits are columns of the second table: their headings, and what values are multiplied by."""
_RANDOM = "random_push"
GROWN = 1e-3
"""Push [m √(g l)] whose growth is shown."""


class Largest(NamedTuple):
    """The largest disturbance of a kind that a gait withstands.

    Attributes:
        value: Of a push J/(m√(g l)), of a slope degrees, of a step leg lengths; 0: not even the smallest tried.
        sure: The largest of which 95 % intervals are sure; None: of none.
        fails: The smallest that surely fails; None: none.
        most: Whether nothing larger was tried.
        share: Of a push, how much of what any controller could survive it is; None: not known.
    """

    value: float
    sure: float | None
    fails: float | None
    most: bool
    share: float | None = None

    @property
    def text(self) -> str:
        """The value, and in brackets what is sure."""
        bounds = " … ".join("–" if one is None else f"{one:.3g}" for one in (self.sure, self.fails))
        share = "" if self.share is None else f", {100.0 * self.share:.0f} %"
        return f"{'≥ ' if self.most else ''}{self.value:.3g} ({bounds}){share}"


def withstood(tables: Sequence[Mapping[str, Any]], space: bool) -> dict[str, dict[str, Any]]:
    """The level walk of each gait, and the largest disturbance of each kind that it withstands.

    Args:
        tables: As `biped standard` writes them; a later one replaces a gait's numbers of an earlier one.
        space: Whether those of the tests in space, or of those in the plane.
    """
    out: dict[str, dict[str, Any]] = {}
    for table in tables:
        for one in table["standings"]:
            name = one["test"].rpartition("/")[2]
            if not one["tried"] or name.startswith("space_") != space:
                continue
            row = out.setdefault(one["gait"], {})
            name = name.removeprefix("space_")
            row[name] = one["tried"][0] if name in (_LEVEL, _RANDOM) else _largest(name, one)
    return out


def _largest(name: str, one: Mapping[str, Any]) -> Largest | None:
    """The largest of one kind that a gait withstands; None of a kind that is no column."""
    limit, tried = one["limit"], one["tried"]
    if name not in (*_TESTS, *_OTHERS) or limit is None:
        return None
    unit = _OTHERS[name][1] if name in _OTHERS else 1.0
    if name.startswith("push"):  # an impulse in proportion to what is searched
        shares = [one["numbers"]["push_froude"] / one["value"] for one in tried if one["numbers"].get("push_froude")]
        if not shares:
            return None
        unit = shares[0]

    def size(value: float | None) -> float | None:
        return None if value is None else abs(unit * value)

    best = next((one["numbers"] for one in tried if one["value"] == limit["holds_to"]), {})
    return Largest(size(limit["holds_to"]) or 0.0, size(limit["sure_to"]), size(limit["surely_fails_at"]),
                   limit["fails_at"] is None, best.get("push_share"))  # fmt: skip


def table_of(found: Mapping[str, Mapping[str, Any]]) -> Table:
    """One line for each gait."""
    tests = [(name, head) for name, head in _TESTS.items() if any(name in row for row in found.values())]
    lines = []
    for gait, row in found.items():
        level = row.get(_LEVEL)
        walked = ("–", "–", "–") if level is None else (
            f"{level['reached']} of {level['runs']}", _text(level["numbers"].get("speed"), "{:.2f}"),
            _text(level["numbers"].get("cost_of_transport"), "{:.2f}"))  # fmt: skip
        stands = [row.get(name) for name, _ in tests]
        lines.append((gait, *walked, *("–" if one is None else one.text for one in stands)))
    return Table(("gait", "level", "speed [m/s]", "c.o.t.", *(head for _, head in tests)), tuple(lines))


def others_of(
    found: Mapping[str, Mapping[str, Any]], grown: Mapping[str, Sequence[Mapping[str, Any]]],
    norms: Mapping[str, Sequence[Mapping[str, Any]]],
) -> Document:  # fmt: skip
    """One line for each gait of which a delay, growth, a random force or torques that nobody modelled are known."""
    lines = []
    for gait, row in found.items():
        stands = [row.get(name) for name in _OTHERS]
        norm = norms_of(norms.get(gait, ()), PUSHES)
        growth = next((one for one in grown.get(gait, ()) if one["size"] == GROWN), None)
        cells = (
            stands[0].text if stands[0] else "–", _growth_text(growth),
            _norm_text(norm), _steps_text(row.get(_RANDOM)),
            stands[1].text if stands[1] else "–",
        )  # fmt: skip
        if set(cells) != {"–"}:
            lines.append((gait, *cells))
    delay, torques = (head for head, _ in _OTHERS.values())
    heads = ("gait", delay, "growth per stride", "norm of pushes", "steps to a fall", torques)
    return (Table(heads, tuple(lines)),) if lines else ()


def _growth_text(one: Mapping[str, Any] | None) -> str:
    if one is None or one["factor"] is None or math.isnan(one["factor"]):
        return "–"
    factor, low, high = (f"{float(f'{one[name]:.2g}'):g}" for name in ("factor", "low", "high"))
    return f"{factor} (–)" if one["low"] == one["high"] else f"{factor} ({low} … {high})"  # of one pair there is none


def steps_to_fall(one: Mapping[str, Any]) -> tuple[float, float, float]:
    """Mean number of steps to a fall and its 95 % interval, each step as dangerous as any other.

    Args:
        one: Walks under a random force; their steps are those of the walks that did not fall. Where it has no number of
            falls, whoever does not walk has fallen.
    """
    numbers, runs = one["numbers"], one["runs"]
    falls = numbers.get("falls")
    up = one["reached"] if falls is None else runs - round(falls)
    steps, (low, high) = numbers.get("steps") or math.nan, wilson(up, runs)

    def at(stood: float) -> float:
        return math.inf if stood >= 1.0 else 0.0 if stood <= 0.0 else steps / -math.log(stood)

    return at(up / runs), at(low), at(high)


def _steps_text(one: Mapping[str, Any] | None) -> str:
    if one is None:
        return "–"
    value, low, high = steps_to_fall(one)
    return f"> {low:.3g}" if math.isinf(value) else f"{value:.3g} ({low:.3g} … {high:.3g})"


def rows_of(found: Mapping[str, Any]) -> Document:
    """The rows of results of `biped standard --atlas`, as a document."""
    parts: list[Any] = []
    for space in (False, True):
        rows = withstood([found], space)
        if rows:
            parts += [table_of(rows), *others_of(rows, found["growth"], found["norms"])]
    norms = {gait: kinds for gait, kinds in found["norms"].items() if kinds}
    return (*parts, *foretold(withstood([found], space=False), norms)) if norms else tuple(parts)


def _norm_text(norm: float) -> str:
    return "–" if math.isnan(norm) else f"{norm:.1f}" if norm else "within scatter"


def _text(value: float | None, form: str) -> str:
    return "–" if value is None else form.format(value)


def norms_of(kinds: Sequence[Mapping[str, Any]], wanted: Sequence[str]) -> float:
    """The norm of several kinds of disturbances together; nan where one is missing or too many walks fell.

    It is 0 where one of them changes the steps less than they scatter by themselves: what it would be is not known.
    """
    values = [one["norm"] for one in kinds if one["disturbance"] in wanted and 2 * one["fell"] <= one["walks"]]
    if len(values) < len(wanted) or any(value is None for value in values):
        return math.nan
    return math.sqrt(sum(value**2 for value in values) / len(values)) if all(values) else 0.0


def foretold(found: Mapping[str, Mapping[str, Any]], norms: Mapping[str, Sequence[Mapping[str, Any]]]) -> Document:
    """The norms of gaits beside what they withstand, and how well the ranks of both agree."""
    lines, pairs = [], {"pushes": [], "steps": [], "pushes and the random force": []}
    for gait, kinds in norms.items():
        row = found.get(gait, {})
        pushes, steps = norms_of(kinds, PUSHES), norms_of(kinds, RISES)
        to_fall = steps_to_fall(row[_RANDOM])[0] if _RANDOM in row else None
        stands = _mean(row, "push_forward", "push_backward"), _mean(row, "steps_up", "steps_down"), to_fall
        fell = f"{sum(one['fell'] for one in kinds)} of {sum(one['walks'] for one in kinds)}"
        lines.append((gait, _norm_text(pushes), _norm_text(steps), *(_text(value, "{:.3g}") for value in stands), fell))
        for name, norm, value in zip(pairs, (pushes, steps, pushes), stands, strict=True):
            if value is not None and norm != 0.0:
                pairs[name].append((math.inf if math.isnan(norm) else norm, value))
    heads = ("gait", "norm of pushes", "norm of steps", "pushes withstood, mean", "steps withstood, mean [l]",
             "steps to a fall", "fell")  # fmt: skip
    words = [_agreement(name, both) for name, both in pairs.items()]
    return Table(heads, tuple(lines)), *(Paragraph(word) for word in words)


def _mean(row: Mapping[str, Any], *names: str) -> float | None:
    values = [one.value for one in (row.get(name) for name in names) if one is not None]
    return sum(values) / len(names) if len(values) == len(names) else None


def _agreement(name: str, pairs: Sequence[tuple[float, float]]) -> str:
    norms, stands = ([one[i] for one in pairs] for i in (0, 1))
    if len(pairs) < 4:
        return f"Of {name}: too few gaits for a correlation."
    rho, low, high = rank_correlation([-norm for norm in norms], stands)
    return (f"Of {name}: the rank correlation of a small norm with what is withstood is {rho:.2f} "
            f"(95 % interval {low:.2f} … {high:.2f}, {len(pairs)} gaits).").replace("-", "−")  # fmt: skip


def page(stored: Mapping[str, Any]) -> str:
    """The text of docs/atlas.md."""
    plane, space = withstood(stored["tables"], space=False), withstood(stored["tables"], space=True)
    norms = {gait: kinds for gait, kinds in stored["norms"].items() if gait in plane}
    parts = {
        "plane": (table_of(plane),), "other": others_of(plane, stored["growth"], norms), "space": (table_of(space),),
        "space other": others_of(space, stored["growth"], stored["norms"]), "norm": foretold(plane, norms),
    }  # fmt: skip
    return filled(TEMPLATE, {name: markdown(document).rstrip() for name, document in parts.items()})


def stored() -> dict[str, Any]:
    """The page's data: tables of `biped standard --atlas`, and of each gait the norms and the growth."""
    empty: dict[str, Any] = {"tables": [], "norms": {}, "growth": {}}
    return empty | (json.loads(DATA.read_bytes()) if DATA.is_file() else {})


def taken_in(known: Mapping[str, Any], found: Mapping[str, Any]) -> dict[str, Any]:
    """Data with results of `biped standard --atlas`, which replace what was known of the same gaits."""
    new = found.get("norms", {}), found.get("growth", {})
    again = {(one["test"], one["gait"]) for one in found["standings"]}
    tables = [{"standings": [one for one in table["standings"] if (one["test"], one["gait"]) not in again]}
              for table in known["tables"]]  # fmt: skip
    tables.append({"standings": [one for one in found["standings"] if one["tried"]]})
    return {"tables": [table for table in tables if table["standings"]],
            "norms": {**known["norms"], **new[0]}, "growth": {**known["growth"], **new[1]}}  # fmt: skip


def main(argv: Sequence[str]) -> None:
    """Takes results folders into the page; without any, writes the page anew."""
    known = stored()
    for folder in argv:
        known = taken_in(known, json.loads((Path(folder) / STANDARD).read_bytes()))
    if argv:
        write_text(DATA, dumps(known))
    write_text(PAGE, page(known))


if __name__ == "__main__":
    main(sys.argv[1:])
