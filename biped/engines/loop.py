"""The loop of every run: a law ticks and the physics steps, span by span, until the end, a fall or a broken number.

What is stepped is a *plant*. An engine is a module with `simulate(run)`, which makes a plant and hands it to `drive`;
where law and physics are compiled together the plant's `advance` is one call of compiled code, otherwise `in_python`.

A fall is a trunk too low above the ground, or too far from the vertical. It is the same for every robot and engine, and
of the true state alone: what a law senses, believes or measures angles from has no part in it. Kernels judge:
`biped.engines.row` of any robot, `biped.engines.planar.plant` of seven links, `biped.engines.space` of the compiled
free base; statuses and words are the same for all.
"""

from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import Any, NamedTuple, Protocol

import mujoco
import numpy as np

from biped.base.errors import InputError
from biped.base.files import nearest
from biped.control.law import Raised
from biped.robot.run import Run
from biped.scenario.keys import Scenario
from biped.scenario.pushing import pieces

GOING, LOW, TILTED, NOT_FINITE, RAISED = 0, 1, 2, 3, 4
"""Statuses of a tick: the run goes on, the trunk is too low, it leans too far, a number is not finite, a law failed."""

_STILL = 0.2
"""[m/s] below which a fall has no direction."""


def fall_words(way: np.ndarray, time: float) -> str:
    """Where a robot fell to, and when.

    Args:
        way: (2,) or longer: forward and to the left, of the trunk's axis where it leaned too far, otherwise of the
            velocity [m/s]: a trunk that is held upright over toppling legs falls the way it moves.
        time: [s].
    """
    forward, left = way[:2]
    if max(abs(forward), abs(left)) < _STILL:
        return f"collapsed at {time:.3f} s"
    if abs(left) > abs(forward):
        return f"fell to the {'left' if left > 0.0 else 'right'} at {time:.3f} s"
    return f"fell {'forward' if forward > 0.0 else 'backward'} at {time:.3f} s"


MOST = 10_000
"""Ticks of one call of a plant, which an interrupt has to wait for."""


class Ending(NamedTuple):
    """How a run ended.

    Attributes:
        end: `completed`, `fell`, `diverged` or `raised`.
        cause: In words; empty for a completed run.
        traceback: Of a law that raised.
        warnings: How often the engine warned of what.
    """

    end: str
    cause: str = ""
    traceback: str = ""
    warnings: dict[str, int] = {}  # noqa: RUF012 – never changed


class Plant(Protocol):
    """The protocol of an engine in the loop; a law's ticks are the plant's, since compiled laws tick in compiled loops.

    Attributes:
        run: The run that is simulated.
    """

    run: Run

    @property
    def bodies(self) -> Sequence[str]:
        """Names of the bodies that can be pushed."""
        ...

    def turned(self, force: tuple[float, ...]) -> np.ndarray:
        """A push (d,) [N] in the ground's frame."""
        ...

    def push(self, forces: np.ndarray, /) -> None:
        """Has forces (len(bodies), d) [N] act from the next tick on."""
        ...

    def advance(self, first: int, last: int, /) -> tuple[int, int]:
        """Ticks first … last - 1: the last one's status (`biped.engines.loop`), and the number of rows logged by now.

        Raises:
            Raised: The law failed.
        """
        ...

    def fall(self, status: int, row: int) -> str:
        """How the robot fell at a row of the log, in words."""
        ...

    def velocities(self, row: int) -> tuple[Sequence[str], np.ndarray]:
        """Names and values of the velocities in a row of the log."""
        ...

    def warnings(self) -> dict[str, int]:
        """How often the engine has warned of what."""
        ...

    def trajectory(self, rows: int, ending: Ending) -> Any:
        """The trajectory of so many rows."""
        ...


