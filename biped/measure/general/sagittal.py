"""A run of a robot of any kind as it is seen from its side: the quantities that curves and stick figures are drawn of.

Angles and signs are the thesis's; what a robot does not have is zero. Nothing is measured by this: it is for looking.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from biped.measure.contact import Strike, strikes_of
from biped.measure.general.gait import leans
from biped.measure.general.trajectory import GeneralTrajectory
from biped.robot.ground import LEVEL, Profile
from biped.robot.leg_states import FIRST_IN_AIR
from biped.robot.planar.topology import BASE, ENDS, LEGS, N_CONSTRAINTS, NQ, NU, SEGMENTS
from biped.scenario.robot import Appearance
from biped.scenario.section import LARGEST

_SWING = FIRST_IN_AIR + 1


class Side(NamedTuple):
    """A leg: its name, and its contact points'."""

    name: str
    points: tuple[str, ...]


class Seen(NamedTuple):
    """What is seen of a robot; attributes as of `biped.robot.planar.description.Robot`."""

    leg: tuple[Side, ...]
    shown: Appearance
    stops: tuple[str, ...] = ()

    @property
    def legs(self) -> tuple[str, ...]:
        """What people call the legs."""
        return tuple(leg.name for leg in self.leg)

    @property
    def points(self) -> tuple[str, ...]:
        """Toe and heel of each."""
        return tuple(point for leg in self.leg for point in leg.points)


class Body(NamedTuple):
    """Mass (1,) [kg], and length of a leg [m]."""

    mass: np.ndarray
    leg: float


@dataclass(frozen=True, eq=False)
class Sagittal:
    """What is seen of a run; attributes as of `biped.measure.trajectory.Trajectory`.

    Attributes:
        down: (n, 2) whether each foot is on the ground.
        com_velocity: (n, 2) [m/s] of the centre of mass.
        pushes: (start [s], end [s], force forward, to the left and up [N], body).
        own: (n, signals) what the law logged.
        place: (n, 12, 2) [m] hip, knee, ankle, toe, heel of each leg, the trunk's upper end, the centre of mass.
    """

    time: np.ndarray
    q: np.ndarray
    v: np.ndarray
    applied: np.ndarray
    phase: np.ndarray
    down: np.ndarray
    believed: np.ndarray
    active: np.ndarray
    force: np.ndarray
    place: np.ndarray
    com_velocity: np.ndarray
    own: np.ndarray
    tick: float
    slope: float
    generalized: bool
    torque_limit: tuple[float, ...]
    pushes: tuple[tuple[float, float, float, float, float, str], ...]
    end: str
    cause: str
    robot: Seen
    tree: Body
    signal_names: tuple[str, ...]
    inferred: None = None
    ground: Profile = LEVEL
    seat: None = None

    def __len__(self) -> int:
        return len(self.time)

    @property
    def strikes(self) -> list[Strike]:
        """Foot strikes (row, foot), in time order."""
        return strikes_of(self.down, self.tick)

    @property
    def flat(self) -> bool:
        """Whether the ground is level."""
        return self.slope == 0.0 and self.ground.level

    @property
    def x(self) -> np.ndarray:
        """(n,) [m] forward."""
        return self.q[:, 0]

    @property
    def sound(self) -> np.ndarray:
        """(n,) whether every number of a row is finite."""
        return np.array(np.isfinite(self.q).all(axis=1) & np.isfinite(self.applied).all(axis=1))

    @property
    def signals(self) -> dict[str, np.ndarray]:
        """What the law logged."""
        return {name: self.own[:, i] for i, name in enumerate(self.signal_names)}

    def rows(self, which: slice | np.ndarray, **changes: Any) -> Sagittal:
        """Some rows."""
        return replace(self, **{name: getattr(self, name)[which] for name in _ARRAYS}, **changes)


_ARRAYS = ("time", "q", "v", "applied", "phase", "down", "believed", "active", "force", "place", "com_velocity", "own")


