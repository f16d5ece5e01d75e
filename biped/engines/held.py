"""Stretches of a run in which a law holds what it commands: nothing but compiled code between two calls of a network.

The same digits as tick by tick in Python (`biped.engines.plant`).
"""

from typing import NamedTuple

import numpy as np

from biped.base.address import call
from biped.base.jit import bound, inner_kernel, long_kernel
from biped.control.card import Walker
from biped.engines.loop import GOING, RAISED
from biped.engines.stepping import Stepped, Stepping, Works, judge, stepping_of, take_tick


class HeldPlant(NamedTuple):
    """A robot whose actuators are held to targets, as compiled code takes it.

    Attributes:
        physics: What is stepped.
        servo: (3, n) stiffness, damping and effort of servos that the law computes; n = 0: none.
        driven: (n,) their actuators.
        places: (n,) where their joints stand in q.
        columns: (n,) where these stand in v.
    """

    physics: Stepping
    servo: np.ndarray
    driven: np.ndarray
    places: np.ndarray
    columns: np.ndarray


class HeldLoop:
    """The loop of a run whose law holds its commands.

    Args:
        plant: Of the run.
        held: What compiled code takes.
    """

    def __init__(self, plant: Stepped, held: HeldPlant):
        self._plant, self._held, self._works = plant, held, Works(plant)
        targets = np.zeros((1, plant.law.size))
        self._walk = bound(stretch, held, plant.log, plant.outside, targets, self._works.rows, 0, 0, 0, 0)

    def takes(self, forces: np.ndarray) -> bool:
        """Whether it can be pushed by forces (bodies, 3) [N]: by none."""
        return not forces.any()

    def advance(self, first: int, last: int) -> tuple[int, int]:
        """Ticks first … last - 1, in which nothing pushes; see `biped.engines.loop.Plant`."""
        plant, tick, noted, k, works = self._plant, self._held.physics.tick, first, first, self._works
        if (status := plant.look(k)) != GOING:
            return status, k + 1
        try:
            while k < last:
                plant.observation.begin(k * tick)
                plant.law.command(k, plant.observation)
                targets = self._delayed(k, plant.law.law.hold(min(last - k, works.most)))
                until = k + len(targets)
                if until - noted > works.most:
                    works.add_up(noted, k)
                    noted = k
                status, rows = self._walk(self._held, plant.log, plant.outside, targets, works.rows, k, until, last,
                                          k - noted)  # fmt: skip
                k = until if status == GOING else rows - 1
                if status == RAISED:
                    plant.law.refuse(k, k * tick, self._held.physics.command)
                if status != GOING:
                    return status, rows
        finally:
            works.add_up(noted, k)
        return GOING, last

    def _delayed(self, k: int, targets: np.ndarray) -> np.ndarray:
        """Targets from tick k on, as late as the run's actuators are."""
        latency = self._plant.latency
        if latency is not None:
            for i, row in enumerate(targets):
                if not np.isfinite(row).all():
                    break  # which is refused
                row[:] = latency.pass_on(k + i, row)
        return targets


def held_loop(plant: Stepped) -> HeldLoop | None:
    """The loop of a run, or None where it must be stepped from Python.

    Args:
        plant: Of the run.
    """
    law = plant.law.law
    if not isinstance(law, Walker) or plant.law.signals.names:
        return None
    if plant.latency is not None and law.servo is not None:
        return None
    if (physics := stepping_of(plant)) is None:
        return None
    servo = np.zeros((3, 0)) if law.servo is None else np.array(law.servo)
    return HeldLoop(plant, HeldPlant(physics, servo, law.driven, law.places, law.columns))


@inner_kernel
def _decide(p, target):
    """Writes the command (nu,) of a tick: what is held, or torques of the law's own servos towards it."""
    command, v, q = p.physics.command, p.physics.state.v, p.physics.state.q
    for j in range(command.size):
        command[j] = 0.0 if p.servo.shape[1] else target[j]
    for i in range(p.servo.shape[1]):
        j, most = p.driven[i], p.servo[2, i]
        u = p.servo[0, i] * (target[j] - q[p.places[i]]) - p.servo[1, i] * v[p.columns[i]]
        if u < -most:
            u = -most
        elif u > most:
            u = most
        command[j] = u


@long_kernel
def stretch(p, log, outside, targets, rows, first, last, end, noted):
    """Ticks first … last - 1 of a run, of which the first has been judged and logged; and so is the next one.

    Args:
        p: `HeldPlant`.
        log: (n, width) of `biped.robot.columns`; works are left out.
        outside: (n, 9) of `Trajectory.outside`.
        targets: (last - first, nu) what actuators are held to, tick by tick.
        rows: (3, n, substeps, nv), overwritten by what works are made of (`biped.engines.actuators.Account.of_steps`).
        first: First tick.
        last: One past the last.
        end: The tick that is neither judged nor logged any more, nor any beyond.
        noted: Number of ticks that are noted in `rows`.

    Returns:
        The last tick's status (`biped.engines.loop`), and the number of rows in the log where that is not GOING;
        RAISED: what `p.physics.command` holds is not finite, in the last of these rows.
    """
    physics = p.physics
    for k in range(first, last):
        _decide(p, targets[k - first])
        if not take_tick(physics, rows, noted + k - first, log[k], outside[k]):
            return RAISED, k + 1
        if k + 1 < end:
            call(physics.step1, physics.model, physics.data)
            status = judge(physics, log[k + 1], outside[k + 1], (k + 1) * physics.tick)
            if status != GOING:
                return status, k + 2
    return GOING, last
