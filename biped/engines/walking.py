"""The compiled loop of the law `thesis` on any robot, whatever its feet are.

The same digits as tick by tick in Python (`biped.engines.plant`). Robots on eight spheres have a shorter loop of their
own (`biped.engines.space`).
"""

from typing import NamedTuple

import numpy as np

from biped.base.address import call
from biped.base.jit import bound, inner_kernel, long_kernel
from biped.control.blending import blend
from biped.control.space.law import Spatial
from biped.control.space.own import Own
from biped.control.space.places import Mechanics
from biped.control.space.setup import mechanics_of
from biped.engines.loop import GOING, RAISED
from biped.engines.native import without_clock
from biped.engines.sensing import CompiledSensors, sense, sensing_of
from biped.engines.space import compiles, decide, write_signals
from biped.engines.stepping import Stepped, Stepping, Works, judge, stepping_of, take_tick


class WalkingPlant(NamedTuple):
    """A robot that the law walks, as compiled code takes it.

    Attributes:
        physics: What is stepped.
        mechanics: What MuJoCo knows of the walker, live.
        own: As of `Spatial.owns`.
        sensing: (`biped.engines.sensing.CompiledSensors`,) where the law is not told the true state, otherwise ().
        driven: (n,) the law's torques that actuators have.
        drives: (n,) which actuators these are.
    """

    physics: Stepping
    mechanics: Mechanics
    own: tuple[Own, ...]
    sensing: tuple[CompiledSensors, ...]
    driven: np.ndarray
    drives: np.ndarray


class WalkingLoop:
    """The loop of a run that is walked by joint torques.

    Args:
        plant: Of the run.
        walking: What compiled code takes.
    """

    def __init__(self, plant: Stepped, walking: WalkingPlant):
        law = plant.law.law
        self._plant, self._works, self._walking = plant, Works(plant), walking
        self._given = law.record, law.changes, walking, plant.log, plant.outside, plant.law.signals.values
        self._walk = bound(walk, *self._given, self._works.rows, self._noises(0), 0, 0)

    def _noises(self, ticks: int) -> np.ndarray:
        """(ticks, 2, nv) of sensors in the next ticks; none where nothing is sensed."""
        sensors = self._plant.sensors
        return sensors.noise(ticks) if sensors and self._walking.sensing else np.zeros((0, 2, 0))

    def takes(self, forces: np.ndarray) -> bool:
        """Whether it can be pushed by forces (bodies, 3) [N]: by none."""
        return not forces.any()

    def advance(self, first: int, last: int) -> tuple[int, int]:
        """Ticks first … last - 1, in which nothing pushes; see `biped.engines.loop.Plant`."""
        status, rows, works = GOING, first, self._works
        with without_clock():
            while rows < last and status == GOING:
                start = rows
                stop = min(last, start + works.most)
                status, rows = self._walk(*self._given, works.rows, self._noises(stop - start), start, stop)
                works.add_up(start, rows if status == GOING else rows - 1)
        if status == RAISED:
            self._plant.law.refuse(rows - 1, (rows - 1) * self._walking.physics.tick, self._walking.physics.command)
        return status, rows


def walking_loop(plant: Stepped) -> WalkingLoop | None:
    """The loop of a run, or None where it must be stepped from Python.

    Args:
        plant: Of a run of the law.
    """
    law: Spatial = plant.law.law
    if law.by_force or not compiles(law) or (physics := stepping_of(plant)) is None:
        return None
    sensing, told = (), plant.data
    if plant.senses and plant.sensors:
        if (reads := sensing_of(plant.sensors)) is None:
            return None
        sensing, told = (reads,), plant.sensors.data
    mechanics = mechanics_of(law.record[0], plant.model, plant.data)
    own = law.owns(told.qpos, told.qvel)
    return WalkingLoop(plant, WalkingPlant(physics, mechanics, own, sensing, law.driven, law.drives))


@inner_kernel
def _sense(sensing, state, noises, row):
    """Has sensors measure the true state; only where there are any is it compiled, as in `decide`."""
    if len(sensing) == 0:
        return
    sense(sensing[0], state.q, state.v, noises[row])


@long_kernel
def walk(record, changes, p, log, outside, signals, rows, noises, first, last):
    """Ticks first … last - 1 of a run in which nothing pushes.

    Args:
        record: (1,) `biped.control.space.record.control_type`.
        changes: Of it, `biped.control.blending.Changes`.
        p: `WalkingPlant`.
        log: (n, width) of `biped.robot.columns`; works are left out.
        outside: (n, 9) of `Trajectory.outside`.
        signals: (n, 6) of `biped.control.space.law`.
        rows: Of `biped.engines.stepping.Works`.
        noises: (last - first, 2, nv) of sensors.
        first: First tick.
        last: One past the last.

    Returns:
        The last tick's status (`biped.engines.loop`), and the number of rows in the log; RAISED: what
        `p.physics.command` holds is not finite, in the last of these rows.
    """
    c, physics = record[0], p.physics
    for k in range(first, last):
        call(physics.step1, physics.model, physics.data)
        status = judge(physics, log[k], outside[k], k * physics.tick)
        if status != GOING:
            return status, k + 1
        _sense(p.sensing, physics.state, noises, k - first)
        blend(changes, k)
        decide(record, p.mechanics, p.own, k == 0)
        write_signals(c, signals[k])
        physics.command[:] = 0.0
        for i in range(p.drives.size):
            physics.command[p.drives[i]] = c["tick"]["u"][p.driven[i]]
        if not take_tick(physics, rows, k - first, log[k], outside[k]):
            return RAISED, k + 1
    return GOING, last
