"""Rows of the atlas: the standard tests with few runs a value, and growth and sensitivity of each walk."""

import json
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from biped.base.errors import RunError
from biped.base.writing import dumps, write_text
from biped.ensemble.backend import Jobs, Progress, silent
from biped.studies.entrants import PLAIN, Entrant, entrant_of
from biped.studies.run import plan_of
from biped.studies.stability.growth import growth
from biped.studies.stability.sensitivity import sensitivity
from biped.studies.standard import FAMILY, standard
from biped.studies.standard.search import digest_of

SEARCHED = (
    "level", "slope_up", "slope_down", "push_forward", "push_backward", "steps_up", "steps_down", "delay",
    "space_level", "space_slope_up", "space_slope_down", "space_push_forward", "space_push_backward",
    "space_push_sideways", "space_delay",
)  # fmt: skip
"""Tests with `RUNS` runs at each value, unless a change says otherwise."""
COUNTED = ("unmodelled", "random_push", "space_random_push")
"""Tests with as many runs as they say themselves."""
RUNS = "randomise.runs=10"
FILE = "walks.json"
"""Growth and sensitivity that are kept, by what they were made of."""


def atlas(
    gaits: Sequence[str], changes: Sequence[str], jobs: Jobs, out: Path, progress: Progress = silent
) -> dict[str, Any]:
    """Rows of the atlas.

    Args:
        gaits: As `biped.studies.standard.standard` takes them.
        changes: `--set` changes, of every run.
        jobs: Number of processes, or a cluster.
        out: Folder in which all is kept; one that is there is gone on with.
        progress: Told of every finished run.

    Returns:
        As a table of standard tests has it, with the `norms` and the `growth` of each gait: nothing of one that does
        not walk long enough.
    """
    searched = standard(gaits, SEARCHED, [RUNS, *changes], jobs, out, progress, adding=False).as_dict()
    counted = standard(gaits, COUNTED, changes, jobs, out, progress, adding=False).as_dict()
    walks = [(entrant, partial(_stored, out / FILE, entrant, changes, jobs)) for entrant in map(entrant_of, gaits)]
    return searched | {
        "changes": list(changes),
        "tests": searched["tests"] + counted["tests"],
        "standings": searched["standings"] + counted["standings"],
        "norms": {entrant.name: kept("kinds", sensitivity) for entrant, kept in walks},
        "growth": {entrant.name: kept("sizes", growth) for entrant, kept in walks},
    }


def _stored(
    file: Path, entrant: Entrant, changes: Sequence[str], jobs: Jobs, name: str, study: Callable[..., Any]
) -> list[Any]:
    """A part of a study's numbers of the entrant's walk on level ground, made unless they were before."""
    scenario = f"{FAMILY}space_level" if not entrant.law and entrant.in_space(changes) else PLAIN
    asked = entrant.all_changes(scenario, changes)
    key = digest_of(plan_of(scenario, asked), name)
    known = json.loads(file.read_bytes()) if file.is_file() else {}
    if key not in known:
        try:
            known[key] = study(scenario, asked, jobs).as_dict()[name]
        except RunError:
            known[key] = []
        write_text(file, dumps(known, indent=0))
    return known[key]
