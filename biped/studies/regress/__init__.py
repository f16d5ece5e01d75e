"""`biped regress`: scenarios against their references, and new references."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import date
from importlib.util import find_spec
from pathlib import Path
from typing import Any, NamedTuple

from biped.base.errors import InputError
from biped.base.files import names
from biped.ensemble import journal
from biped.ensemble.backend import Jobs, Progress, silent
from biped.ensemble.journal import installed
from biped.ensemble.plan import Plan
from biped.scenario.engines import ENGINES
from biped.studies.regress import references as past
from biped.studies.run import plan_of, title_of

LEARNED = "policy/"
"""Names of scenarios begin so whose law is a learned policy: they need onnxruntime, which running does not."""


class ScenarioOutcome(NamedTuple):
    """The outcome of a regression run.

    Attributes:
        verdicts: Of every scenario, and of all of them `altogether` where several were compared.
        platform: This platform.
        updated: Whether what differed was recorded; then nothing can fail.
        recorded: Names of the scenarios whose references were written.
        stopped: Whether it was interrupted: these are the scenarios that were finished.
    """

    verdicts: list[past.ScenarioComparison]
    platform: dict[str, str]
    updated: bool
    recorded: list[str]
    stopped: bool

    @property
    def passed(self) -> bool:
        """Whether all is as recorded, or was recorded now."""
        return not self.stopped and (self.updated or all(verdict.passed for verdict in self.verdicts))

    def as_dict(self) -> dict[str, Any]:
        """Plain data, as `--json` prints it."""
        verdicts = [
            v._asdict() | {"metrics": {name: moved._asdict() for name, moved in v.metrics.items()}}
            for v in self.verdicts
        ]
        return self._asdict() | {"passed": self.passed, "verdicts": verdicts}


def regress(
    scenarios: Sequence[str], jobs: Jobs, file: Path | None, reason: str | None, progress: Progress = silent,
    engine: str | None = None,
) -> ScenarioOutcome:  # fmt: skip
    """Runs scenarios and compares them with their references.

    Args:
        scenarios: Names or paths; none: every scenario that has a name, and complaints about references without one.
        jobs: Number of processes, or a cluster.
        file: File of references; default: that of the shipped scenarios.
        reason: Why results changed: what differs from its reference is recorded as the new one. None: nothing is
            written. What was finished when an update is interrupted is kept.
        progress: Told of every finished run.
        engine: To run all in, instead of each in its own; then the default is the scenarios of that engine's file.

    Raises:
        InputError: A scenario or the file cannot be used.
    """
    path = past.shipped(engine) if file is None else file
    references = past.read(path)
    if engine is not None:
        scenarios = scenarios or list(references.scenarios)
        if not scenarios:
            raise InputError(f"--engine {engine}: has no references yet; expected names of scenarios, and --update")
    if reason is not None and not path.absolute().parent.is_dir():
        raise InputError(f"--file {path}: cannot be written: expected a file in a folder that exists")
    plans = _plans(scenarios or _that_run_here(), () if engine is None else (f"engine={engine}",))
    here = journal.here() | _library(engine)
    update = None if reason is None else _Update(path, references, here, reason, None if scenarios else set(plans))
    verdicts: list[past.ScenarioComparison] = []
    stopped = False
    try:
        _compare(plans, references.scenarios.copy(), jobs, journal.key(here), update, verdicts, progress)
    except KeyboardInterrupt:
        stopped = True
    if not scenarios and not stopped:
        for name in sorted(references.scenarios.keys() - {title_of(name) for name in names("scenarios")}):
            verdicts.append(past.missing(name, past.GONE, 0))
            if update is not None:
                update.record(name, None)
    if len(past.compared(verdicts)) > 1:
        verdicts.append(past.altogether(verdicts))
    return ScenarioOutcome(verdicts, here, update is not None, [] if update is None else update.recorded, stopped)


def _that_run_here() -> list[str]:
    """Named scenarios; those of learned policies where there is something to ask a network with."""
    return [name for name in names("scenarios") if not name.startswith(LEARNED) or find_spec("onnxruntime")]


def _plans(scenarios: Sequence[str], changes: Sequence[str]) -> dict[str, Plan]:
    plans: dict[str, Plan] = {}
    for name in scenarios:
        title = title_of(name)
        if title in plans:
            raise InputError(f"{name}: a scenario '{title}' was named before; expected scenarios of different names")
        plans[title] = past.ensemble(plan_of(name, changes))
    return plans


def _compare(
    plans: dict[str, Plan],
    known: dict[str, past.RecordedScenario],
    jobs: Jobs,
    here: str,
    update: _Update | None,
    verdicts: list[past.ScenarioComparison],
    progress: Progress,
) -> None:
    """Adds the verdict of each scenario to `verdicts` as it is finished."""
    today = date.today().isoformat()
    with progress("regress", sum(len(past.chosen(plan)) for plan in plans.values()), 0) as advance:
        for name, plan in plans.items():
            new = past.measured(plan, jobs, today, here, advance)
            old = known.get(name)
            verdicts.append(
                past.missing(name, past.NEW, len(new.runs)) if old is None else past.compare(name, old, new)
            )
            if update is not None and (verdicts[-1].verdict != past.SAME or not verdicts[-1].exact):
                update.record(name, new)


def _library(engine: str | None) -> dict[str, str]:
    """The version of the library that an engine needs besides; of none, or of one that is not installed, nothing."""
    name = "" if engine is None else ENGINES[engine].library
    found = installed(name) if name else ""
    return {name: found} if found else {}


class _Update:
    """Writes references as they come, with one entry in the history for all of them."""

    def __init__(
        self, path: Path, references: past.References, here: dict[str, str], reason: str, every: set[str] | None
    ):
        self.path, self.references, self.reason, self.every = path, references, reason, every
        self.recorded: list[str] = []
        self.key = journal.key(here)
        self.history = references.history
        references.platforms[self.key] = here

    def record(self, name: str, new: past.RecordedScenario | None) -> None:
        """Puts a scenario's reference in the file, or takes it out."""
        if new is None:
            del self.references.scenarios[name]
        else:
            self.references.scenarios[name] = new
        self.recorded.append(name)
        whole = self.every is not None and self.every <= set(self.recorded)
        change = past.ReferenceChange(
            date=date.today().isoformat(),
            reason=self.reason,
            sources=journal.sources(),
            platform=self.key,
            scenarios=["all"] if whole else self.recorded,
        )
        self.references.history = [change, *self.history]
        past.write(self.path, self.references)
