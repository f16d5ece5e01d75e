"""Pushes as people see them: the pieces of one that changes belong together."""

from typing import Any, NamedTuple

import numpy as np

from biped.measure.trajectory import Trajectory
from biped.scenario.pushing import PIECE


class PushInterval(NamedTuple):
    """A push from its begin to its end.

    Attributes:
        body: What is pushed.
        time: (k + 1,) [s] at which pieces begin, and the last ends.
        force: (k, 2) [N] forward and up; in space (k, 3), forward, to the left and up.
    """

    body: str
    time: np.ndarray
    force: np.ndarray

    @property
    def start(self) -> float:
        """[s]."""
        return float(self.time[0])

    @property
    def end(self) -> float:
        """[s]."""
        return float(self.time[-1])

    @property
    def size(self) -> str:
        """How strong it is, in words."""
        if len(self.force) > 1:
            return f"changing, up to {self.largest:.0f} N"
        forward, *left, up = self.force[0]
        aside = f", {left[0]:+g} N to the left" if left and left[0] else ""
        return f"{forward:+g} N{aside}" + (f", {up:+g} N up" if up else "")

    @property
    def largest(self) -> float:
        """[N]."""
        return float(np.linalg.norm(self.force, axis=1).max())


def pushes_of(t: Trajectory) -> list[PushInterval]:
    """The pushes of a run in the order of the scenario."""
    groups: list[list[tuple[Any, ...]]] = []
    for piece in t.pushes:
        small = piece[1] - piece[0] < PIECE + 0.5 * t.tick
        if groups and small and groups[-1][-1][-1] == piece[-1] and abs(groups[-1][-1][1] - piece[0]) < 0.5 * t.tick:
            groups[-1].append(piece)
        else:
            groups.append([piece])
    return [
        PushInterval(
            body=group[0][-1],
            time=np.array([group[0][0], *(piece[1] for piece in group)]),
            force=np.array([piece[2:-1] for piece in group]),
        )
        for group in groups
    ]
