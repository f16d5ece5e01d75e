"""References for people: what differs from them on a terminal and in Markdown; docs/references.md, README.md's results.

`python -m biped.show.references` writes both pages from the recorded numbers.
"""

from collections.abc import Mapping, Sequence
from typing import Any

from biped.base.errors import markdown_table
from biped.base.statistics import wilson
from biped.scenario.metrics import METRICS as EVERY
from biped.show.document import DOCS, Block, Document, Line, Paragraph, Table, Words, between, replaced
from biped.show.results import number
from biped.studies.regress import ScenarioOutcome
from biped.studies.regress import references as recorded

PAGE, README = DOCS / "references.md", DOCS.parent / "README.md"
SITUATIONS = {
    "upright/level": "level ground",
    "upright/home": "the same, in the other simulator",
    "upright/push": "pushed with 200 N, forward or backward",
    "upright/slope": "3 and 5 degrees up and down",
    "upright/model_error": "its own model wrong by 10 %",
    "upright/friction": "from slippery to sticky ground",
    "upright/scatter": "starts scattered by 20 and 50 mrad",
    "upright/senses": "noisy sensors, 10 ms late",
    "upright/delay": "late sensors, not predicted",
}
"""Scenarios of the README's table, in words."""

_HEAD = """# Recorded numbers

What `biped regress` compares with, scenario by scenario: two minutes of walking each, at most twelve runs
([regression.md](regression.md)). With so few runs these are fingerprints, not claims: intervals (95 %) say how
little they prove. Means are over the runs that walked. Written by `python -m biped.show.references`; a test
keeps it equal to [references.json](../scenarios/references.json).

"""


def page(references: recorded.References) -> str:
    """The page: a table of all scenarios, and why references changed."""
    columns = ("scenario", "walked", "95 % interval", "fell", *(name.replace("_", " ") for name in recorded.METRICS))
    rows = (_row(name, references.scenarios[name]) for name in sorted(references.scenarios))
    lines = [markdown_table(columns, rows)]
    found = references.scenarios.values()
    runs, walked = sum(len(one.runs) for one in found), sum(one.ends.count("w") for one in found)
    lines.append(f"\n{walked} of {runs} runs walk. What changed, the latest first:\n")
    for change in references.history:
        lines.append(f"- {change.date}: {change.reason} ({_names(change.scenarios)})")
    return _HEAD + "\n".join(lines) + "\n"


def readme(references: recorded.References) -> str:
    """The text of README.md with the table of what the flagship did."""
    rows = []
    for name, situation in SITUATIONS.items():
        one = references.scenarios[name]
        rows.append((situation, f"`{name}`", f"{one.ends.count('w')} of {len(one.runs)}", means_of(one)[0]))
    table = markdown_table(("situation", "scenario", "walked", "speed [m/s]"), rows)
    return replaced(README.read_text(encoding="utf-8"), "results", table)


def _names(scenarios: Sequence[str], most: int = 3) -> str:
    more = f" and {len(scenarios) - most} more" if len(scenarios) > most else ""
    return ", ".join(scenarios[:most]) + more


def _row(name: str, one: recorded.RecordedScenario) -> tuple[Any, ...]:
    runs, walked = len(one.runs), one.ends.count("w")
    fell = sum(end in recorded.FALLEN for end in one.ends)
    interval = between(*wilson(walked, runs))
    return f"`{name}`", f"{walked} of {runs}", interval, fell, *means_of(one)


def means_of(one: recorded.RecordedScenario) -> list[str]:
    """Means of the metrics over the runs that walked."""
    found = [
        [value for value, end in zip(getattr(one, name), one.ends, strict=True) if end == "w" and value is not None]
        for name in recorded.METRICS
    ]
    return [number(sum(values) / len(values)) if values else "–" for values in found]


_WORDS = {
    recorded.SAME: "same",
    recorded.DIGITS: "digits changed",
    recorded.PHYSICS: "CHANGED",
    recorded.RUNS: "CHANGED: other runs are made of it now",
    recorded.NEW: "no reference",
    recorded.GONE: "no scenario",
}


