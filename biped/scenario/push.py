"""A push: a table of a scenario file; its pieces are in `biped.scenario.pushing`."""

from __future__ import annotations

from typing import Annotated, Literal

from msgspec import Meta

from biped.scenario.section import Force, Name, NonNegative, Positive, Section

PLANE, SPACE = 2, 3
"""Components of its force, of robots that move in the plane and in space."""


class Push(Section, frozen=True):
    """A force on a body.

    Attributes:
        at: [s] when it begins.
        duration: [s] for which it acts.
        force: [N] forward (horizontally) and up, of a robot that moves in space forward, to the left and up; of shapes
            that change, the largest.
        body: A body of the model; the force acts at its centre of mass.
        shape: How the force goes with time: `constant`; a `ramp` from nothing to `force` at the end; or a `sine`.
        frequency: [Hz] of the sine.
    """

    at: NonNegative
    duration: Positive
    force: Force
    body: Name = "torso"
    shape: Literal["constant", "ramp", "sine"] = "constant"
    frequency: Annotated[float, Meta(gt=0, le=100)] = 1.0