def drive(plant: Plant, distrust: bool = True) -> Any:
    """Simulates a run.

    Args:
        plant: What moves the robot.
        distrust: Whether a warning means that the numbers are wrong: what falls because they exploded has not fallen.

    Returns:
        The plant's trajectory.

    Raises:
        InputError: A push names a body the model lacks, or the law misbehaves at the first tick.
    """
    run = plant.run
    status, done, raised = GOING, 0, None
    for start, stop, forces in push_spans(run.scenario, plant.bodies, plant.turned, run.ticks, run.tick):
        plant.push(forces)
        for first in range(start, stop, MOST):
            try:
                status, done = plant.advance(first, min(stop, first + MOST))
            except Raised as error:
                if error.tick == 0:
                    raise
                status, done, raised = RAISED, error.tick, error
            if status != GOING:
                break
        if status != GOING:
            break
    return plant.trajectory(done, _ending(plant, status, done, raised, distrust))


def by_kind(run: Run, planar: Callable[[Run], Any], other: Callable[[Run], Any]) -> Any:
    """Simulates a run by an engine's way with seven links in a plane, or by its way with any other robot."""
    return (planar if run.scenario.robot is None else other)(run)


def in_python(tick: Callable[[int], int], step: Callable[[int], None]) -> Callable[[int, int], tuple[int, int]]:
    """`Plant.advance` tick by tick, for laws and engines that are not compiled.

    Args:
        tick: Logs the state of a tick, judges it and has the law decide; returns its status.
        step: Steps the physics to the next tick.
    """

    def advance(first: int, last: int) -> tuple[int, int]:
        for k in range(first, last):
            if (status := tick(k)) != GOING:
                return status, k + 1
            step(k)
        return GOING, last

    return advance


def _ending(plant: Plant, status: int, done: int, raised: Raised | None, distrust: bool) -> Ending:
    warnings, tick = plant.warnings(), plant.run.tick
    if status == NOT_FINITE:
        row = max(done - 2, 0)
        names, values = plant.velocities(row)
        worst = names[int(np.argmax(np.abs(values)))]
        cause = f"a coordinate stopped being finite after {row * tick:.3f} s (largest: {worst})"
        return Ending("diverged", cause, warnings=warnings)
    if raised is not None:
        end, cause = "raised", raised.cause
    else:
        end, cause = ("completed", "") if status == GOING else ("fell", plant.fall(status, done - 1))
    if warnings and distrust:
        doubt = f"MuJoCo warned of {', '.join(warnings)} before {max(done - 1, 0) * tick:.3f} s"
        end, cause = "diverged", f"{doubt}; {cause}" if cause else doubt
    return Ending(end, cause, "" if raised is None else raised.traceback, warnings)


def mujoco_warnings(data: mujoco.MjData) -> dict[str, int]:
    """How often MuJoCo warned of what."""
    counts = data.warning.number
    return {mujoco.mjtWarning(i).name.removeprefix("mjWARN_").lower(): int(counts[i]) for i in np.flatnonzero(counts)}


def push_spans(
    s: Scenario, bodies: Sequence[str], turned: Callable[[tuple[float, ...]], np.ndarray], count: int, tick: float
) -> list[tuple[int, int, np.ndarray]]:
    """The run in spans in which the same forces act.

    Args:
        s: The scenario.
        bodies: Names of the bodies that can be pushed.
        turned: The force of a push (d,) in the ground's frame.
        count: Number of ticks.
        tick: [s].

    Returns:
        (first tick, last tick + 1, forces (len(bodies), d) [N]) of each span.

    Raises:
        InputError: A push names a body that is not there.
    """
    for i, p in enumerate(s.push):
        if p.body not in bodies:
            raise InputError(
                f"push[{i}].body: model '{s.model}' has no body '{p.body}'; {nearest(p.body, list(bodies))}"
            )
    size = len(turned((0.0, 0.0)))
    begin: dict[int, list[tuple[int, int, np.ndarray]]] = {}
    cuts = {0, count}
    for piece in pieces(s):
        first, last = round(piece.start / tick), round(piece.end / tick)
        cuts |= {min(first, count), min(last, count)}
        begin.setdefault(first, []).append((last, bodies.index(piece.body), turned(piece.force)))
    out, acting = [], []
    for first, last in pairwise(sorted(cuts)):
        acting = [one for one in acting if one[0] > first] + begin.get(first, [])
        total = np.zeros((len(bodies), size))
        for _, body, force in acting:
            total[body] += force
        out.append((first, last, total))
    return out
