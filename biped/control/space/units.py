"""Gaits in units of the walker itself: `unit = "mgl"` counts in its weight, the length of its leg, and √(l/g).

Springs are in m g l, dampers in m g l √(l/g), placement in 1/l and 1/√(g l); of what joint torques take the ground for,
lengths are in l, times in √(l/g), accelerations in g and the price of torques in 1/(m l²). Angles are as they are.
"""

import math
from typing import Any, NamedTuple

from msgspec.structs import replace

from biped.robot.anatomy import Anatomy
from biped.robot.gravity import GRAVITY
from biped.robot.robot import Robot
from biped.scenario.devices import Pushing
from biped.scenario.gains import MGL, Axial, Frontal, Gains


class Unit(NamedTuple):
    """The unit that a walker's numbers are counted in.

    Attributes:
        mass: [kg] of it.
        length: [m] of its leg.
    """

    mass: float
    length: float

    @property
    def time(self) -> float:
        """[s] √(l/g)."""
        return math.sqrt(self.length / GRAVITY)

    @property
    def moment(self) -> float:
        """[N m] m g l."""
        return self.mass * GRAVITY * self.length

    @property
    def inertia(self) -> float:
        """[kg m²] m l²."""
        return self.mass * self.length**2

    @property
    def acceleration(self) -> float:
        """[m/s²] g."""
        return GRAVITY


def unit_of(robot: Robot, anatomy: Anatomy) -> Unit:
    """The unit of a walker."""
    return Unit(robot.mass, anatomy.leg)


def si_gains(gains: Gains, unit: Unit) -> Gains:
    """A complete gait in SI units, whatever it is in."""
    if gains.unit != MGL:
        return gains
    frontal: Any = _parts(gains.frontal, unit) if gains.frontal else None
    if frontal is not None and (placement := frontal.placement) is not None:
        frontal = replace(frontal, placement=replace(
            placement, position=_times(placement.position, unit.length**-1),
            velocity=_times(placement.velocity, unit.time / unit.length),
        ))  # fmt: skip
    axial: Any = _parts(gains.axial, unit) if gains.axial else None
    return replace(_parts(gains, unit), frontal=frontal, axial=axial, unit=None)


def si_pushing(pushing: Pushing, gains: Gains, unit: Unit) -> Pushing:
    """Settings of ground that only pushes in SI units; they are in those of the gait."""
    if gains.unit != MGL:
        return pushing
    return replace(
        pushing, approach=pushing.approach * unit.time, reach=pushing.reach * unit.length,
        yielding=pushing.yielding * unit.acceleration, regularisation=pushing.regularisation / unit.inertia,
        smoothing=pushing.smoothing * unit.time,
    )  # fmt: skip


def _parts(part: Gains | Frontal | Axial, unit: Unit) -> Any:
    """A table of gains with its springs and dampers times their units."""
    factors = {"k_": unit.moment, "b_": unit.moment * unit.time}
    changed = {name: _times(getattr(part, name), factors[name[:2]])
               for name in part.__struct_fields__ if name[:2] in factors}  # fmt: skip
    return replace(part, **changed)


def _times(value: Any, factor: float) -> Any:
    if value is None:
        return None
    return tuple(one * factor for one in value) if isinstance(value, tuple) else value * factor
