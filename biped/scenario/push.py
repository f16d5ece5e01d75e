"""Forces on bodies: tables of a scenario file, which `biped.scenario.pushing` and `disturbed` cut into pieces."""

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
        of: What the force is a multiple of: 1 N (`si`), or the robot's `weight` m g.
        body: A body of the model; the force acts at its centre of mass.
        shape: How the force goes with time: `constant`; a `ramp` from nothing to `force` at the end; or a `sine`.
        frequency: [Hz] of the sine.
        times: How often it comes.
        every: [s] from the begin of one to that of the next, where it comes more than once.
    """

    at: NonNegative
    duration: Positive
    force: Force
    of: Literal["si", "weight"] = "si"
    body: Name = "torso"
    shape: Literal["constant", "ramp", "sine"] = "constant"
    frequency: Annotated[float, Meta(gt=0, le=100)] = 1.0
    times: Annotated[int, Meta(ge=1, le=10_000)] = 1
    every: Positive = 1.0


class Disturbance(Section, frozen=True):
    """A random force on a body from a time to the end of the run: an Ornstein-Uhlenbeck process.

    Its components are independent, normal with mean zero, and correlated as exp(-t / correlation) over a time t.

    Attributes:
        force: [N] root mean square forward (horizontally) and up; of a robot that moves in space forward, to the left
            and up.
        correlation: [s] over which the force forgets what it was; it is constant for a tenth of that.
        body: A body of the model; the force acts at its centre of mass.
        at: [s] when it begins.
    """

    force: Force
    correlation: Annotated[float, Meta(gt=0, le=1000)] = 0.2
    body: Name = "torso"
    at: NonNegative = 0.0
