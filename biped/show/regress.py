"""References on a terminal: then, now and the difference."""

from __future__ import annotations

from biped.scenario.metrics import METRICS as EVERY
from biped.show.terminal import console, table
from biped.studies.regress.compare import DIGITS, GONE, NEW, PHYSICS, RUNS, SAME, Moved, Verdict, compared
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


def _counts(v: Verdict) -> tuple[str, str]:
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
