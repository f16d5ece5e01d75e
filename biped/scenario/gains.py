"""The gains of a gait, in the thesis's symbols."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Literal

import msgspec

from biped.base.typed import Degrees, Four, NonNegative, Positive, Real, Section, Springs, convert


class PartialGains(Section, frozen=True):
    """Gains of which some may be missing."""

    def replaced(self, by: Any) -> Any:
        """These gains with those that `by`, of the same kind, names in their place."""
        return type(self)(**{name: _replaced(getattr(self, name), getattr(by, name)) for name in self._names()})

    def missing(self) -> list[str]:
        """Names of those that are not there."""
        out = []
        for name in (name for name in self._names() if name not in self.may_lack()):
            value = getattr(self, name)
            out += [name] if value is None else []
            out += [f"{name}.{inner}" for inner in value.missing()] if isinstance(value, PartialGains) else []
        return out

    @classmethod
    def _names(cls) -> tuple[str, ...]:
        return cls.__struct_fields__

    @classmethod
    def may_lack(cls) -> tuple[str, ...]:
        """Names of those without which it is complete."""
        return ()


def _replaced(old: Any, new: Any) -> Any:
    if new is None or old is None:
        return old if new is None else new
    return old.replaced(new) if isinstance(old, PartialGains) else new


class Placement(PartialGains, frozen=True, omit_defaults=True):
    """Where a swinging foot goes sideways: abduction by c_v v_y + c_d (y - half the distance of the hips).

    v_y is the velocity of the centre of mass and y its distance from the stance foot, both towards the swinging leg.
    A walker that falls over its stance foot is to step across it. Legs collide, so the swinging foot passes first.

    Attributes:
        position: c_d [rad/m].
        velocity: c_v [rad s/m].
        apart: [m] A swinging foot that is not yet ahead of the other by `crossing` is kept so far to its own side of
            it; default: 0, at which it goes where it is placed at once.
        crossing: [m] Default: 0.
        shorten: [rad/rad²] The thigh of a leg in the air is flexed less by so much times the square of the abduction,
            so that a foot that goes far to a side lands sooner; default: 0.
        push: c_p [rad s²/m] While something pushes the walker to the side of its swinging foot, the foot goes further
            outward by so much times the acceleration that the push causes. Of the walker's acceleration, it is what
            gravity and the ground forces of the law do not explain, so it needs joint torques; default: 0.
    """

    position: Real | None = None
    velocity: Real | None = None
    apart: NonNegative | None = None
    crossing: Real | None = None
    shorten: NonNegative | None = None
    push: NonNegative | None = None

    @classmethod
    def may_lack(cls) -> tuple[str, ...]:
        """Without them legs are not kept from each other, and a push counts by the speed that it has caused alone."""
        return "apart", "crossing", "shorten", "push"


class Pace(PartialGains, frozen=True, omit_defaults=True):
    """How legs follow the walker's speed v forward, a thigh being flexed further by so much times v - v0, and slopes.

    A walker that is too fast puts its swinging foot further forward, and its standing leg pushes less. Where it goes
    down it is to be faster: v0 = `speed` - `slope` α on ground that rises by α ahead. What it makes of slopes, it does
    if `ground.angles` is gravity.

    Attributes:
        speed: [m/s] at which nothing changes on the level.
        slope: [m/s per rad] by which that is less uphill and more downhill.
        side: [rad/rad] A leg in the air is abducted by so much times the angle by which the ground rises on its side; 0
            of a biped that moves in the plane.
        swing: [rad s/m] of a leg in the air (leg states 3 and 4).
        stance: [rad s/m] of a leg on the ground (1 and 2).
        lean: [rad/rad] The torso leans forward by so much times the angle by which the ground rises ahead; default: 0.
            Downhill it does not lean back.
        knee: [N m s²/m²] The knee of a leg in the air is straightened by so much times (v - v0)² where v is more than
            v0; default: 0.
        ankle: [N m s²/m²] The ankle of a leg that pushes off (2) is extended by so much times (v - v0)² (1 + v/v0) more
            where v is between -v0 and v0; default: 0.
    """

    speed: Real | None = None
    slope: Real | None = None
    side: Real | None = None
    swing: Real | None = None
    stance: Real | None = None
    lean: Real | None = None
    knee: NonNegative | None = None
    ankle: NonNegative | None = None

    @classmethod
    def may_lack(cls) -> tuple[str, ...]:
        """Without them the torso does not know slopes, and knees and ankles no speed."""
        return "lean", "knee", "ankle"


class Frontal(PartialGains, frozen=True):
    """Gains across the direction of walking: the same symbols for roll, abduction and inversion, outward positive.

    Attributes:
        k_d1: [N m/rad] of the torso's spring (roll).
        k_d2: [N m/rad] of the thighs' springs (abduction) in leg states 1 to 4.
        k_d4: The same of the feet's inversion.
        b_d1: [N m s/rad] of the torso's damper.
        b_d2: [N m s/rad] of the thighs' dampers in leg states 1 to 4.
        b_d4: The same of the feet's.
        theta_l: Degrees of abduction at which the thighs' springs are at rest in leg states 1 to 4.
        theta_a: Degrees of inversion, likewise.
        placement: How the abduction of a swinging leg follows the walker's motion.
    """

    k_d1: NonNegative | None = None
    k_d2: Springs | None = None
    k_d4: Springs | None = None
    b_d1: NonNegative | None = None
    b_d2: Springs | None = None
    b_d4: Springs | None = None
    theta_l: Four | None = None
    theta_a: Four | None = None
    placement: Placement | None = None


class Axial(PartialGains, frozen=True):
    """Gains about the links' own axes: the same symbols for the torso's yaw and the thighs' rotation, outward positive.

    Attributes:
        k_d1: [N m/rad] of the torso's spring (yaw).
        k_d2: [N m/rad] of the thighs' springs (rotation) in leg states 1 to 4.
        b_d1: [N m s/rad] of the torso's damper.
        b_d2: [N m s/rad] of the thighs' dampers in leg states 1 to 4.
        theta_b: Degrees to the left that the walker heads: the inertial frame's x axis.
        theta_l: Degrees of rotation at which the thighs' springs are at rest in leg states 1 to 4.
    """

    k_d1: NonNegative | None = None
    k_d2: Springs | None = None
    b_d1: NonNegative | None = None
    b_d2: Springs | None = None
    theta_b: Degrees | None = None
    theta_l: Four | None = None


class Gains(PartialGains, frozen=True):
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
        theta_k: Degrees, where the knees' springs are at rest in leg states 1 to 4, negative flexed; default: straight.
        unit: `mgl` counts in the walker's weight, the length of its leg, and √(l/g) (docs/any-biped.md); default: SI.
        speed: [m/s] of a gait file that is a family; its gains at that speed come first, the other keys replace them.
        pace: How thighs follow the walker's speed; default: not.
        frontal: Of a biped that moves in space: across the direction of walking.
        axial: Likewise: about the links' own axes.
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
    theta_k: Four | None = None
    unit: Literal["mgl"] | None = None
    speed: Positive | None = None
    pace: Pace | None = None
    frontal: Frontal | None = None
    axial: Axial | None = None

    def replaced(self, by: Any) -> Gains:
        """These gains, without a speed, with those that `by` names in their place."""
        return msgspec.structs.replace(super().replaced(by), speed=None)


OUT_OF_PLANE = ("frontal", "axial")
"""Tables that the gait of a biped in space has besides."""

KNEES = "theta_k"
"""Rest angles that a gait may lack: then its knees are straight."""
STRAIGHT = (0.0, 0.0, 0.0, 0.0)
PACE = "pace"
"""A table that a gait may lack: then its thighs do not follow the walker's speed."""


