"""The velocity that a law is asked for: a table of a scenario file, constant or in pieces."""

from __future__ import annotations

from typing import Annotated

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
        now = self.forward, self.left, self.yaw
        for piece in self.piece:
            if time < piece.at - 1e-9:
                break
            share = 1.0 if piece.over == 0.0 else min(1.0, max(0.0, time - piece.at) / piece.over)
            then = piece.forward, piece.left, piece.yaw
            now = tuple(a + share * (b - a) for a, b in zip(now, then, strict=True))
        return now[0], now[1], now[2]
