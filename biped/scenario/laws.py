"""Laws for any robot that a scenario asks for by name."""

from typing import NamedTuple

Keys = dict[str, tuple[str, ...]]
"""Keys of a scenario by table; "" is the scenario itself."""


class BuiltIn(NamedTuple):
    """A law of this package.

    Attributes:
        place: `module:Class`, imported where it is used.
        meaning: In one line.
        reads: Keys that it takes notice of besides those that hold whatever the law is (`biped.scenario.noticed`).
    """

    place: str
    meaning: str
    reads: Keys


_SPATIAL: Keys = {
    "": ("controller", "gains", "change"),
    "ground": ("angles",),
    "sensing": (
        "contact_height",
        "heel_on",
        "heel_off",
        "toe_on",
        "toe_off",
        "extended",
        "ahead",
        "late_stance",
        "passing",
    ),
    "actuation": ("mode", "assist", "contacts", "pushing"),
}

SPATIAL = "spatial"
BUILT_IN: dict[str, BuiltIn] = {
    SPATIAL: BuiltIn("biped.control.space.law:Spatial", "the thesis's law for a biped in space", _SPATIAL),
    "stand": BuiltIn("biped.control.stand:stand", "stands, and balances what pushes it", {}),
}


CARD = ".toml"
"""End of the name of a policy's card."""


def is_card(law: str | None) -> bool:
    """Whether a law is a policy's card."""
    return law is not None and law.endswith(CARD)


def own_law(law: str | None) -> bool:
    """Whether a scenario's law is its user's own, which runs only if it is trusted."""
    return law is not None and law not in BUILT_IN
