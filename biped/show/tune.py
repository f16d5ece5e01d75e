"""What a search for gains found."""

from __future__ import annotations

from biped.base.files import label
from biped.studies.tune.tuned import Tuned


def show(tuned: Tuned) -> None:
    """Prints the gait file and what finding it took."""
    print(tuned.gait.read_text(encoding="utf-8"))
    print(f"{tuned.runs} runs, {tuned.runs / tuned.seconds:.1f} a second; gait in {label(tuned.gait)}")
