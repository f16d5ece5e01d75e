"""The ground's frame with gravity in it, and its height along the way: level, tiles of unequal height, steps.

Both engines, the controller's sensors and what is measured read the same line with corners, and no vertical faces.
Under each point the ground is the straight piece below it: its height, and its normal, which both change from one piece
to the next at a corner. Coordinates are those of the slope, x along it and z normal to it.
"""

import math
from typing import Any, NamedTuple

import numpy as np
from msgspec import structs

from biped.base.errors import InputError
from biped.base.jit import kernel
from biped.scenario.vary import stream
from biped.scenario.world import Ground, Seat, Steps, Tiles

KNOTS = 1024
"""Most corners of a ground: `biped.scenario.keys` bounds the numbers of tiles and steps."""

SEAT_WIDTH = 0.25
"""[m] half of it, across the way; nothing depends on it but what is seen."""

GROUND = np.dtype([("count", "i8"), ("x", "f8", KNOTS), ("z", "f8", KNOTS)], align=True)
"""`Profile` as kernels read it; without corners the ground is level."""


class Profile(NamedTuple):
    """A ground's corners; before the first and beyond the last it is level.

    Attributes:
        x: (m,) [m] along the way, increasing; empty where all of it is level.
        z: (m,) [m] heights.
    """

    x: np.ndarray
    z: np.ndarray

    @property
    def level(self) -> bool:
        """Whether there is no height but 0."""
        return not len(self.x)

    def height(self, x: np.ndarray) -> np.ndarray:
        """Heights [m] of the ground at places x [m] of any shape."""
        return np.zeros(np.shape(x)) if self.level else np.interp(x, self.x, self.z)

    def rise(self, x: np.ndarray) -> np.ndarray:
        """dz/dx of the pieces at places x [m] of any shape; at a corner, of the piece that begins there."""
        if self.level:
            return np.zeros(np.shape(x))
        rises = np.concatenate([[0.0], np.diff(self.z) / np.diff(self.x), [0.0]])
        return rises[np.searchsorted(self.x, x, side="right")]

    @property
    def as_dict(self) -> dict[str, list[list[float]]]:
        """The corners as files hold them, which `profile_from` reads back; empty for level ground."""
        return {} if self.level else {"ground": [self.x.tolist(), self.z.tolist()]}

    def between(self, low: float, high: float) -> tuple[np.ndarray, np.ndarray]:
        """Places and heights [m] of the ground from one place to another, with all corners between: what is drawn."""
        inside = (self.x > low) & (self.x < high)
        x = np.concatenate([[low], self.x[inside], [high]])
        return x, self.height(x)


class Slabs(NamedTuple):
    """Straight pieces of the ground, as pictures lay them.

    Attributes:
        middle: (k, 2) [m] of their upper sides.
        length: (k,) [m].
        angle: (k,) [rad] by which they rise.
        odd: (k,) whether in the second of two lengths of the way, so that they can be told apart.
    """

    middle: np.ndarray
    length: np.ndarray
    angle: np.ndarray
    odd: np.ndarray


def slabs(profile: Profile, first: int, last: int, each: float) -> Slabs:
    """The ground from `first` to `last` times a length `each` [m], cut there and at its corners."""
    marks = each * np.arange(first, last + 1)
    x = np.union1d(marks, profile.between(marks[0], marks[-1])[0])
    x = x[np.append(True, np.diff(x) > 1e-9)]
    z = profile.height(x)
    dx, dz = np.diff(x), np.diff(z)
    middle = np.stack([0.5 * (x[1:] + x[:-1]), 0.5 * (z[1:] + z[:-1])], axis=1)
    odd = np.floor(middle[:, 0] / each).astype(int) % 2 == 1
    return Slabs(middle, np.hypot(dx, dz), np.arctan2(dz, dx), odd)


def box_of(seat: Seat) -> tuple[np.ndarray, np.ndarray]:
    """Middle (3,) and half sides (3,) [m] of a seat's box."""
    half = np.array([0.5 * seat.depth, SEAT_WIDTH, 0.5 * seat.height])
    return np.array([seat.front - half[0], 0.0, half[2]]), half


LEVEL = Profile(np.empty(0), np.empty(0))


def is_level(ground: Ground) -> bool:
    """Whether a scenario's ground has no height but 0."""
    return ground.tiles.height == 0.0 and ground.steps.rise == 0.0


def levelled(ground: Ground) -> Ground:
    """The same ground without heights along the way."""
    return structs.replace(ground, tiles=Tiles(), steps=Steps())


def first_of(ground: Ground) -> str:
    """Which begins first on a ground that is not level: `tiles` or `steps`."""
    tiles, steps = ground.tiles, ground.steps
    return "tiles" if tiles.height > 0.0 and (steps.rise == 0.0 or tiles.start <= steps.start) else "steps"


