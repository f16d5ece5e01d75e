"""Results of a search for gains."""

from __future__ import annotations

from typing import TYPE_CHECKING

from biped.base.files import label
from biped.studies.tune.tuned import Tuned

if TYPE_CHECKING:
    from collections.abc import Sequence

    from biped.studies.tune.least import Least
    from biped.studies.tune.robot import Trial


def show(tuned: Tuned) -> None:
    """Prints the gait file and what finding it took."""
    print(tuned.gait.read_text(encoding="utf-8"))
    print(f"{tuned.runs} runs, {tuned.runs / tuned.seconds:.1f} a second; gait in {label(tuned.gait)}")


def show_trials(trials: Sequence[Trial], changes: Sequence[str]) -> None:
    """Prints how far shipped gaits came on a robot, and the changes that make the search one for it."""
    print(f"{'gait':<12} {'Q_d share':<12} {'s until it fell, from three starts':<36} m it came")
    for one in trials:
        times, ways = ("  ".join(f"{value:5.2f}" for value in values) for values in (one.times, one.distances))
        print(f"{one.gait:<12} {one.assist:<12g} {times:<36} {ways}")
    print("searching: biped tune tune/any " + " ".join(f"--set '{change}'" for change in changes))


def show_least(found: Least) -> None:
    """Prints what is left at every step of the way back."""
    conditions = list(found.steps[0]["tallies"])
    print(f"changed  put back  {'from':>8}  {'to':>8}  " + "  ".join(conditions))
    for step in found.steps:
        values = [f"{step[key]:8.4g}" if step["restored"] else 8 * " " for key in ("before", "after")]
        tallies = "  ".join(f"{'/'.join(map(str, step['tallies'][name])):>{len(name)}}" for name in conditions)
        print(f"{step['changed']:7d}  {step['restored']:8}  {'  '.join(values)}  {tallies}")
    print(f"results in {label(found.folder)}/")
