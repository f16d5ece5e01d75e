"""Latency between a law and its motors: commands that are under way, each for a time of its own."""

from __future__ import annotations

import numpy as np

from biped.robot.run import Run
from biped.scenario.vary import stream


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
