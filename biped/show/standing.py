"""Results of gaits in the standard tests: one table, on a terminal, in Markdown, and in pages of docs/.

`python -m biped.show.standing PAGE TITLE=FOLDER…` takes the tables of results folders into docs/PAGE.md, in place of
those of the same titles. Without any it writes all such pages anew.
"""

import json
import sys
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from biped.base.writing import dumps, write_into, write_text
from biped.scenario.metrics import METRICS
from biped.show.document import DOCS, Document, Line, Paragraph, Table, Words, markdown, replaced

FILE = "standard.json"
PAGES = "standard", "pushing", "robot", "three-d", "engines"
"""Pages of docs/ that have tables of this kind; their data are beside them."""
_OF = {"weight": "m g", "leg": "l", "si": ""}


def document_of(found: Mapping[str, Any]) -> Document:
    """The table and how to read it, as a document.

    Args:
        found: As `biped.studies.standard.StandardTable.as_dict` gives it.
    """
    lines = rows(found)
    wanted = ("wanted",) if any(words for _, words, _ in lines) else ()
    table = tuple((title, *([words] if wanted else []), *cells) for title, words, cells in lines)
    words = (0, 1) if wanted else (0,)
    texts = tuple(Paragraph(note, note=True) for note in notes(found))
    return (Table(("test", *wanted, *found["gaits"]), table, words), *texts)


def rows(found: Mapping[str, Any]) -> list[tuple[str, str, list[Line]]]:
    """Titles of the tests, what is wanted, and what to say of each gait; bold where it is not what is wanted.

    What a test shows that is not searched has rows of its own.

    Args:
        found: As `biped.studies.standard.StandardTable.as_dict` gives it.
    """
    by = {(one["test"], one["gait"]): one for one in found["standings"]}
    lines = []
    for test in found["tests"]:
        standings = [by[test["name"], gait] for gait in found["gaits"]]
        bound = test.get("expect", {}).get(test["goal"]) if test["key"] is None else None
        cells = [_judged("\n".join(lines_of(test, one)), _reached(one, bound), bound) for one in standings]
        lines.append((_with_unit(test["title"], test["unit"]), bound["words"] if bound else "", cells))
        if test["key"] is None:
            lines += _metric_rows(test, standings)
    return lines


def _metric_rows(
    test: Mapping[str, Any], standings: Sequence[Mapping[str, Any]]
) -> Iterator[tuple[str, str, list[Line]]]:
    """Rows of the metrics that a test shows, by gait."""
    for name in test["shows"]:
        metric, bound = METRICS[name], test.get("expect", {}).get(name)
        values = [standing["tried"][0]["numbers"].get(name) if standing["tried"] else None for standing in standings]
        if any(value is not None for value in values):
            words = bound["words"] if bound else ""
            cells = [_judged(metric.text(value).replace("-", "−"), value, bound) for value in values]
            yield _with_unit(f"– {metric.words}", metric.unit), words, cells


def _reached(standing: Mapping[str, Any], bound: Mapping[str, Any] | None) -> float | None:
    """The runs of an ensemble that reached the goal, or their share where the bound is one."""
    if not standing["tried"]:
        return None
    one = standing["tried"][0]
    return one["reached"] / one["runs"] if bound and bound["share"] else one["reached"]


def _judged(text: str, value: float | None, bound: Mapping[str, Any] | None) -> Line:
    """A cell's text, which stands out if its value is not within a bound."""
    if bound is None or value is None:
        return text
    low = bound["min"] is not None and value < bound["min"]
    return Words(text, "bad") if low or (bound["max"] is not None and value > bound["max"]) else text


def _with_unit(title: str, unit: str) -> str:
    return f"{title} [{unit}]" if unit else title


def lines_of(test: Mapping[str, Any], standing: Mapping[str, Any]) -> list[str]:
    """The text of a gait's result in a test."""
    tried, found = standing["tried"], standing["limit"]
    if not tried:
        return ["–"]
    if found is None:
        one = tried[0]
        return [f"{one['reached']} of {one['runs']}", *falls_of(one), *_unsound(one)]
    if found["holds_to"] is None:
        one = tried[0]
        at = _value(test, standing, one["value"])
        return ["none", f"{one['reached']} of {one['runs']} at {at}", *_unsound(one)]
    best = next(one for one in tried if one["value"] == found["holds_to"])
    bound = "" if found["fails_at"] is not None else "≥ "
    sure = "–" if found["sure_to"] is None else _value(test, standing, found["sure_to"])
    lost = "–" if found["surely_fails_at"] is None else _value(test, standing, found["surely_fails_at"])
    lines = [f"{bound}{_value(test, standing, best['value'])}", f"({sure} … {lost})"]
    if _OF[test["of"]]:
        lines.append(f"{best['value']:.3g} {_OF[test['of']]}".replace("-", "−"))
    return [*lines, *_metrics_of(test, best)]