def sagittal(t: GeneralTrajectory) -> Sagittal:
    """What is seen of a run from its side."""
    n, feet = len(t), t.robot.of_foot
    figure, place = t.figure[:, :, [0, 2]], np.empty((n, 12, 2))
    force, believed = np.zeros((n, LEGS, ENDS, 2)), np.zeros((n, LEGS, ENDS))
    for leg in range(LEGS):
        mine = np.flatnonzero(feet == leg)
        # Of the points of a foot the front half is its toe.
        along = np.array(t.robot.feet[leg].points)[:, 0]
        for end, half in enumerate((along >= along.mean(), along < along.mean())):
            some = mine[half]
            if not len(some):  # a foot of one point has no heel
                place[:, 5 * leg + 3 + end] = place[:, 5 * leg + 3]
                continue
            place[:, 5 * leg + 3 + end] = t.point[:, some][:, :, [0, 2]].mean(axis=1)
            force[:, leg, end] = t.force[:, some][:, :, [0, 2]].sum(axis=1)
            believed[:, leg, end] = t.contact[:, some].max(axis=1)
        place[:, 5 * leg : 5 * leg + 3] = figure[:, 3 * leg : 3 * leg + 3]
    place[:, 10], place[:, 11] = figure[:, 6], t.com[:, [0, 2]]
    q, applied = _angles(t, place), np.zeros((n, NQ))
    names: list[float] = [LARGEST] * NU
    for column, drive in _drives(t):
        applied[:, BASE + column] = t.robot.drives[drive].turns * t.u[:, drive]
        names[column] = t.torque_limit[drive]
    v = np.gradient(q, t.tick, axis=0) if n > 1 else np.zeros_like(q)
    return Sagittal(
        time=t.time, q=q, v=v, applied=applied, phase=_phases(t), down=t.down,
        believed=believed.reshape(n, -1), active=np.zeros((n, N_CONSTRAINTS)), force=force.reshape(n, -1, 2),
        place=place, com_velocity=t.com_velocity[:, [0, 2]],
        own=t.log[:, t.width :], tick=t.tick, slope=t.slope, generalized=t.generalized,
        torque_limit=tuple(limit if limit < LARGEST else math.inf for limit in names),
        pushes=t.pushes,
        end=t.end, cause=t.cause,
        robot=Seen(tuple(Side(leg, (f"{leg}_toe", f"{leg}_heel")) for leg in t.robot.legs), t.robot.shown),
        tree=Body(np.array([t.robot.mass]), t.robot.leg), signal_names=t.signal_names, ground=t.ground,
    )  # fmt: skip


def _phases(t: GeneralTrajectory) -> np.ndarray:
    """(n, 2) leg states that a law logged as its own, or whether a foot is on the ground."""
    names = [f"{leg}_state" for leg in t.robot.legs]
    if all(name in t.signal_names for name in names):
        return np.stack([t.signals[name] for name in names], axis=1)
    return np.where(t.down, 1.0, float(_SWING))


def _angles(t: GeneralTrajectory, place: np.ndarray) -> np.ndarray:
    """(n, 9) coordinates in the thesis's sense: of the base, then between trunk, thigh, shank and foot."""
    q = np.empty((len(t), NQ))
    q[:, 0], q[:, 1] = t.base[:, 0], t.base[:, 2]
    q[:, 2] = -leans(t) - math.radians(t.slope)
    for leg in range(LEGS):
        hip, knee, ankle, toe, heel = (place[:, 5 * leg + i] for i in range(5))
        thigh, shank = _slant(hip - knee), _slant(knee - ankle)
        foot = np.unwrap(np.arctan2((toe - heel)[:, 1], (toe - heel)[:, 0]))
        first = BASE + SEGMENTS * leg
        q[:, first] = thigh - q[:, 2]
        q[:, first + 1] = shank - thigh
        q[:, first + 2] = foot - shank
    return q


def _slant(along: np.ndarray) -> np.ndarray:
    """(n,) [rad] of vectors (n, 2) from upright, anticlockwise positive."""
    return np.unwrap(np.arctan2(-along[:, 0], along[:, 1]))


def _drives(t: GeneralTrajectory) -> list[tuple[int, int]]:
    """(number among the six joints, number of the drive) of those that drive hip, knee and ankle."""
    if t.generalized:
        return []
    found = []
    for leg, foot in enumerate(t.robot.feet):
        for i, name in enumerate(foot.pitching):
            found += [(SEGMENTS * leg + i, k) for k, drive in enumerate(t.robot.drives) if drive.joint == name]
    return found