class LackedGains(PartialGains, frozen=True, omit_defaults=True):
    """Gains that a gait may lack.

    Attributes:
        theta_k: Degrees, where the knees' springs are at rest in leg states 1 to 4.
        pace: How thighs follow the walker's speed.
    """

    theta_k: Four | None = None
    pace: Pace | None = None


LACKED = LackedGains.__struct_fields__
"""Gains that vary in a search if a gait has them."""
NOT_NEEDED = (*LACKED, "unit")
"""Gains that a gait may have; a unit only that of a biped in space."""
MGL = "mgl"
"""The unit of gaits that count in their walker's own weight and size."""

GAINS = tuple(name for name in Gains.__struct_fields__ if name not in ("speed", *NOT_NEEDED, *OUT_OF_PLANE))
"""Tables of a complete gait in the plane."""


def single(names: Sequence[str] = GAINS) -> list[str]:
    """Names of single numbers: a gain with a value for each leg state is four of them, `k_d2.0` the first.

    Args:
        names: Of gains, tables or single numbers: `k_d2`, `frontal`, `frontal.placement.velocity`, `axial.k_d2.0`.
    """
    return [each for name in names for each in _single(Gains, "", name)]


def _single(kind: type[PartialGains], at: str, name: str) -> Iterator[str]:
    whole, _, rest = name.partition(".")
    if whole not in kind.__struct_fields__:
        return
    said = kind.__annotations__[whole].split(" | ")[0]
    if said in ("Springs", "Four"):
        yield from ([f"{at}{name}"] if rest else [f"{at}{whole}.{i}" for i in range(4)])
    elif (inner := _PARTS.get(said)) is not None:
        for each in [rest] if rest else inner.__struct_fields__:
            yield from _single(inner, f"{at}{whole}.", each)
    else:
        yield f"{at}{name}"


_PARTS: dict[str, type[PartialGains]] = {kind.__name__: kind for kind in (Placement, Pace, Frontal, Axial)}


def number(gains: Gains, name: str) -> float:
    """A single number of a complete gait."""
    value: Any = gains
    for part in name.split("."):
        value = value[int(part)] if part.isdigit() else getattr(value, part)
    return value


def with_numbers(gains: Gains, numbers: Mapping[str, float]) -> Gains:
    """A complete gait with some of its single numbers replaced."""
    values: dict[str, Any] = msgspec.to_builtins(gains)
    for name, value in numbers.items():
        *way, last = name.split(".")
        table: Any = values
        for part in way:
            table[part] = list(table[part]) if isinstance(table[part], tuple) else table[part]
            table = table[part]
        table[int(last) if last.isdigit() else last] = value
    return convert(values, Gains)