def falls_of(one: Mapping[str, Any]) -> list[str]:
    """How many runs fell where some failed without a fall, such as a policy that is slower than it was told to be."""
    falls = one.get("falls")
    return [f"{falls} fell"] if falls is not None and falls < one["runs"] - one["reached"] else []


def _unsound(one: Mapping[str, Any]) -> list[str]:
    """How many runs have numbers that cannot be believed; nothing where none has."""
    return [f"{one['unsound']} doubtful"] if one.get("unsound") else []


def _value(test: Mapping[str, Any], standing: Mapping[str, Any], value: float) -> str:
    return f"{value * standing['scale'] * test['times']:.3g}".replace("-", "−")


def _metrics_of(test: Mapping[str, Any], one: Mapping[str, Any]) -> list[str]:
    """Metrics that a test shows, where there are any."""
    lines = []
    for name in test["shows"]:
        value, metric = one["numbers"].get(name), METRICS[name]
        if value is not None:
            short = {"cost_of_transport": "c.o.t.", "push_froude": "J/(m√(g l))", "push_share": "bound"}.get(name, "")
            unit = f" {metric.unit}" if metric.unit else ""
            words = short or ("" if name == "speed" else metric.words.split()[0])
            lines.append(f"{words} {metric.text(value)}{unit}".strip().replace("-", "−"))
    return lines


def notes(found: Mapping[str, Any]) -> list[str]:
    """How to read the table."""
    rates = sorted({test["rate"] for test in found["tests"]})
    shares = " or ".join(f"{100.0 * rate:g} %" for rate in rates)
    changes = f" All tests have {', '.join(found['changes'])}." if found["changes"] else ""
    unsound = any(one.get("unsound") for standing in found["standings"] for one in standing["tried"])
    doubt = [
        "Doubtful runs have numbers that cannot be trusted. They reach no goal, even if they walk. biped run with the "
        "same changes says what does not add up. A model file with few solver iterations often needs --set "
        "simulation.iterations=100 --set simulation.ls_iterations=50."
    ]
    searched = (
        f"A searched test shows the largest value that holds: there, and at every easier value that was tried, at "
        f"least {shares} of the runs reach the goal. The brackets have the largest value that is sure to hold and the "
        f"smallest that is sure to fail, by 95 % intervals. ≥ means that nothing that was tried fails. "
    )
    any_searched = any(test["key"] is not None for test in found["tests"])
    wanted = "Bold is what is not as wanted. " if any(test.get("expect") for test in found["tests"]) else ""
    means = f"– means that the test is not for this gait.{changes}"
    return [f"{searched if any_searched else ''}{wanted}{means}", *(doubt if unsound else [])]


def write(found: Mapping[str, Any], folder: Path) -> None:
    """Writes standard.json and standard.md.

    Raises:
        InputError: They cannot be written.
    """
    write_into(folder, {FILE: dumps(found, indent=1), "standard.md": markdown(document_of(found))})


def page(name: str) -> str:
    """The text of a page with the tables that its data make.

    Args:
        name: One of `PAGES`.
    """
    tables = "\n".join(
        f"## {one['title']}\n\n`{one['command']}`\n\n{markdown(document_of(one))}" for one in stored(name)
    )
    return replaced((DOCS / f"{name}.md").read_text(encoding="utf-8"), "tables", tables.rstrip())


def stored(name: str) -> list[dict[str, Any]]:
    """The results of which a page's tables are made."""
    data = DOCS / f"{name}.json"
    return json.loads(data.read_bytes()) if data.exists() else []


def main(argv: Sequence[str]) -> None:
    """Takes results folders, `TITLE=FOLDER` each, into a page, in place of those of the same titles.

    Args:
        argv: The page, then the folders. Without any, all pages are written anew.
    """
    if argv:
        name, *words = argv
        found = stored(name)
        for word in words:
            title, _, folder = word.partition("=")
            one = json.loads((Path(folder) / FILE).read_bytes())
            sets = "".join(f" --set {change}" for change in one["changes"])
            tests = "".join(f" --test {test}" for test in one.get("asked_tests", ()))
            engines = f" --engines {','.join(one['engines'])}" if one.get("engines") else ""
            gaits = " ".join(one.get("asked", one["gaits"]))
            found.append(one | {"title": title, "command": f"biped standard {gaits}{tests}{sets}{engines}"})
        write_text(DOCS / f"{name}.json", dumps(list({one["title"]: one for one in found}.values())))
    for name in argv[:1] or PAGES:
        write_text(DOCS / f"{name}.md", page(name))


if __name__ == "__main__":
    main(sys.argv[1:])
