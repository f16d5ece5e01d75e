"""What every table of a scenario file is made of."""

from __future__ import annotations

from typing import Annotated

from msgspec import Meta, Struct

Positive = Annotated[float, Meta(gt=0)]
NonNegative = Annotated[float, Meta(ge=0)]
Vector = tuple[float, float]
Nine = tuple[float, float, float, float, float, float, float, float, float]
Six = tuple[float, float, float, float, float, float]
Seven = Annotated[tuple[Positive, ...], Meta(min_length=7, max_length=7)]


class Section(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A table of a scenario file."""
