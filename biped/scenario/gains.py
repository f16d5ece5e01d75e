"""The gains of a gait, in the thesis's symbols."""

from __future__ import annotations

from biped.scenario.section import NonNegative, Positive, Section


class Gains(Section, frozen=True):
    """Gains that replace those of the controller file; same keys.

    Attributes:
        speed: [m/s] of a gait file that is a family; its gains at that speed come first, the other keys replace them.
    """

    k_d1: NonNegative | None = None
    k_d2: tuple[NonNegative, NonNegative, NonNegative, NonNegative] | None = None
    k_d3: tuple[NonNegative, NonNegative, NonNegative, NonNegative] | None = None
    k_d4: tuple[NonNegative, NonNegative, NonNegative, NonNegative] | None = None
    b_d1: NonNegative | None = None
    b_d2: tuple[NonNegative, NonNegative, NonNegative, NonNegative] | None = None
    b_d3: tuple[NonNegative, NonNegative, NonNegative, NonNegative] | None = None
    b_d4: tuple[NonNegative, NonNegative, NonNegative, NonNegative] | None = None
    theta_b: float | None = None
    theta_l: tuple[float, float, float, float] | None = None
    theta_a: tuple[float, float, float, float] | None = None
    speed: Positive | None = None

    def replaced(self, by: Gains) -> Gains:
        """These gains, without a speed, with those that `by` names in their place."""
        return Gains(**{n: getattr(self, n) if (new := getattr(by, n)) is None else new for n in GAINS})


GAINS = tuple(name for name in Gains.__struct_fields__ if name != "speed")
"""What a complete gait consists of."""
