"""The velocity that a law is asked for: a table of a scenario file, constant or in pieces."""

from typing import Annotated

import numpy as np
from msgspec import Meta

from biped.scenario.section import Hold, NonNegative, Real, Section

WAYS = ("forward", "left", "yaw")
"""Components of a command, in their order."""
COMMANDED = tuple(f"command_{way}" for way in WAYS)
"""Signals of a run that a command is logged as."""


class CommandPiece(Section, frozen=True):
    """A command that holds from a time on.

    Attributes:
        at: [s] when it begins.
        over: [s] over which the command goes to it in a straight line; 0: at once.
        forward: [m/s] in the direction that the base faces.
        left: [m/s].
        yaw: [rad/s], to the left positive.
    """

    at: NonNegative
    over: Hold = 0.0
    forward: Real = 0.0
    left: Real = 0.0
    yaw: Real = 0.0


class Command(Section, frozen=True):
    """The velocity that a law is asked for.

    Attributes:
        forward: [m/s] in the direction that the base faces.
        left: [m/s].
        yaw: [rad/s], to the left positive.
        piece: What it becomes later.
    """

    forward: Real = 0.0
    left: Real = 0.0
    yaw: Real = 0.0
    piece: Annotated[tuple[CommandPiece, ...], Meta(max_length=1000)] = ()

    def at(self, time: float) -> tuple[float, float, float]:
        """Forward, left [m/s] and yaw [rad/s] at a time [s]."""
        if not self.piece:
            return self.forward, self.left, self.yaw
        forward, left, yaw = self.over(np.array([time]))[0].tolist()
        return forward, left, yaw

    def over(self, times: np.ndarray) -> np.ndarray:
        """(n, 3) the same at times (n,) [s]."""
        now, begun = np.tile([self.forward, self.left, self.yaw], (len(times), 1)), np.ones(len(times), dtype=bool)
        for piece in self.piece:
            begun &= times >= piece.at - 1e-9
            gone = np.maximum(0.0, times - piece.at)
            share = np.minimum(1.0, gone / piece.over) if piece.over > 0.0 else np.ones(len(times))
            then = now + share[:, None] * (np.array([piece.forward, piece.left, piece.yaw]) - now)
            now = np.where(begun[:, None], then, now)
        return now
