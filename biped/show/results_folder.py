"""Results of anybody's that can be looked at: what commands wrote, and the runs in a results folder.

A run is made again from its scenario and its number, which is exact and cheaper than keeping every trajectory. Except
one of a law of somebody's own: whoever looks at results does not ask for the law to be run, so only what was kept is
shown. Of a campaign, the walker of median speed is looked at, and one run of each kind that missed its goal.
"""

from __future__ import annotations

import json
import zipfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import msgspec

from biped.base.errors import InputError, plain
from biped.base.files import label
from biped.base.typed import convert
from biped.ensemble import campaign
from biped.ensemble.failures import FAILURES, SUFFIX, load_packed
from biped.ensemble.folder import of_plan, reading
from biped.ensemble.plan import Plan
from biped.measure.metrics.walking import kind_of
from biped.measure.stored import load
from biped.scenario.laws import own_law
from biped.scenario.reading import read_scenario
from biped.show.document import harmless
from biped.studies.folders import results_at

if TYPE_CHECKING:
    import mujoco

    from biped.measure.trajectory import Trajectory

_AGAIN = "remove it to have it simulated again"


def _loaded(path: Path) -> Trajectory:
    """A kept trajectory, which may be anybody's file.

    Raises:
        InputError: It is none, or would take more memory than it has bytes.
    """
    try:
        with zipfile.ZipFile(path) as whole:
            packed = [part.filename for part in whole.infolist() if part.compress_type != zipfile.ZIP_STORED]
    except (zipfile.BadZipFile, OSError) as error:
        raise InputError(f"{path}: not a trajectory: {plain(error)[:200]}; {_AGAIN}") from None
    if packed:
        raise InputError(f"{path}: not a trajectory: {plain(packed[0])} is compressed; {_AGAIN}")
    return load(path)


class ResultsFolder:
    """Recorded runs of a results folder, and those that can be repeated without running anybody's law.

    Args:
        folder: The results folder.

    Attributes:
        plan: The plan of its scenario.
        result: Its result object.

    Raises:
        InputError: It is no results folder.
    """

    def __init__(self, folder: Path):
        self._folder = folder
        self.result = harmless(results_at(folder))
        self.plan = Plan(read_scenario(str(folder / "scenario.toml"), looking=True), checked=True)
        of_plan(folder, self.plan, self.result)

    def trajectory(self, index: int) -> Trajectory | None:
        """The trajectory of a run: kept, or made again; None of a law's run that was not kept.

        Of a run of a campaign that fell, only the last seconds were kept.
        """
        rows = self.result["runs"]
        whole = self._folder / "trajectory.npz"
        if len(rows) == 1 and whole.is_file():
            return _loaded(whole)
        if not own_law(self.plan.scenario.law):
            return campaign.run_one(self.plan, index)[0]
        return self.ending(index)

    @property
    def space(self) -> bool:
        """Whether its robot moves in space."""
        return not self.plan.robot.planar

    def model(self, index: int) -> mujoco.MjModel:
        """The model of a run's robot as it is drawn."""
        return self.plan.run(index).visual_model

    def ending(self, index: int) -> Trajectory | None:
        """The last seconds of a run that fell, where they were kept."""
        kept = self._folder / FAILURES / f"run-{index:05d}"
        for path, read in ((kept.with_suffix(SUFFIX), load_packed), (kept.with_suffix(".npz"), _loaded)):
            if path.is_file():  # (.npz: as versions before kept it)
                return read(path)
        return None

    def again(self, index: int) -> str:
        """Advice on how to see a law's run that was not kept."""
        return (
            f"{label(self._folder)}: run {index} is of the law {self.plan.scenario.law}, which is not run for a look, "
            f"and its trajectory was not kept; to make it again, if you trust the law: biped run "
            f"{self._folder / 'scenario.toml'} --only {index} --record --trust"
        )


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


_MOST = 200_000_000
"""[bytes] of a file that is read."""


def read_as(file: Path, kind: Any, what: str, again: str) -> Any:
    """The object in a JSON file.

    Args:
        file: The file.
        kind: msgspec's type of what is relied on.
        what: What it is expected to be, in words.
        again: The command that makes it anew.

    Raises:
        InputError: It cannot be read or is something else.
    """
    with reading(file, what, again):
        if file.stat().st_size > _MOST:
            raise InputError(f"{label(file)}: expected {what} of at most {_MOST // 1_000_000} MB")
        found = harmless(json.loads(file.read_bytes()))
        convert(found, kind)
    return found


Number: TypeAlias = int | float | None
"""A number in JSON, which has none for nan."""


def stored(shape: Any) -> Any:
    """A type of msgspec's for an object in JSON, of which only what is relied on is said.

    Args:
        shape: Kinds by key; a key that ends with `?` may be missing. A kind is a type, a shape, or [kind] for a list.
    """
    if isinstance(shape, list):
        return list[stored(shape[0])]
    if not isinstance(shape, dict):
        return shape
    fields: list[Any] = [
        (key.rstrip("?"), stored(kind), *([None] if key.endswith("?") else [])) for key, kind in shape.items()
    ]
    return msgspec.defstruct("Stored", fields, kw_only=True)
