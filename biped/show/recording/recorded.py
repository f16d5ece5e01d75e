"""A recorded run: its parts, and its place in the recording."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import mujoco
import numpy as np
import rerun as rr

from biped.base.errors import InputError
from biped.base.text import plain
from biped.measure.signals import finite
from biped.measure.trajectory import Trajectory

LANE = 1.6
"""[m] sideways from run to run."""


def nothing_believed(trajectory: Trajectory) -> None:
    """Of a controller that counts on no ground forces."""


class Recorded(NamedTuple):
    """One run to record.

    Attributes:
        name: Its name in the recording, of which its entities are; unlike the others'.
        trajectory: What it left behind.
        model: MuJoCo model with its visual geoms.
        metrics: Metrics by name; may be empty.
        checks: Every check as in a result (`biped.ensemble.checks.Check`); empty if nothing was expected.
        scenario_text: The effective scenario as TOML.
        ghost: Draw it as a grey shadow over the run before it.
        title: What people call it; default: its name.
        believed: Ground forces (n, 4, 2) [N] that the controller counts on, given the trajectory; None if it does not.
    """

    name: str
    trajectory: Trajectory
    model: mujoco.MjModel
    metrics: Mapping[str, Any]
    checks: Sequence[Mapping[str, Any]]
    scenario_text: str
    ghost: bool = False
    title: str = ""
    believed: Callable[[Trajectory], np.ndarray | None] = nothing_believed


class Placed(NamedTuple):
    """A run with its place in the recording.

    Attributes:
        run: The run; rows that are not finite are gone.
        root: Entity path below which everything of it is logged.
        lane: [m] sideways.
        number: Its number among the runs.
        alone: Whether it is the only one.
    """

    run: Recorded
    root: str
    lane: float
    number: int
    alone: bool

    def entity(self, *parts: str) -> str:
        """The entity path of something that belongs to the run."""
        return "/".join([self.root, *(rr.escape_entity_path_part(part) for part in parts)])


def times(seconds: np.ndarray) -> rr.TimeColumn:
    """The time line of a recording at (m,) [s], in whole nanoseconds: 1.053 s is not 1.052999999 s."""
    return rr.TimeColumn("time", duration=np.round(1e9 * seconds).astype("timedelta64[ns]"))


def place(runs: Sequence[Recorded]) -> list[Placed]:
    """Puts runs side by side, ghosts over the run before them.

    Raises:
        InputError: A run has no row that is finite: there is nothing to see of it.
    """
    placed, lane = [], 0.0
    for number, run in enumerate(runs):
        if number > 0 and not run.ghost:
            lane += LANE
        root = "/" + rr.escape_entity_path_part(run.name)
        whole = run._replace(trajectory=finite(run.trajectory))
        if len(whole.trajectory) == 0:
            raise InputError(f"recording: {plain(run.name)} is finite at no time: there is nothing to see")
        placed.append(Placed(whole, root, lane, number, len(runs) == 1))
    return placed
