"""Building blocks of the tables of a scenario file: numbers with bounds.

No number of a walk comes near these bounds: they keep what is computed from a number (ticks, buffers, squares) within
what a machine holds, so that nothing behind them has to ask again.
"""

from typing import Annotated

from msgspec import Meta, Struct

LARGEST = 1e15
"""Of any number: its square, and products of a few of them, are still finite."""

Real = Annotated[float, Meta(ge=-LARGEST, le=LARGEST)]
Positive = Annotated[float, Meta(gt=0, le=LARGEST)]
NonNegative = Annotated[float, Meta(ge=0, le=LARGEST)]
Factor = Annotated[float, Meta(ge=1e-6, le=1e6)]
"""Of what is a number of the model's."""
Degrees = Annotated[float, Meta(ge=-36000, le=36000)]
Hold = Annotated[float, Meta(ge=0, le=1000)]
"""[s] for which something is waited for."""
Count = Annotated[int, Meta(ge=1, le=1_000_000)]
Name = Annotated[str, Meta(max_length=4000)]
Names = Annotated[tuple[Name, ...], Meta(max_length=1000)]
Force = Annotated[tuple[Real, ...], Meta(min_length=2, max_length=3)]
"""In the plane forward and up, in space forward, to the left and up."""
Four = tuple[Degrees, Degrees, Degrees, Degrees]
Springs = tuple[NonNegative, NonNegative, NonNegative, NonNegative]
Nine = tuple[Real, Real, Real, Real, Real, Real, Real, Real, Real]
Six = tuple[Real, Real, Real, Real, Real, Real]
Seven = Annotated[tuple[Factor, ...], Meta(min_length=7, max_length=7)]


class Section(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A table of a scenario file."""