def begin_beyond(ground: Ground, profile: Profile, foremost: float) -> None:
    """Makes sure that a robot starts on the level, which the first tile or step of a ground lies beyond.

    Args:
        ground: Of the scenario, not level.
        profile: Its line.
        foremost: [m] where the foremost point of the feet stands.

    Raises:
        InputError: It does not.
    """
    if profile.x[0] <= foremost:
        which = first_of(ground)
        raise InputError(
            f"ground.{which}.start: expected a place beyond the feet, the foremost point of which stands at "
            f"{foremost:.3f} m, got {profile.x[0]:g}", f"ground.{which}.start",
        )  # fmt: skip


def profile_of(ground: Ground, seed: int) -> Profile:
    """The line of a run's ground: tiles and steps add up.

    Args:
        ground: The scenario's.
        seed: The run's, from which the heights of tiles are drawn: twice the `height` is twice the same heights.
    """
    parts = []
    if ground.tiles.height > 0.0:
        parts.append(_tiles(ground.tiles, seed))
    if ground.steps.rise != 0.0:
        parts.append(_steps(ground.steps))
    if not parts:
        return LEVEL
    x = np.unique(np.concatenate([part.x for part in parts]))
    return Profile(x, np.sum([part.height(x) for part in parts], axis=0))


def _tiles(tiles: Tiles, seed: int) -> Profile:
    heights = tiles.height * stream(seed, "ground.tiles").uniform(-1.0, 1.0, tiles.number)
    return _stairs(tiles.start + tiles.length * np.arange(tiles.number + 1), np.append(heights, 0.0), tiles.ramp)


def _steps(steps: Steps) -> Profile:
    rises = np.full(steps.number, steps.rise)
    if steps.back:
        rises = np.concatenate([rises, -rises])
    return _stairs(steps.start + steps.run * np.arange(len(rises)), np.cumsum(rises), steps.ramp)


def _stairs(x: np.ndarray, z: np.ndarray, ramp: float) -> Profile:
    """Level pieces of heights z (m,), each reached from the one before by a ramp that begins at x (m,)."""
    before = np.append(0.0, z[:-1])
    return Profile(np.stack([x, x + ramp], axis=1).ravel(), np.stack([before, z], axis=1).ravel())


def profile_from(kept: Any) -> Profile:
    """A profile that was kept as two lists; level ground was not.

    Raises:
        ValueError: They are none of a ground.
    """
    if kept is None:
        return LEVEL
    x, z = (np.array(values, dtype=float) for values in kept)
    if not (x.ndim == 1 and x.shape == z.shape and 0 < len(x) <= KNOTS and np.isfinite([x, z]).all()
            and (np.diff(x) > 0.0).all()):  # fmt: skip
        raise ValueError("a ground without corners in order")
    return Profile(x, z)


def set_ground(record: np.void, profile: Profile) -> None:
    """Writes a profile into a record of `GROUND`."""
    record["count"] = len(profile.x)
    record["x"][: len(profile.x)], record["z"][: len(profile.x)] = profile.x, profile.z


@kernel
def piece_below(ground, x):
    """Number of the last corner at or before x [m]; -1 before the first."""
    low, high = -1, ground["count"]
    while high - low > 1:
        middle = (low + high) // 2
        if ground["x"][middle] <= x:
            low = middle
        else:
            high = middle
    return low


@kernel
def height_below(ground, x):
    """Height [m] of the ground at x [m]."""
    if ground["count"] == 0:
        return 0.0
    i = piece_below(ground, x)
    if i < 0:
        return ground["z"][0]
    return ground["z"][i] + rise_of(ground, i) * (x - ground["x"][i])


@kernel
def rise_of(ground, i):
    """dz/dx of the piece that begins at corner i, or before the first (-1)."""
    if i < 0 or i >= ground["count"] - 1:
        return 0.0
    return (ground["z"][i + 1] - ground["z"][i]) / (ground["x"][i + 1] - ground["x"][i])


GRAVITY = 9.81
"""[m/s²]"""


def gravity(slope: float) -> tuple[float, float]:
    """Gravity in the frame of a slope, in the plane.

    Args:
        slope: [degrees] by which the ground rises forward.

    Returns:
        Its parts along the ground and out of it [m/s²].
    """
    return -GRAVITY * math.sin(math.radians(slope)), -GRAVITY * math.cos(math.radians(slope))


def frame(slope: float, side_slope: float) -> np.ndarray:
    """(3, 3) from the world, whose z is up, to the ground's frame: rows are its axes; angles in degrees.

    The ground rises by tan(slope) forward and by tan(side_slope) to the left; its x is the steepest part of forward.
    """
    forward = np.array([math.cos(math.radians(slope)), 0.0, math.sin(math.radians(slope))])
    normal = np.array([-math.tan(math.radians(slope)), -math.tan(math.radians(side_slope)), 1.0])
    normal /= np.linalg.norm(normal)
    return np.array([forward, np.cross(normal, forward), normal])


def gravity3(slope: float, side_slope: float) -> np.ndarray:
    """(3,) gravity [m/s²] in the ground's frame; angles in degrees."""
    return frame(slope, side_slope) @ np.array([0.0, 0.0, -GRAVITY])
