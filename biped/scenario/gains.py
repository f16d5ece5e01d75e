"""The gains of a gait, in the thesis's symbols."""

from __future__ import annotations

from biped.scenario.section import Degrees, Four, NonNegative, Positive, Section, Springs


class Gains(Section, frozen=True):
    """Gains that replace those of the controller file; same keys.

    Attributes:
        k_d1: [N m/rad] of the torso's spring.
        k_d2: [N m/rad] of the thighs' springs in leg states 1 to 4.
        k_d3: The same of the knees.
        k_d4: The same of the ankles.
        b_d1: [N m s/rad] of the torso's damper.
        b_d2: [N m s/rad] of the thighs' dampers in leg states 1 to 4.
        b_d3: The same of the knees.
        b_d4: The same of the ankles.
        theta_b: Degrees, where the torso's spring is at rest.
        theta_l: Degrees, where the thighs' springs are at rest in leg states 1 to 4.
        theta_a: Degrees, where the ankles' springs are at rest in leg states 1 to 4.
        speed: [m/s] of a gait file that is a family; its gains at that speed come first, the other keys replace them.
    """

    k_d1: NonNegative | None = None
    k_d2: Springs | None = None
    k_d3: Springs | None = None
    k_d4: Springs | None = None
    b_d1: NonNegative | None = None
    b_d2: Springs | None = None
    b_d3: Springs | None = None
    b_d4: Springs | None = None
    theta_b: Degrees | None = None
    theta_l: Four | None = None
    theta_a: Four | None = None
    speed: Positive | None = None

    def replaced(self, by: Gains) -> Gains:
        """These gains, without a speed, with those that `by` names in their place."""
        return Gains(**{n: getattr(self, n) if (new := getattr(by, n)) is None else new for n in GAINS})


GAINS = tuple(name for name in Gains.__struct_fields__ if name != "speed")
"""What a complete gait consists of."""
