"""Robots of others beside each other: tables of docs/any-biped.md, from results of the tests any/cells.

`python -m biped.show.walks ROBOT=FOLDER[,SEARCH]…` takes results folders of `biped standard`, and of the `biped tune`
that found the gait, into the page. They replace what it had of these tests; tests that a folder has not are kept if
they are of the same gait. `policy:ROBOT=FOLDER` takes results of a learned policy of the robot, which stand beside
those of the law. Without any folder the page is written anew.
"""

import json
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from biped.base.writing import dumps, write_text
from biped.show.document import DOCS, Document, Paragraph, Table, filled, markdown, share
from biped.show.standing import FILE as STANDARD
from biped.show.standing import falls_of

PAGE, TEMPLATE, DATA = DOCS / "any-biped.md", DOCS / "any-biped.in.md", DOCS / "any-biped.json"
_NOTE = (
    "The table counts runs that walked, and where they stop runs that stood in the end, on seeds that no search has "
    "used. The brackets have 95 % intervals (Wilson)."
)
_COLUMNS = (
    "speed, m/s", "absolute cost of transport", "ticks at a limit", "walk straight for 60 s", "torque rate, N m/ms",
    "largest force of a foot, N", "gait", "runs of the search", "CPU s",
)  # fmt: skip
_LEVEL, _LONG = "level", "long"
"""Names of the tests whose metrics are shown."""
_POLICY = "policy:"
"""Begins the name of a robot whose results are those of a learned policy."""


def document_of(found: Sequence[Mapping[str, Any]]) -> Document:
    """Two tables: what each robot's gait walks through, and how it walks and was found.

    Args:
        found: By robot: its name, the gait's, rows of its tests, and its search.
    """
    titles = list(dict.fromkeys(test["title"] for one in found for test in one["tests"]))
    cells = [(title, *(_count(one, title) for one in found)) for title in titles]
    how = [(one["robot"], *_walk(one), *_search(one)) for one in found]
    return (
        Table(("test", *(one["robot"] for one in found)), tuple(cells)),
        Paragraph(_NOTE, note=True),
        Table(("robot", *_COLUMNS), tuple(how)),
    )  # fmt: skip


def beside(found: Sequence[Mapping[str, Any]], policies: Sequence[Mapping[str, Any]]) -> Document:
    """One table: what the law and a learned policy walk through on the same robots.

    Args:
        found: Of the law, as `document_of` has it.
        policies: Of policies, one for each robot at most.
    """
    law = {one["robot"]: one for one in found}
    pairs = [(law[one["robot"]], one) for one in policies if one["robot"] in law]
    titles = dict.fromkeys(test["title"] for _, policy in pairs for test in policy["tests"])
    rows = [(title, *(f"{_bare(ours, title)}, {_bare(theirs, title)}" for ours, theirs in pairs)) for title in titles]
    for words, i in (("speed on the level, m/s", 0), ("absolute cost of transport on the level", 1)):
        rows.append((words, *(f"{_walk(ours)[i]}, {_walk(theirs)[i]}" for ours, theirs in pairs)))
    return (Table(("test: law, policy", *(ours["robot"] for ours, _ in pairs)), tuple(rows)),)


def _test(one: Mapping[str, Any], title: str) -> Mapping[str, Any] | None:
    return next((test for test in one["tests"] if test["title"] == title), None)


def _bare(one: Mapping[str, Any], title: str) -> str:
    """How many runs walked, and how many fell if others failed without a fall."""
    test = _test(one, title)
    if test is None:
        return "not run"
    return f"{test['reached']} of {test['runs']}" + "".join(f" ({words})" for words in falls_of(test))


def _count(one: Mapping[str, Any], title: str) -> str:
    test = _test(one, title)
    return "not run" if test is None else share(test["reached"], test["runs"])


def _walk(one: Mapping[str, Any]) -> tuple[str, ...]:
    tests = {test["name"].rpartition("/")[2]: test for test in one["tests"]}
    level, long = tests[_LEVEL]["numbers"], tests.get(_LONG, {})
    straight = long.get("numbers", {}).get("straight")
    return (
        f"{level['speed']:.2f}", f"{level['cost_of_transport_absolute']:.2f}", f"{level['saturation']:.1%}",
        "not run" if straight is None else f"{straight:.0f} of {long['runs']}", _number(level, "torque_rate", ".2f"),
        _number(level, "peak_foot_force", ".0f"), one["gait"],
    )  # fmt: skip


def _number(numbers: Mapping[str, Any], name: str, form: str) -> str:
    value = numbers.get(name)
    return "–" if value is None else format(value, form)


def _search(one: Mapping[str, Any]) -> tuple[str, str]:
    search = one["search"]
    if search is None:
        return "–", "–"
    seconds = search["cpu_seconds"]  # of results of earlier versions nothing is known
    return f"{search['runs']:,}", "–" if seconds is None else f"{seconds:.0f}"


def stored() -> list[dict[str, Any]]:
    """The robots of docs/any-biped.md."""
    return json.loads(DATA.read_bytes())


def page(found: Sequence[Mapping[str, Any]]) -> str:
    """The text of docs/any-biped.md."""
    policies = [one for one in found if one["robot"].startswith(_POLICY)]
    ours = [one for one in found if not one["robot"].startswith(_POLICY)]
    theirs = [{**one, "robot": one["robot"].removeprefix(_POLICY)} for one in policies]
    tables = {"tables": document_of(ours), "policies": beside(ours, theirs)}
    return filled(TEMPLATE, {name: markdown(table).rstrip() for name, table in tables.items()})


def taken(robot: str, folder: Path, search: Path | None) -> dict[str, Any]:
    """The part of results that is kept.

    Args:
        robot: Its name for people.
        folder: Of `biped standard` with one gait.
        search: Of `biped tune`.
    """
    found = json.loads((folder / STANDARD).read_bytes())
    tests = []
    for test, standing in zip(found["tests"], found["standings"], strict=True):
        if not standing["tried"]:
            continue  # a test that is not for a policy
        tried = standing["tried"][0]
        numbers = {key: tried[key] for key in ("reached", "runs", "numbers", "falls") if key in tried}
        tests.append({"name": test["name"], "title": test["title"], **numbers})
    of_search = None if search is None else json.loads((search / "result.json").read_bytes())
    kept = None if of_search is None else {key: of_search.get(key) for key in ("runs", "cpu_seconds")}
    return {"robot": robot, "gait": found["gaits"][0], "tests": tests, "search": kept}


def joined(old: dict[str, Any] | None, new: dict[str, Any]) -> dict[str, Any]:
    """New results of a robot, with those of its old ones that they do not replace."""
    if old is None or old["gait"] != new["gait"]:
        return new
    fresh = {test["name"]: test for test in new["tests"]}
    kept = [fresh.pop(test["name"], test) for test in old["tests"]]
    return new | {"tests": [*kept, *fresh.values()], "search": new["search"] or old["search"]}


def main(argv: Sequence[str]) -> None:
    """Takes results into the page; without any, writes the page anew."""
    if argv:
        robots = {one["robot"]: one for one in stored()}
        for word in argv:
            robot, _, folders = word.partition("=")
            folder, _, search = folders.partition(",")
            robots[robot] = joined(robots.get(robot), taken(robot, Path(folder), Path(search) if search else None))
        write_text(DATA, dumps(list(robots.values())))
    write_text(PAGE, page(stored()))


if __name__ == "__main__":
    main(sys.argv[1:])
