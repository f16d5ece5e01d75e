"""Disturbing any walk in its middle: a push of one tick, and how long a walk must be to be disturbed and compared.

`growth.py` measures how far the disturbed walk and the other come apart, `sensitivity.py` what happens to its steps.
"""

import dataclasses
import math

from msgspec.structs import replace

from biped.base.errors import RunError
from biped.measure.trajectory import Trajectory
from biped.robot.ground import GRAVITY
from biped.robot.run import Run
from biped.scenario.world import Push
from biped.studies.run import title_of

RESAMPLED = 2000
"""Draws of which an interval is made."""
LASTING = 24.0
"""[s] of a walk unless a change says otherwise."""


def expect_enough(name: str, own: Trajectory, count: int, least: int, words: str) -> None:
    """Rejects a walk that is too short to be disturbed and compared.

    Args:
        name: Name or path of the scenario.
        own: The walk.
        count: How many it has of what is counted.
        least: How many it needs.
        words: What is counted.

    Raises:
        RunError: It has fewer.
    """
    if count < least:
        raise RunError(f"{title_of(name)}: {count} {words} in {own.time[-1]:.1f} s ({own.end}); expected at least "
                       f"{least}: raise duration, or take a gait that walks")  # fmt: skip


def with_push(run: Run, impulse: float, row: int, axis: int = 0) -> Run:
    """Returns the run with a push of one tick on its trunk.

    Args:
        run: The run.
        impulse: In m √(g l).
        row: Tick of the push.
        axis: 0 forward; in space 1 to the left.
    """
    robot, s = run.robot, run.scenario
    newton = impulse * robot.mass * math.sqrt(GRAVITY * robot.leg) / run.tick
    force = tuple(newton if i == axis else 0.0 for i in range(len(robot.moving_columns)))
    push = Push(at=row * run.tick, duration=run.tick, force=force, body=robot.bodies[robot.trunk_number - 1])
    return dataclasses.replace(run, scenario=replace(s, push=(*s.push, push)))
