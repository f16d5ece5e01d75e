"""Results of gaits in the standard tests: one table, on a terminal, in Markdown, and in docs/standard.md.

`python -m biped.show.standing FOLDER…` writes the tables of results folders into docs/standard.md.
"""

import json
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from biped.base.writing import dumps, write_into, write_text
from biped.scenario.metrics import METRICS
from biped.show.document import DOCS, Document, Paragraph, Table, filled, markdown

FILE = "standard.json"
PAGE, TEMPLATE, DATA = DOCS / "standard.md", DOCS / "standard.in.md", DOCS / "standard.json"
_OF = {"weight": "m g", "leg": "l", "si": ""}


def document_of(found: Mapping[str, Any]) -> Document:
    """The table and how to read it, as a document."""
    lines = tuple((title, *("\n".join(cell) for cell in cells)) for title, cells in rows(found))
    return (Table(("test", *found["gaits"]), lines), *(Paragraph(note, note=True) for note in notes(found)))


def rows(found: Mapping[str, Any]) -> list[tuple[str, list[list[str]]]]:
    """Titles of the tests, and what to say of each gait, line by line.

    Args:
        found: As `biped.studies.standard.StandardTable.as_dict` gives it.
    """
    by = {(one["test"], one["gait"]): one for one in found["standings"]}
    return [
        (_title(test), [lines_of(test, by[test["name"], gait]) for gait in found["gaits"]]) for test in found["tests"]
    ]


def _title(test: Mapping[str, Any]) -> str:
    return f"{test['title']} [{test['unit']}]" if test["unit"] else test["title"]


def lines_of(test: Mapping[str, Any], standing: Mapping[str, Any]) -> list[str]:
    """The text of a gait's result in a test."""
    tried, found = standing["tried"], standing["limit"]
    if not tried:
        return ["–"]
    if found is None:
        one = tried[0]
        return [f"{one['reached']} of {one['runs']}", *falls_of(one), *_unsound(one), *_metrics_of(test, one)]
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
    return [
        f"A searched test shows the largest value that holds: there, and at every easier value that was tried, at "
        f"least {shares} of the runs reach the goal. The brackets have the largest value that is sure to hold and the "
        f"smallest that is sure to fail, by 95 % intervals. ≥ means that nothing that was tried fails. – means that "
        f"the test is not for this gait.{changes}",
        *(doubt if unsound else []),
    ]


def write(found: Mapping[str, Any], folder: Path) -> None:
    """Writes standard.json and standard.md.

    Raises:
        InputError: They cannot be written.
    """
    write_into(folder, {FILE: dumps(found, indent=1), "standard.md": markdown(document_of(found))})


def page(stored: Sequence[Mapping[str, Any]]) -> str:
    """The text of docs/standard.md."""
    tables = "\n".join(f"## {one['title']}\n\n`{one['command']}`\n\n{markdown(document_of(one))}" for one in stored)
    return filled(TEMPLATE, {"tables": tables.rstrip()})


def stored() -> list[dict[str, Any]]:
    """The generated parts of docs/standard.md."""
    return json.loads(DATA.read_bytes()) if DATA.exists() else []


def main(argv: Sequence[str]) -> None:
    """Takes results folders, `TITLE=FOLDER` each, into the page, in place of those of the same titles.

    Without any, it writes the page anew.
    """
    if argv:
        found = stored()
        for word in argv:
            title, _, folder = word.partition("=")
            one = json.loads((Path(folder) / FILE).read_bytes())
            sets = "".join(f" --set {change}" for change in one["changes"])
            engines = f" --engines {','.join(one['engines'])}" if one.get("engines") else ""
            gaits = " ".join(one.get("asked", one["gaits"]))
            found.append(one | {"title": title, "command": f"biped standard {gaits}{sets}{engines}"})
        write_text(DATA, dumps(list({one["title"]: one for one in found}.values())))
    write_text(PAGE, page(stored()))


if __name__ == "__main__":
    main(sys.argv[1:])
