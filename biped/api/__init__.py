"""biped from Python: load, run, sweep and compare scenarios; what comes back is data with names and units.

    import biped

    result = biped.run("level_fast", **{"ground.slope": 2, "randomise.runs": 50})
    result.summary["speed"]            # m/s
    result.runs.to_pandas()            # one row per run (an Arrow table)
    result.trajectory.u                # (n, 6) joint torques [N m] of the first run
    result.show()                      # in the rerun viewer

Changes are keys of the scenario with Python's values, as after `--set`; see docs/scenarios.md.
"""

from __future__ import annotations

import logging
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from biped.api.results import Compared, Differed, Result
from biped.base.errors import InputError
from biped.ensemble import campaign
from biped.ensemble.backend import Progress, silent
from biped.robot.run import Factory, factory_of
from biped.scenario.keys import Scenario
from biped.scenario.vary import setting
from biped.studies import comparison
from biped.studies import diff as differing
from biped.studies.diff.changes import MARGIN
from biped.studies.run import plan_of, run_plan, title_of

_tell = logging.getLogger("biped").warning


class Loaded(NamedTuple):
    """A scenario that can be run as it is or changed further.

    Attributes:
        name: What it was loaded by: a name in scenarios/ or a path.
        changes: What was changed, as after `--set`.
        law: The control law given as a Python object; None: the scenario's own.
    """

    name: str
    changes: tuple[str, ...]
    law: Factory | None

    @property
    def scenario(self) -> Scenario:
        """Every key with its value; gains are written out."""
        return plan_of(self.name, self.changes, self.law).scenario

    def changed(self, **changes: Any) -> Loaded:
        """The same scenario with more changes."""
        return self._replace(changes=(*self.changes, *(setting(key, value) for key, value in changes.items())))


def load(name: str | Path | Loaded, *, law: Any = None, **changes: Any) -> Loaded:
    """Reads, changes and checks a scenario.

    Args:
        name: Name in scenarios/, or path of a scenario file.
        law: A control law: `path.py:Class`, or a Python object. That is a class or function called with a `Setup`
            before every run, or an instance, of which every run gets a copy (`biped.control.planar.user`).
        **changes: Keys with their values, e.g. `**{"ground.slope": 2}`.

    Raises:
        InputError: Something in it cannot be used.
    """
    found = name if isinstance(name, Loaded) else Loaded(str(name), (), None)
    found = found.changed(**changes)
    if isinstance(law, str):
        found = found.changed(law=law)
    elif law is not None:
        found = found._replace(law=factory_of(law))
    plan_of(found.name, found.changes, found.law)  # complaints come now
    return found


def run(
    name: str | Path | Loaded,
    *,
    law: Any = None,
    jobs: int | None = None,
    cluster: str | None = None,
    progress: Progress = silent,
    **changes: Any,
) -> Result:
    """Runs a scenario, a single run or an ensemble; nothing is written.

    Args:
        name: Name, path, or as from `load`.
        law: See `load`.
        jobs: Number of processes of an ensemble; default: all cores.
        cluster: Workers elsewhere instead, as after `--cluster`: a Dask scheduler's address, `local:N`, or a file.
        progress: Told of every finished run (`biped.ensemble.backend`).
        **changes: See `load`.

    Raises:
        InputError: Something cannot be used.
        RunError: A run could not be carried out.
    """
    loaded = load(name, law=law, **changes)
    plan = plan_of(loaded.name, loaded.changes, loaded.law)
    with campaign.workers_at(jobs, cluster, False, _tell) as workers:
        return Result(run_plan(title_of(loaded.name), plan, workers, progress))


def check(name: str | Path | Loaded, **arguments: Any) -> Result:
    """Runs a scenario that expects something; `passed` and `checks` of the result say whether it holds.

    Args:
        name: Name, path, or as from `load`.
        **arguments: As of `run`.

    Raises:
        InputError: Nothing is expected, or something cannot be used.
    """
    law = arguments.get("law")
    keys = {key: value for key, value in arguments.items() if key not in ("law", "jobs", "cluster", "progress")}
    if not load(name, law=law, **keys).scenario.expect:
        raise InputError('check: expect: missing; expected bounds of metrics, e.g. expect={"falls": {"max": 0}}')
    return run(name, **arguments)


def diff(
    first: Result | str | Path, second: Result | str | Path, margin: float = MARGIN, metrics: Sequence[str] = ()
) -> Differed:
    """Compares two results run by run, paired by seed.

    Args:
        first: The result that is compared with, or its folder.
        second: The one that is judged.
        margin: A change within this share is none that matters.
        metrics: Names of those that are compared; default: all.

    Raises:
        InputError: They have no runs in common, or a metric is unknown.
    """
    with tempfile.TemporaryDirectory(prefix="biped-") as folder:
        folders = [
            one.save(Path(folder) / name) if isinstance(one, Result) else Path(one)
            for one, name in ((first, "first"), (second, "second"))
        ]
        found = differing.of_folders(folders[0], folders[1], margin, metrics)
        found.as_dict()  # reads what it needs of the folders
    return Differed(found)


def sweep(
    name: str | Path | Loaded, over: Mapping[str, Sequence[Any]], *, law: Any = None, jobs: int | None = None,
    cluster: str | None = None, progress: Progress = silent, **changes: Any,
) -> Result:  # fmt: skip
    """Runs an ensemble at every combination of values of one or two keys.

    Args:
        name: Name, path, or as from `load`.
        over: Keys with the values that they take, e.g. `{"ground.slope": range(-5, 6)}`.
        law: See `load`.
        jobs: Number of processes; default: all cores.
        cluster: See `run`.
        progress: Told of every finished run.
        **changes: See `load`; `randomise.runs` is the number of runs at every point.

    Returns:
        The result; its `points` and `thresholds` say how the walk changes.
    """
    table = {key: list(values) for key, values in over.items()}
    return run(name, law=law, jobs=jobs, cluster=cluster, progress=progress, **changes, sweep=table)


def compare(
    name: str | Path | Loaded,
    *,
    engines: Sequence[str] = comparison.DEFAULT,
    jobs: int | None = None,
    cluster: str | None = None,
    **changes: Any,
) -> Compared:
    """Runs a scenario in several engines.

    Args:
        name: Name, path, or as from `load`.
        engines: Names of at least two engines.
        jobs: Number of processes of an ensemble; default: all cores.
        cluster: See `run`.
        **changes: See `load`.

    Raises:
        InputError: Something cannot be used.
    """
    loaded = load(name, **changes)
    if loaded.law is not None:
        raise InputError("compare: law: expected in a file (law = 'path.py:Class'), got a Python object")
    with campaign.workers_at(jobs, cluster, False, _tell) as workers:
        return Compared(comparison.compare(loaded.name, title_of(loaded.name), loaded.changes, workers, engines))
