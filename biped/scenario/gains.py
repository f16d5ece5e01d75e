"""The gains of a gait, in the thesis's symbols."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import msgspec

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


def single(names: Sequence[str] = GAINS) -> list[str]:
    """Names of single numbers: a gain with a value for each leg state is four of them, `k_d2.0` the first."""
    four = [name for name, kind in Gains.__annotations__.items() if kind.startswith(("Springs", "Four"))]
    return [each for name in names for each in ([f"{name}.{i}" for i in range(4)] if name in four else [name])]


def number(gains: Gains, name: str) -> float:
    """A single number of a complete gait."""
    whole, _, state = name.partition(".")
    value = getattr(gains, whole)
    return value[int(state)] if state else value


def with_numbers(gains: Gains, numbers: Mapping[str, float]) -> Gains:
    """A complete gait with some of its single numbers replaced."""
    values: dict[str, Any] = {
        name: list(value) if isinstance(value := getattr(gains, name), tuple) else value for name in GAINS
    }
    for name, value in numbers.items():
        whole, _, state = name.partition(".")
        if state:
            values[whole][int(state)] = value
        else:
            values[whole] = value
    return msgspec.convert(values, Gains)
