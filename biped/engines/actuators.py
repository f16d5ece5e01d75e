"""Actuators between a law and the physics: bounded torques, a first-order lag, and commands that are under way."""

import math

import numpy as np

from biped.base.jit import kernel
from biped.robot.run import Run
from biped.scenario.vary import stream


@kernel
def actuate(command, limits, follow, wanted, target):
    """Brings actuators towards what a law commands; returns whether that is finite, and otherwise does nothing.

    Args:
        command: (n,) what the law returned.
        limits: (n,) [N m] bounds of torques; inf of other commands.
        follow: Fraction of the way that actuators go in a tick.
        wanted: (n,) where they are, overwritten.
        target: (n,) what MuJoCo takes commands from, overwritten.
    """
    for j in range(command.size):
        if not math.isfinite(command[j]):
            return False
    for j in range(command.size):
        bounded = min(max(command[j], -limits[j]), limits[j])
        wanted[j] += follow * (bounded - wanted[j])
        target[j] = wanted[j]
    return True


class Latency:
    """Commands under way in one run; one that comes after a later one is dropped.

    Args:
        run: The run; its seed fixes what is drawn for each tick.
    """

    def __init__(self, run: Run):
        actuation = run.scenario.actuation
        self._least, self._more = round(actuation.delay / run.tick), round(actuation.delay_jitter / run.tick)
        self._rng = stream(run.seed, "actuation.delay")
        self._way: list[tuple[int, np.ndarray]] = []

    def pass_on(self, k: int, command: np.ndarray) -> np.ndarray:
        """Sends the command of tick k on its way, and returns the latest that has arrived; the first does at once."""
        jitter = int(self._rng.random() * (self._more + 1)) if self._more else 0
        self._way.append((k + self._least + jitter, command.copy()))
        newest = max((i for i, (arrival, _) in enumerate(self._way) if arrival <= k), default=0)
        del self._way[:newest]
        return self._way[0][1]
