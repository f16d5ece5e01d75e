"""The declared pushes of a run, whatever it moves in: piece by piece, and as people see them.

The pieces of one that changes belong together.
"""

from typing import NamedTuple

import numpy as np

from biped.measure.trajectory import Trajectory
from biped.scenario.pushing import PIECE


class PushPiece(NamedTuple):
    """A force on a body, or a piece of one that changes.

    Attributes:
        start: [s].
        end: [s].
        force: [N] forward, to the left and up.
        body: What is pushed.
    """

    start: float
    end: float
    force: tuple[float, float, float]
    body: str


def declared(t: Trajectory) -> list[PushPiece]:
    """The pushes of a run, those that change in pieces; of a run in the plane none goes to the left."""
    return [
        PushPiece(start, end, (force[0], force[1] if len(force) > 2 else 0.0, force[-1]), body)
        for start, end, *force, body in t.pushes
    ]


class PushInterval(NamedTuple):
    """A push from its begin to its end.

    Attributes:
        body: What is pushed.
        time: (k + 1,) [s] at which pieces begin, and the last ends.
        force: (k, 3) [N] forward, to the left and up.
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
        forward, left, up = self.force[0]
        aside = f", {left:+g} N to the left" if left else ""
        return f"{forward:+g} N{aside}" + (f", {up:+g} N up" if up else "")

    @property
    def largest(self) -> float:
        """[N]."""
        return float(np.linalg.norm(self.force, axis=1).max())


def pushes_of(t: Trajectory) -> list[PushInterval]:
    """The pushes of a run in the order of the scenario."""
    groups: list[list[PushPiece]] = []
    for piece in declared(t):
        last = groups[-1][-1] if groups and piece.end - piece.start < PIECE + 0.5 * t.tick else None
        if last is not None and last.body == piece.body and abs(last.end - piece.start) < 0.5 * t.tick:
            groups[-1].append(piece)
        else:
            groups.append([piece])
    return [
        PushInterval(
            body=group[0].body,
            time=np.array([group[0].start, *(piece.end for piece in group)]),
            force=np.array([piece.force for piece in group]),
        )
        for group in groups
    ]
