"""Whether the thesis's numbers in a scenario are still about it: each was printed for one gait, model and situation."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from biped.base import typed
from biped.base.files import layered
from biped.scenario.keys import Scenario

ABOUT = ("model", "controller", "law", "gains", "change", "backstep", "push", "truth", "ground.slope")
"""Keys that say which gait of which biped walks where."""


def about(data: Mapping[str, Any], origin: Mapping[str, Path]) -> dict[str, float]:
    """The numbers of [thesis] that are about a scenario: nothing of `ABOUT` differs from the file that gives them.

    Args:
        data: The scenario, its layers merged, as plain data that is a valid scenario.
        origin: File of each dotted key; numbers given with --set are about whatever they are given for.
    """
    files = {origin[f"thesis.{name}"] for name in data.get("thesis", {})}
    mine = _about(data)
    apart = {file for file in files if file.is_file() and _about(layered(file, "scenarios")[0]) != mine}
    return {name: value for name, value in data.get("thesis", {}).items() if origin[f"thesis.{name}"] not in apart}


def _about(data: Mapping[str, Any]) -> list[Any]:
    """Settings of a scenario that the thesis is about (`ABOUT`), and which of them vary."""
    s = typed.convert(data, Scenario)
    varied = {**s.sweep, **s.randomise.draw}
    told = [getattr(s, key) for key in ABOUT if "." not in key]
    return [*told, s.ground.slope, {key: varied[key] for key in varied if f"{key}.".startswith(_PREFIXES)}]


_PREFIXES = tuple(f"{key}." for key in ABOUT)
