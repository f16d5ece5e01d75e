"""References on a terminal, and as a table in Markdown: then, now and the difference."""

from __future__ import annotations

from biped.scenario.metrics import METRICS as EVERY
from biped.show.terminal import console, table
from biped.studies.regress.compare import DIGITS, GONE, NEW, PHYSICS, RUNS, SAME, Moved, ScenarioComparison, compared
from biped.studies.regress.guard import ScenarioOutcome
from biped.studies.regress.references import METRICS

_WORDS = {
    SAME: "same",
    DIGITS: "digits changed",
    PHYSICS: "CHANGED",
    RUNS: "CHANGED: other runs are made of it now",
    NEW: "no reference",
    GONE: "no scenario",
}


def show(outcome: ScenarioOutcome) -> None:
    """Prints one line per scenario, and what to do about changes."""
    out = console()
    short = [name.replace("cost_of_transport", "cost").replace("double_support", "double s.") for name in METRICS]
    page = table(("scenario", "", "same runs", "walked", "fell", *short), ("scenario", ""), no_wrap=True)
    for v in outcome.verdicts:
        colour = "green" if v.passed else "red"
        page.add_row(
            v.scenario, f"[{colour}]{_WORDS[v.verdict]}[/{colour}]", f"{v.identical}/{v.runs}",
            *(_counts(v) if compared([v]) else ("", "")), *(_mean(name, v.metrics.get(name)) for name in METRICS),
        )  # fmt: skip
    out.print(page)
    if outcome.recorded:
        out.print(f"recorded: {', '.join(outcome.recorded)}")
    elif not outcome.passed:
        out.print('if this is meant: biped regress --update --reason "why", with the scenarios that changed')
    if not all(v.exact for v in compared(outcome.verdicts)):
        out.print("recorded on another platform: only the physics is compared, not the last digits")


def _counts(v: ScenarioComparison) -> tuple[str, str]:
    walked, fell = ((str(old) if old == new else f"{old} → {new}") for old, new in (v.walked, v.fell))
    return walked, fell


def _mean(name: str, moved: Moved | None) -> str:
    if moved is None:
        return "–"
    shown = EVERY[name].text
    if moved.old == moved.new:
        return shown(moved.new)
    text = f"{shown(moved.old)} → {shown(moved.new)} ({moved.change:+.1%})"
    return text if moved.within else f"[red]{text}[/red]"


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
    found: dict[str, list[str]] = {}
    for v in sorted(compared(outcome.verdicts), key=lambda v: v.scenario):
        pairs = {name: (EVERY[name].text(m.old), EVERY[name].text(m.new)) for name, m in v.metrics.items()
                 if m.old != m.new}  # fmt: skip
        counts = {"walked": v.walked, "fell": v.fell}
        pairs |= {name: (str(old), str(new)) for name, (old, new) in counts.items() if old != new}
        for name, (old, new) in pairs.items():
            found.setdefault(name, []).append(f"| {v.scenario} | {old} | {new} | {v.identical} of {v.runs} |")
    lines = []
    for name in sorted(found, key=[*CAUSES, *(set(found) - set(CAUSES))].index):
        words = CAUSES.get(name, "no cause is known: look into it")
        lines += [f"### {name.replace('_', ' ')}: {words}", "", "| scenario | before | now | runs with the same bits |",
                  "|---|---|---|---|", *found[name], ""]  # fmt: skip
    return "\n".join(lines) if lines else "No reference moved.\n"
