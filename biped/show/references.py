"""docs/references.md and README.md's results from recorded numbers: `python -m biped.show.references` writes them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from biped.base.statistics import wilson
from biped.show.markdown import replaced
from biped.show.results import number
from biped.studies.regress.references import FALLEN, METRICS, RecordedScenario, References, read, shipped

PAGE = Path(__file__).parents[2] / "docs" / "references.md"
README = Path(__file__).parents[2] / "README.md"
SITUATIONS = {
    "upright/level": "level ground",
    "upright/home": "the same, in the other simulator",
    "upright/push": "pushed with 200 N, forward or backward",
    "upright/slope": "3 and 5 degrees up and down",
    "upright/model_error": "its own model wrong by 10 %",
    "upright/friction": "from slippery to sticky ground",
    "upright/scatter": "starts scattered by 20 and 50 mrad",
    "upright/noise": "noisy sensors",
    "upright/delay": "sensors 5 and 10 ms late",
}
"""Scenarios of the README's table, in words."""

_HEAD = """# Recorded numbers

What `biped regress` compares with, scenario by scenario: two minutes of walking each, at most twelve runs
([regression.md](regression.md)). With so few runs these are fingerprints, not claims: intervals (95 %) say how
little they prove. Means are over the runs that walked. Written by `python -m biped.show.references`; a test
keeps it equal to [references.json](../scenarios/references.json).

"""


def page(references: References) -> str:
    """The page: a table of all scenarios, and why references changed."""
    columns = ("scenario", "walked", "95 % interval", "fell", *(name.replace("_", " ") for name in METRICS))
    lines = ["| " + " | ".join(columns) + " |", "|" + "---|" * len(columns)]
    lines += [_row(name, references.scenarios[name]) for name in sorted(references.scenarios)]
    found = references.scenarios.values()
    runs, walked = sum(len(one.runs) for one in found), sum(one.ends.count("w") for one in found)
    lines.append(f"\n{walked} of {runs} runs walk. What changed, the latest first:\n")
    for change in references.history:
        lines.append(f"- {change.date}: {change.reason} ({_names(change.scenarios)})")
    return _HEAD + "\n".join(lines) + "\n"


def readme(references: References) -> str:
    """The text of README.md with the table of what the flagship did."""
    lines = ["| situation | scenario | walked | speed [m/s] |", "|---|---|---|---|"]
    for name, situation in SITUATIONS.items():
        one = references.scenarios[name]
        (speed, *_), walked = means_of(one), f"{one.ends.count('w')} of {len(one.runs)}"
        lines.append(f"| {situation} | `{name}` | {walked} | {speed} |")
    return replaced(README.read_text(encoding="utf-8"), "results", "\n".join(lines))


def _names(scenarios: Sequence[str], most: int = 3) -> str:
    more = f" and {len(scenarios) - most} more" if len(scenarios) > most else ""
    return ", ".join(scenarios[:most]) + more


def _row(name: str, one: RecordedScenario) -> str:
    runs, walked = len(one.runs), one.ends.count("w")
    low, high = wilson(walked, runs)
    fell = sum(end in FALLEN for end in one.ends)
    return f"| `{name}` | {walked} of {runs} | {low:.0%} – {high:.0%} | {fell} | {' | '.join(means_of(one))} |"


def means_of(one: RecordedScenario) -> list[str]:
    """Means of the metrics over the runs that walked."""
    found = [
        [value for value, end in zip(getattr(one, name), one.ends, strict=True) if end == "w" and value is not None]
        for name in METRICS
    ]
    return [number(sum(values) / len(values)) if values else "–" for values in found]


if __name__ == "__main__":
    PAGE.write_text(page(read(shipped())), encoding="utf-8")
    README.write_text(readme(read(shipped())), encoding="utf-8")
