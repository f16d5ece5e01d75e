"""Checks of a policy's card, faults that they find, and what a policy walks through, as documents."""

from collections.abc import Sequence
from pathlib import Path

from biped.base.files import label
from biped.show.document import Document, Heading, Items, Paragraph, Table, Words
from biped.studies.policy.checks import Check
from biped.studies.policy.faults import CardTrial
from biped.studies.policy.measure import Measured


def checks_document(file: Path, checks: Sequence[Check]) -> Document:
    """Which checks a card passed."""
    rows = tuple(
        (one.name, Words("passed" if one.passed else "FAILED", "good" if one.passed else "bad"), one.words)
        for one in checks
    )
    failed = sum(not one.passed for one in checks)
    words = (f"{failed} of {len(checks)} failed: before the policy, doubt the card (docs/your-policy.md)" if failed
             else "all passed")  # fmt: skip
    return Heading(label(file)), Table(("check", "", "result"), rows, (0, 1, 2)), Paragraph(words)


def faults_document(trials: Sequence[CardTrial]) -> Document:
    """Which injected faults were found, and by what; of several cards in how many."""
    faults, rows = [one for trial in trials for one in trial.faults], []
    for name in dict.fromkeys(one.name for one in faults):
        found = [one.found for one in faults if one.name == name]
        by = dict.fromkeys(one for one in found if one)
        rows.append((name, ", ".join(by) or "–", f"{sum(map(bool, found))} of {len(found)}"))
    alarms = [(trial.card, one) for trial in trials for one in trial.alarms]
    wrong, right = len({(card, one.name) for card, one in alarms}), sum(trial.right for trial in trials)
    return (
        Heading(", ".join(label(Path(trial.card)) for trial in trials)),
        Table(("fault", "found by", "in"), tuple(rows), (0, 1, 2)),
        Paragraph(f"{sum(bool(one.found) for one in faults)} of {len(faults)} found"),
        Items(tuple(f"alarm: {label(Path(card))}, {one.name}: {one.found}" for card, one in alarms)),
        Paragraph(f"{wrong} of {right} right cards raised an alarm"),
    )


def measured_document(file: Path, row: Measured) -> Document:
    """A policy's speed and cost, and what it walks through."""
    rows = (
        (f"speed, {row.asked:g} m/s asked for", f"{row.speed:.3f} m/s" if row.lasted else "fell"),
        ("cost of transport", f"{row.cost:.3f}"),
        *((one.name, f"{'>= ' if one.most else ''}{one.value:.3g} {one.unit}") for one in row.limits),
    )
    return Heading(label(file)), Table(("measured", "value"), rows, (0, 1))
