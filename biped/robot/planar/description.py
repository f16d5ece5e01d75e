"""A planar biped as data: a TOML file beside its model file says which parts are which, and what is its own.

`models/human.xml` is described by `models/human.toml`. A model file without a description beside it has the parts and
names of the human's; so a variant of the human is a model file alone, and another robot is a model file and a
description. Names are in the canonical order of `biped.robot.planar.topology`; the model file may have another.
"""

from functools import lru_cache
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from msgspec import Meta, field

from biped.base.errors import InputError
from biped.base.files import description_of, label, read_toml
from biped.base.typed import Positive, Section
from biped.robot.planar.topology import BASE, ENDS, LEGS, SEGMENTS
from biped.scenario.robot import Appearance, Walked
from biped.scenario.valid import convert, known_keys

Name = Annotated[str, Meta(min_length=1)]
Base3 = Annotated[tuple[Name, ...], Meta(min_length=BASE, max_length=BASE)]
Segments = Annotated[tuple[Name, ...], Meta(min_length=SEGMENTS, max_length=SEGMENTS)]
Ends = Annotated[tuple[Name, ...], Meta(min_length=ENDS, max_length=ENDS)]

_KNEE = 1


class Torso(Section, frozen=True):
    """The link that moves freely in the plane.

    Attributes:
        link: Its body.
        joints: Joints along x, along z and about -y that carry it.
    """

    link: Name
    joints: Base3


class Leg(Section, frozen=True):
    """A leg of three links, from the torso outward.

    Attributes:
        name: What people call it, such as right.
        links: Bodies: thigh, shank, foot.
        joints: Joints: hip, knee, ankle.
        actuators: Motors of the same joints.
        points: Toe and heel: a site, a geom and a contact pair of each name.
        stops: Joints with a stop at zero, beyond which they do not extend: the knee.
    """

    name: Name
    links: Segments
    joints: Segments
    actuators: Segments
    points: Ends
    stops: tuple[Name, ...]


class ContactParts(Section, frozen=True):
    """How the feet meet the ground.

    Attributes:
        ground: The geom of the level plane.
        radius: [m] of the spheres that stand for toe and heel.
    """

    ground: Name = "ground"
    radius: Positive = 1e-6


class Motor(Section, frozen=True):
    """The actuators: one direct-current motor for all joints, with a gear of its own for each.

    Attributes:
        name: What they are.
        voltage: [V] of the supply.
        resistance: [Ω] of the winding.
        torque_constant: [N m/A].
        rated_torque: [N m] that the motor bears continuously.
        gears: Ratios of hip, knee and ankle.
        efficiency: Of a gear that is driven; back-driven it loses the same share.
        gear_rated: [N m] at a joint that the gear bears continuously.
        gear_peak: [N m] at a joint that it bears intermittently.
    """

    voltage: Positive
    resistance: Positive
    torque_constant: Positive
    rated_torque: Positive
    gears: Annotated[tuple[Positive, ...], Meta(min_length=SEGMENTS, max_length=SEGMENTS)]
    gear_rated: Positive
    gear_peak: Positive
    efficiency: Annotated[float, Meta(gt=0, le=1)] = 1.0
    name: str = ""

    @property
    def ratio(self) -> np.ndarray:
        """(6,) gear ratios, leg by leg."""
        return np.array(self.gears * LEGS)

    @property
    def stall(self) -> np.ndarray:
        """(6,) [N m] of the joints, held still at full voltage."""
        return self.efficiency * self.ratio * self.torque_constant * self.voltage / self.resistance

    @property
    def free(self) -> np.ndarray:
        """(6,) [rad/s] of the joints at full voltage without load."""
        return self.voltage / (self.torque_constant * self.ratio)

    @property
    def rated(self) -> np.ndarray:
        """(6,) [N m] that the joints bear continuously: motor and gear."""
        return np.minimum(self.efficiency * self.ratio * self.rated_torque, self.gear_rated)

    def current(self, u: np.ndarray, rate: np.ndarray) -> np.ndarray:
        """(…, 6) [A] for joint torques u (…, 6) [N m] at joint rates (…, 6) [rad/s]."""
        through = np.where(u * rate >= 0.0, 1.0 / self.efficiency, self.efficiency)
        return u * through / (self.ratio * self.torque_constant)


class PlanarParts(Section, frozen=True, kw_only=True):
    """The parts of a planar biped by the names that its model file has for them.

    Attributes:
        base: The torso.
        leg: The two legs; the first is the thesis's leg 1-3.
        contact: Ground and contact points.
    """

    base: Torso
    leg: Annotated[tuple[Leg, ...], Meta(min_length=LEGS, max_length=LEGS)]
    contact: ContactParts = ContactParts()

    @property
    def links(self) -> tuple[str, ...]:
        """The seven bodies in canonical order."""
        return (self.base.link, *(link for leg in self.leg for link in leg.links))

    @property
    def joints(self) -> tuple[str, ...]:
        """The nine joints in canonical order."""
        return (*self.base.joints, *(joint for leg in self.leg for joint in leg.joints))

    @property
    def actuators(self) -> tuple[str, ...]:
        """The six motors, in the order of the joints they drive."""
        return tuple(actuator for leg in self.leg for actuator in leg.actuators)

    @property
    def points(self) -> tuple[str, ...]:
        """The four contact points in canonical order."""
        return tuple(point for leg in self.leg for point in leg.points)

    @property
    def stops(self) -> tuple[str, ...]:
        """The joints with a stop, leg by leg."""
        return tuple(stop for leg in self.leg for stop in leg.stops)

    @property
    def legs(self) -> tuple[str, ...]:
        """Names of the legs, as people call them."""
        return tuple(leg.name for leg in self.leg)


class PlanarDescription(PlanarParts, frozen=True, kw_only=True):
    """The description beside the model file of a planar biped.

    Attributes:
        description: One line for people.
        walked: What counts as walking.
        shown: The camera.
        motor: Its actuators; default: whatever gives the torques that are asked for.
        scenario: Keys of a scenario and their values where a scenario of this robot does not say.
    """

    walked: Walked
    shown: Appearance
    description: str = ""
    motor: Motor | None = None
    scenario: dict[str, Any] = field(default_factory=dict)


def description_at(model: Path) -> PlanarDescription:
    """The description of the planar biped in a model file.

    Raises:
        InputError: It cannot be read, lacks a part, or names a part twice.
    """
    path = description_of(model)
    return _read(str(path), path.stat().st_mtime)


def version_of(model: Path) -> tuple[str, float, float]:
    """A model file as it is now: its name, when it was changed [s], and when its description was."""
    return str(model), model.stat().st_mtime, description_of(model).stat().st_mtime


@lru_cache(maxsize=8)
def _read(file: str, modified: float) -> PlanarDescription:
    path = Path(file)

    def fail(key: str, what: str) -> InputError:
        return InputError(f"{label(path)}: {key}: {what}")

    data = read_toml(path)
    known_keys({key: value for key, value in data.items() if key != "scenario"}, PlanarDescription, "", fail)
    robot = convert(data, PlanarDescription, fail)
    for i, leg in enumerate(robot.leg):
        if leg.stops != (leg.joints[_KNEE],):
            raise fail(f"leg[{i}].stops", f"expected the knee, ['{leg.joints[_KNEE]}'], got {list(leg.stops)}")
    for key in ("links", "joints", "actuators", "points", "legs"):
        names = getattr(robot, key)
        twice = [name for name in names if names.count(name) > 1]
        if twice:
            raise fail("leg", f"expected different names of {key}, got '{twice[0]}' twice")
    return robot
