"""Fig 4.7: hip and knee swing freely, with the robot's gears and with high ones."""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from biped.dynamics import RK8, integrate
from biped.dynamics.bench.leg import STEP, Reading, in_mujoco, leg_of, relative
from biped.dynamics.mechanisms.leg import LINKS, NO_DRIVE, HangingLeg, hanging_leg

_HIP, _KNEE = 0, 1

SWING = 8.0
"""[s] of a free swing."""


class SwingingJoint(NamedTuple):
    """A joint of the leg that swings while others are held.

    Attributes:
        name: hip or knee.
        number: 0 or 1.
        locked: Joints that are held and their angles [rad].
        start: (3,) [rad] absolute angles of the links at the start.
    """

    name: str
    number: int
    locked: dict[int, float]
    start: tuple[float, float, float]


def joints(amplitude: float = math.radians(30.0)) -> tuple[SwingingJoint, SwingingJoint]:
    """The free swings of Fig 4.7: hip with a straight leg, knee with the thigh held horizontal.

    The knee's angle counts from its stop, the straight leg; the shank hangs at -90 degrees.
    """
    ahead = 0.5 * math.pi
    return (
        SwingingJoint("hip", _HIP, {1: 0.0, 2: 0.0}, (amplitude, amplitude, amplitude)),
        SwingingJoint("knee", _KNEE, {0: ahead, 2: 0.0}, (ahead, amplitude, amplitude)),
    )


@dataclass(frozen=True, eq=False)
class Swing:
    """A free swing.

    Attributes:
        joint: hip or knee.
        reading: Of the gear.
        period: [s] of small undamped swings, from the linearised equation of motion.
        damping_ratio: Of small swings.
        time: (n,) [s].
        angle: (n,) [rad] of the joint, in chapter II's solver.
        apart: [degrees] largest distance of MuJoCo's from it; nan with dry friction, which MuJoCo means otherwise.
    """

    joint: str
    reading: Reading
    period: float
    damping_ratio: float
    time: np.ndarray
    angle: np.ndarray
    apart: float


def small_swing(leg: HangingLeg, joint: SwingingJoint) -> tuple[float, float]:
    """Period [s] of small undamped swings of a joint about where it hangs, and their damping ratio."""
    free = hanging_leg(leg._replace(coulomb=np.zeros(LINKS)))
    moving = np.array([j >= joint.number for j in range(LINKS)], dtype=float)
    rest = _hanging(free, joint, moving)
    inertia = moving @ free.evaluate(0.0, rest, np.zeros(LINKS)).M @ moving
    step = 1e-4

    def force(q: np.ndarray, v: np.ndarray) -> float:
        return float(moving @ free.evaluate(0.0, q, v).Q)

    nothing = np.zeros(LINKS)
    stiffness = (force(rest - step * moving, nothing) - force(rest + step * moving, nothing)) / (2.0 * step)
    # Only the joint itself turns, so the damping of those beyond it has no say.
    rate = math.sqrt(stiffness / float(inertia))
    return 2.0 * math.pi / rate, float(leg.damping[joint.number]) / (2.0 * float(inertia) * rate)


def _hanging(free: Any, joint: SwingingJoint, moving: np.ndarray) -> np.ndarray:
    """Angles (3,) at which the links from the joint on hang still, those above as the joint's experiment holds them."""
    q = np.where(moving > 0.0, 0.0, joint.start)
    for _ in range(20):
        force = moving @ free.evaluate(0.0, q, np.zeros(LINKS)).Q
        slope = moving @ free.evaluate(0.0, q + 1e-6 * moving, np.zeros(LINKS)).Q - force
        q = q - moving * force * 1e-6 / slope
    return q


def swing(model: Path, joint: SwingingJoint, reading: Reading) -> Swing:
    """One free swing, in both."""
    leg = leg_of(model, reading)
    start = np.array(joint.start)
    out = integrate(
        hanging_leg(leg, NO_DRIVE, joint.locked), start, np.zeros(LINKS), duration=SWING, dt=STEP, scheme=RK8
    )
    angle = relative(out.q)[:, joint.number]
    apart = math.nan
    if not reading.coulomb:
        theirs = in_mujoco(model, leg, NO_DRIVE, joint.locked, start, SWING, STEP)
        apart = math.degrees(np.abs(theirs[:, joint.number] - angle).max())
    return Swing(joint.name, reading, *small_swing(leg, joint), out.t, angle, apart)
