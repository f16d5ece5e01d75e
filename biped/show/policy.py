"""Checks of a policy's card, and faults that they find, on a terminal."""

from collections.abc import Sequence
from pathlib import Path

from biped.base.files import label
from biped.base.text import plain
from biped.show.terminal import console, table
from biped.studies.policy.checks import Check
from biped.studies.policy.faults import CardTrial
from biped.studies.policy.measure import Measured


def show_checks(file: Path, checks: Sequence[Check]) -> None:
    """Prints which checks a card passed."""
    out, page = console(), table(("check", "", "result"), ("check", "", "result"))
    for one in checks:
        page.add_row(one.name, "passed" if one.passed else "FAILED", plain(one.words))
    out.print(f"[bold]{plain(label(file))}[/bold]")
    out.print(page)
    failed = sum(not one.passed for one in checks)
    out.print(f"  {failed} of {len(checks)} failed: before the policy, doubt the card (docs/your-policy.md)" if failed
              else "  all passed")  # fmt: skip


def show_faults(trials: Sequence[CardTrial]) -> None:
    """Prints which injected faults were found, and by what; of several cards in how many."""
    out, page = console(), table(("fault", "found by", "in"), ("fault", "found by", "in"))
    faults = [one for trial in trials for one in trial.faults]
    for name in dict.fromkeys(one.name for one in faults):
        found = [one.found for one in faults if one.name == name]
        by = dict.fromkeys(one for one in found if one)
        page.add_row(name, ", ".join(by) or "–", f"{sum(map(bool, found))} of {len(found)}")
    out.print(f"[bold]{plain(', '.join(label(Path(trial.card)) for trial in trials))}[/bold]")
    out.print(page)
    out.print(f"  {sum(bool(one.found) for one in faults)} of {len(faults)} found")
    alarms = [(trial.card, one) for trial in trials for one in trial.alarms]
    for card, one in alarms:
        out.print(f"  alarm: {plain(label(Path(card)))}, {one.name}: {one.found}")
    out.print(f"  {len({(card, one.name) for card, one in alarms})} of {sum(trial.right for trial in trials)} right "
              "cards raised an alarm")  # fmt: skip


def show_measured(file: Path, row: Measured) -> None:
    """Prints a policy's speed and cost, and what it walks through."""
    out, page = console(), table(("measured", "value"), ("measured", "value"))
    page.add_row(f"speed, {row.asked:g} m/s asked for", f"{row.speed:.3f} m/s" if row.lasted else "fell")
    page.add_row("cost of transport", f"{row.cost:.3f}")
    for one in row.limits:
        page.add_row(one.name, f"{'>= ' if one.most else ''}{one.value:.3g} {one.unit}")
    out.print(f"[bold]{plain(label(file))}[/bold]")
    out.print(page)
