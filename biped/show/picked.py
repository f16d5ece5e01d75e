"""Runs of a campaign that are looked at: the walker of median speed, and one of each kind that missed its goal."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from biped.base.errors import InputError
from biped.measure.metrics.walking import kind_of
from biped.show.results_folder import ResultsFolder

if TYPE_CHECKING:
    import mujoco

    from biped.measure.trajectory import Trajectory

KINDS = 5
"""Most kinds of runs that did not walk, of which one is shown each."""


def chosen(rows: list[Mapping[str, Any]]) -> list[tuple[str, Mapping[str, Any]]]:
    """Runs that are shown: the walker of median speed, and one of each kind that did not walk, the commonest first."""
    if len(rows) == 1:
        return [("the run", rows[0])]
    picked = []
    median = middle(rows)
    if median is not None:
        picked.append((f"the median walker (run {median['index']})", median))
    kinds: dict[str, list[Mapping[str, Any]]] = {}
    for row in rows:
        if not row["walked"] and row["end"] != "lost":
            kinds.setdefault(kind_of(row), []).append(row)
    for kind, mine in sorted(kinds.items(), key=lambda item: -len(item[1]))[:KINDS]:
        mine.sort(key=lambda row: row["time"])
        picked.append((f"{kind} ({len(mine)}×)", mine[len(mine) // 2]))
    return picked


def middle(rows: Sequence[Mapping[str, Any]]) -> Mapping[str, Any] | None:
    """The walker of median speed."""
    walkers = sorted((row for row in rows if row["walked"]), key=lambda row: row["speed"])
    return walkers[len(walkers) // 2] if walkers else None


def run_of(path: Path, only: int | None) -> tuple[str, Trajectory, mujoco.MjModel]:
    """Name, trajectory and model of a run of a results folder.

    Args:
        path: The folder.
        only: The run's number; default: the only one, or the first of `chosen`.

    Raises:
        InputError: There is no such run, or it cannot be had.
    """
    kept = ResultsFolder(path)
    rows = {row["index"]: row for row in kept.result["runs"]}
    if only is not None and len(rows) > 1 and only not in rows:
        raise InputError(f"--only {only}: expected the number of a run of {path}, {min(rows)} … {max(rows)}")
    index = only if only is not None and only in rows else chosen(list(rows.values()))[0][1]["index"]
    trajectory = kept.trajectory(index)
    if trajectory is None:
        raise InputError(kept.again(index))
    name = kept.result["scenario"] if len(rows) == 1 else f"{kept.result['scenario']}, run {index}"
    return name, trajectory, kept.model(index)