def document_of(found: Mapping[str, Any]) -> Document:
    """A regression run as a document: a line for each scenario, and what to do about changes.

    Args:
        found: As `biped.studies.regress.ScenarioOutcome.as_dict` gives it.
    """
    blocks: list[Block] = [table_of(found["verdicts"])]
    there = [one for one in found["verdicts"] if one["verdict"] in recorded.COMPARED]
    if found["recorded"]:
        blocks.append(Paragraph(f"recorded: {', '.join(found['recorded'])}"))
    elif not found["passed"]:
        blocks.append(Paragraph('if this is meant: biped regress --update --reason "why", with what changed'))
    if not all(one["exact"] for one in there):
        blocks.append(Paragraph("recorded on another platform: only the physics is compared, not the last digits"))
    return tuple(blocks)


def table_of(verdicts: Sequence[Mapping[str, Any]]) -> Table:
    """Scenarios beside their references, a row each, as `biped regress --json` prints them."""
    rows: list[tuple[Line, ...]] = []
    for one in verdicts:
        word = Words(str(_WORDS.get(one["verdict"], one["verdict"])), "good" if one["passed"] else "bad")
        counts = [_counts(one[name]) if one["verdict"] in recorded.COMPARED else "" for name in ("walked", "fell")]
        means = (_mean(name, one["metrics"].get(name)) for name in recorded.METRICS)
        rows.append((one["scenario"], word, f"{one['identical']} of {one['runs']}", *counts, *means))
    units = (
        f"{name.replace('_', ' ')}{f' [{unit}]' if (unit := EVERY[name].unit) else ''}" for name in recorded.METRICS
    )
    return Table(("scenario", "", "same bits", "walked", "fell", *units), tuple(rows), (0, 1))


def _counts(pair: Sequence[int]) -> str:
    old, new = pair
    return str(new) if old == new else f"{old} → {new}"


def _mean(name: str, moved: Mapping[str, Any] | None) -> Line:
    if moved is None:
        return "–"
    shown = EVERY[name].text
    if moved["old"] == moved["new"]:
        return shown(moved["new"])
    change = "" if moved["change"] is None else f" ({moved['change']:+.1%})"
    return Words(f"{shown(moved['old'])} → {shown(moved['new'])}{change}", "" if moved["within"] else "bad")


CAUSES = {
    "double_support": "a foot is on the ground by the ground's force, no longer by what its law believes",
    "cost_of_transport": "powers of any robot are taken at each tick, as those of seven links are",
    "walked": "steps, support and falls are those of the true state",
    "fell": "falls are those of the true state; a fall with doubtful numbers is a fall",
}
"""Why a number of version 0.2 is not that of 0.1, where neither torques nor physics moved."""


def moved_table(outcome: ScenarioOutcome) -> str:
    """The references that moved as Markdown, sorted by the cause: for each number the scenarios, then and now.

    Numbers whose cause is not among `CAUSES` come last; means are over the runs that walked both times.
    """
    found: dict[str, list[tuple[str, ...]]] = {}
    for v in sorted(recorded.compared(outcome.verdicts), key=lambda v: v.scenario):
        pairs = {name: (EVERY[name].text(m.old), EVERY[name].text(m.new)) for name, m in v.metrics.items()
                 if m.old != m.new}  # fmt: skip
        counts = {"walked": v.walked, "fell": v.fell}
        pairs |= {name: (str(old), str(new)) for name, (old, new) in counts.items() if old != new}
        for name, (old, new) in pairs.items():
            found.setdefault(name, []).append((v.scenario, old, new, f"{v.identical} of {v.runs}"))
    heads, lines = ("scenario", "before", "now", "runs with the same bits"), []
    for name in sorted(found, key=[*CAUSES, *(set(found) - set(CAUSES))].index):
        words = CAUSES.get(name, "no cause is known: look into it")
        lines += [f"### {name.replace('_', ' ')}: {words}", "", markdown_table(heads, found[name]), ""]
    return "\n".join(lines) if lines else "No reference moved.\n"


if __name__ == "__main__":
    PAGE.write_text(page(recorded.read(recorded.shipped())), encoding="utf-8")
    README.write_text(readme(recorded.read(recorded.shipped())), encoding="utf-8")
