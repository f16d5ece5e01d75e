"""The two that are compared: results folders with their runs, paired by seed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from biped.base.errors import InputError
from biped.base.files import label, read_toml
from biped.ensemble.rows import LOST

Row = Mapping[str, Any]
Pairs = Sequence[tuple[Row, Row]]


class ComparedSide(NamedTuple):
    """One of the two.

    Attributes:
        name: For people.
        folder: Its results folder.
        result: Its result object.
        scenario: Its effective scenario as plain data, whatever version wrote it.
    """

    name: str
    folder: Path
    result: Mapping[str, Any]
    scenario: Mapping[str, Any]

    @property
    def runs(self) -> Sequence[Row]:
        """Its runs but those that were lost."""
        return [run for run in self.result["runs"] if run["end"] != LOST]

    def replay(self, index: int) -> str:
        """The command that makes a run again."""
        trust = " --trust" if self.scenario.get("law") else ""
        return f"biped run {label(self.folder / 'scenario.toml')} --only {index}{trust}"


def side(name: str, folder: Path, result: Mapping[str, Any]) -> ComparedSide:
    """A result with its scenario.

    Raises:
        InputError: Its scenario cannot be read.
    """
    return ComparedSide(name, folder, result, read_toml(folder / "scenario.toml"))


def pairs_of(first: ComparedSide, second: ComparedSide) -> Pairs:
    """Runs of the same seed at the same point of a sweep: (first, second).

    Raises:
        InputError: There are none.
    """
    a, b = swept(first), swept(second)
    if a != b:
        raise InputError(
            f"{second.name}: expected a sweep over the same keys as {first.name}'s ({_words(a)}), got {_words(b)}"
        )

    def which(run: Row) -> tuple[str, ...]:
        return str(run.get("seed")), *(repr(run["values"].get(key)) for key in a)

    theirs = {which(run): run for run in second.runs}
    pairs = [(run, theirs[which(run)]) for run in first.runs if which(run) in theirs]
    if not pairs:
        raise InputError(
            f"{first.name} and {second.name}: have no run in common; expected runs of the same seeds (the scenario's "
            "seed) at the same points"
        )
    return pairs


def swept(one: ComparedSide) -> list[str]:
    """Keys that a sweep went over; none where there was no sweep."""
    points = one.result.get("points") or []
    return sorted(points[0]["values"]) if points else []


def _words(keys: Sequence[str]) -> str:
    return ", ".join(keys) or "none"


def settings(first: ComparedSide, second: ComparedSide) -> list[tuple[str, Any, Any]]:
    """Where the scenarios differ; a key that a version does not know is None."""
    a, b = _flat(first.scenario), _flat(second.scenario)
    return [(key, a.get(key), b.get(key)) for key in dict.fromkeys([*a, *b]) if a.get(key) != b.get(key)]


def _flat(value: Any, at: str = "") -> dict[str, Any]:
    if not isinstance(value, Mapping):
        return {at: value}
    out: dict[str, Any] = {}
    for key, inner in value.items():
        out |= _flat(inner, f"{at}.{key}" if at else str(key))
    return out
