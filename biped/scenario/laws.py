"""Laws for any robot that a scenario asks for by name."""

from __future__ import annotations

from typing import NamedTuple


class BuiltIn(NamedTuple):
    """A law of this package.

    Attributes:
        place: `module:Class`, imported where it is used.
        meaning: In one line.
        thesis: Whether it takes the keys of the thesis's law: a gait file, `[sensing]`, `[actuation]`.
    """

    place: str
    meaning: str
    thesis: bool = False


BUILT_IN: dict[str, BuiltIn] = {
    "stand": BuiltIn("biped.control.general.stand:Stand", "stands, and balances what pushes it"),
}


def own_law(law: str | None) -> bool:
    """Whether a scenario's law is its user's own, which runs only if it is trusted."""
    return law is not None and law not in BUILT_IN
