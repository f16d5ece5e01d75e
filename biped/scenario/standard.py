"""The table [standard] of a scenario file: a test of `biped standard`, and what is searched to failure in it."""

from typing import Annotated, Literal

from msgspec import Meta, field

from biped.scenario.section import LARGEST, Name, Positive, Real, Section


class Standard(Section, frozen=True):
    """A standard test: the scenario's ensemble as it is, or at values of a key from the easiest to where it fails.

    Attributes:
        title: Of its row.
        order: Of rows: small ones come first.
        goal: What a run has to do.
        key: Dotted key that is searched, instead of any [sweep]; default: none.
        first: Its easiest value, where the search begins.
        step: From value to value until one fails; negative: downwards.
        last: Where the search ends if none fails.
        resolution: To which the largest value that holds is found between the last that holds and the first that fails;
            steps are a whole number of them.
        of: What values are multiples of: 1 (`si`), the robot's `weight` m g [N], or its `leg` length [m].
        legs: Other keys, and how many leg lengths they are set to.
        weights: Other keys, and how many weights m g they are set to.
        times: What the value is multiplied by in the table, e.g. by a duration for an impulse.
        unit: Of that product.
        shows: Metrics, at the largest value that holds.
        family: Whether it is for gaits alone that have `[[speeds]]`, whose range bounds the search.
        gaits: Which gaits it is for; default: all.
        space: Whether it is for gaits of bipeds that move in space ([frontal] and [axial]); or of those in the plane.
    """

    title: Name
    order: Real = 0.0
    goal: Literal["walked", "stood"] = "walked"
    key: Name | None = None
    first: Real = 0.0
    step: Real = 1.0
    last: Real = 1.0
    resolution: Positive = 1.0
    of: Literal["si", "weight", "leg"] = "si"
    legs: dict[str, Annotated[float, Meta(gt=0, le=LARGEST)]] = field(default_factory=dict)
    weights: dict[str, Real] = field(default_factory=dict)
    times: Real = 1.0
    unit: Name = ""
    shows: tuple[Name, ...] = ()
    family: bool = False
    gaits: tuple[Name, ...] = ()
    space: bool = False
