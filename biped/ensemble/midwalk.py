"""Starts in the middle of a walk: what a run tests is then the walk, and not how well it begins from a posture."""

from collections.abc import Callable
from dataclasses import replace

from msgspec import structs

from biped.measure.trajectory import Trajectory
from biped.robot.load import starts_of
from biped.robot.run import Run
from biped.robot.starts import Starts
from biped.scenario.vary import stream
from biped.scenario.world import Ground

WITHIN = 1.0
"""[s] within which a run takes the walk over, drawn for each run; as long again the walk may stand on both feet."""
TRIES = 5
"""Walks that are made again at most."""


def begun_walking(run: Run, simulate: Callable[[Run], Trajectory]) -> Run:
    """A run that begins in the middle of a walk of the same robot, by the same gait and of the same truth.

    Args:
        run: Its scenario says for how long the walk has gone on, `start.walking`.
        simulate: Makes the walk. One that falls before is made again from other deviations of the posture; if all
            fall, the run begins in the posture itself.
    """
    s = run.scenario
    moment = s.start.walking + WITHIN * float(stream(run.seed, "start.walking").random())
    level = structs.replace(
        s,
        start=structs.replace(s.start, walking=0.0, upright=False),
        ground=structs.replace(s.ground, slope=0.0, side_slope=0.0, tiles=Ground().tiles, steps=Ground().steps),
        duration=moment + WITHIN,
        push=(),
        disturbance=None,
        change=(),
    )
    starts = starts_of(run.model, run.robot, s.robot)
    assert isinstance(starts, Starts)
    first, begun = round(moment / run.tick), run
    for number in range(1 + (TRIES if s.start.jitter else 0)):  # without deviations all walks are the same
        if number:
            q, v = starts.start(level, stream(run.seed, f"start.walking.{number - 1}"))
            begun = replace(run, q=q, v=v)
        walk = simulate(replace(begun, scenario=level))
        if len(walk) > first:
            q, v = starts.from_walk(s, walk.q, walk.v, first)
            return replace(run, q=q, v=v)
    still = structs.replace(s, start=structs.replace(s.start, walking=0.0))
    q, v = starts.start(still, stream(run.seed, "start.jitter") if s.start.jitter else None)
    return replace(run, q=q, v=v)
