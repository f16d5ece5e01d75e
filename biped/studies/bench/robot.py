"""`biped bench robot`: the bench experiments of chapter IV, in chapter II's solver and in MuJoCo.

A leg hangs from a torso that is held still. Fig 4.7: hip and knee swing freely, with the robot's gears and with high
ones. Fig 4.8: spring-dampers at hip, knee and ankle follow equilibria that move.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from biped.base.files import folder
from biped.dynamics import RK8, integrate
from biped.dynamics.mechanisms.leg import LINKS, NO_DRIVE, Drive, Leg, hanging_leg
from biped.robot.model import tree_at
from biped.robot.topology import FOOT, SHANK, THIGH
from biped.robot.tree import Tree

GEARS = (21.0, 12.0, 21.0)
"""Of hip, knee and ankle (Table 4.1)."""
HIGH = (105.0, 60.0, 105.0)
"""The usual highly geared joints of Fig 4.7, dotted."""
FRICTION = 4.1e-3
"""[N m] of the motor's brushes and bearings: its no-load current of 0.137 A times 30.2 mN m/A."""

_HIP, _KNEE = 0, 1
STEP = 1.0 / 600.0
"""[s] between samples, of which the periods of Fig 4.8 are whole numbers."""
SWING = 8.0
"""[s] of a free swing."""
PERIOD = 4.0 / 3.0
"""[s] in which all three references of Fig 4.8 repeat."""

FIG_4_8 = Drive(
    K=np.array([2.0, 1.5, 1.0]),
    B=np.array([0.2, 0.2, 0.1]),
    amplitude=np.pi * np.array([1 / 3, 1 / 6, 1 / 6]),
    frequency=np.pi * np.array([1.5, 3.0, 6.0]),
    phase=np.array([0.0, -0.5 * np.pi, 0.0]),
    mean=np.pi * np.array([1 / 20, -1 / 2, 1 / 6]),
)
"""Gains and references of the figure's caption."""


class Joint(NamedTuple):
    """Whose swing is shown.

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


def joints(amplitude: float = math.radians(30.0)) -> tuple[Joint, Joint]:
    """The free swings of Fig 4.7: hip with a straight leg, knee with the thigh held horizontal.

    The knee's angle counts from its stop, the straight leg; the shank hangs at -90 degrees.
    """
    ahead = 0.5 * math.pi
    return (
        Joint("hip", _HIP, {1: 0.0, 2: 0.0}, (amplitude, amplitude, amplitude)),
        Joint("knee", _KNEE, {0: ahead, 2: 0.0}, (ahead, amplitude, amplitude)),
    )


class Reading(NamedTuple):
    """A way to read what a gear does to a joint.

    Attributes:
        name: In words.
        gears: Of hip, knee and ankle.
        squared: Whether damping grows with the square of the gear, as friction on the motor's side does; else it is
            the joint's own, whatever the gear.
        coulomb: Whether the motors' dry friction acts.
    """

    name: str
    gears: tuple[float, float, float]
    squared: bool = False
    coulomb: bool = False


READINGS = (
    Reading("21/12, as built", GEARS),
    Reading("21/12, dry friction of the motors too", GEARS, coulomb=True),
    Reading("105/60, damping of the joint", HIGH),
    Reading("105/60, damping with n²", HIGH, squared=True),
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


class Response(NamedTuple):
    """What a joint makes of its reference, at the reference's frequency.

    Attributes:
        amplitude: [degrees].
        lag: [degrees].
    """

    amplitude: float
    lag: float


@dataclass(frozen=True, eq=False)
class Followed:
    """The experiment of Fig 4.8.

    Attributes:
        time: (n,) [s].
        angle: (n, 3) [rad] hip, knee, ankle, in chapter II's solver, from a leg that hangs at rest.
        reference: (n, 3) [rad].
        window: Response of each joint over the periods 8 … 11, which a measurement might take for steady.
        steady: Over the last of `PERIODS`, when it is.
        linear: Of the equations of motion linearised at the mean references.
        apart: [degrees] largest distance of MuJoCo's angles from these.
    """

    time: np.ndarray
    angle: np.ndarray
    reference: np.ndarray
    window: tuple[Response, ...]
    steady: tuple[Response, ...]
    linear: tuple[Response, ...]
    apart: float


@dataclass(frozen=True, eq=False)
class Report:
    """Everything.

    Attributes:
        model: The model file.
        swings: Fig 4.7.
        followed: Fig 4.8.
    """

    model: str
    swings: tuple[Swing, ...]
    followed: Followed

    def as_dict(self) -> dict[str, Any]:
        """What `--json` prints."""
        named = lambda found: dict(zip(("hip", "knee", "ankle"), (r._asdict() for r in found), strict=True))  # noqa: E731
        return {
            "model": self.model,
            "swings": [
                {
                    "joint": swing.joint, "reading": swing.reading.name, "period": swing.period,
                    "damping_ratio": swing.damping_ratio, "mujoco_apart": swing.apart,
                }
                for swing in self.swings
            ],
            "followed": {
                "window": named(self.followed.window), "steady": named(self.followed.steady),
                "linear": named(self.followed.linear), "mujoco_apart": self.followed.apart,
            },
        }  # fmt: skip


def leg_of(tree: Tree, reading: Reading = READINGS[0]) -> Leg:
    """The right leg of a robot with other gears than its own."""
    links = [THIGH[0], SHANK[0], FOOT[0]]
    ratio = (np.array(reading.gears) / GEARS) ** 2
    hinge = np.zeros((LINKS, 2))
    hinge[:2] = tree.joint[links[1:]]
    own = slice(0, LINKS)
    return Leg(
        mass=tree.mass[links],
        inertia=tree.inertia[links],
        com=tree.com[links],
        joint=hinge,
        armature=tree.armature[own] * ratio,
        damping=tree.damping[own] * (ratio if reading.squared else 1.0),
        coulomb=FRICTION * np.array(reading.gears) * (1.0 if reading.coulomb else 0.0),
    )


def small_swing(leg: Leg, joint: Joint) -> tuple[float, float]:
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


def _hanging(free: Any, joint: Joint, moving: np.ndarray) -> np.ndarray:
    """Angles (3,) at which the links from the joint on hang still, those above as the joint's experiment holds them."""
    q = np.where(moving > 0.0, 0.0, joint.start)
    for _ in range(20):
        force = moving @ free.evaluate(0.0, q, np.zeros(LINKS)).Q
        slope = moving @ free.evaluate(0.0, q + 1e-6 * moving, np.zeros(LINKS)).Q - force
        q = q - moving * force * 1e-6 / slope
    return q


def swing(tree: Tree, model: Path, joint: Joint, reading: Reading) -> Swing:
    """One free swing, in both."""
    from biped.studies.bench.hanging import in_mujoco

    leg = leg_of(tree, reading)
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


def relative(q: np.ndarray) -> np.ndarray:
    """(n, 3) [rad] joint angles of absolute ones q (n, 3)."""
    return np.column_stack([q[:, 0], np.diff(q, axis=1)])


PERIODS = 60
"""Of the experiment; the transient of the hip falls by a factor e in three."""
WINDOW = (8, 11)


def follow(tree: Tree, model: Path, drive: Drive = FIG_4_8, periods: int = PERIODS) -> Followed:
    """The experiment of Fig 4.8, in both."""
    from biped.studies.bench.hanging import in_mujoco

    leg, duration = leg_of(tree), periods * PERIOD
    out = integrate(hanging_leg(leg, drive), np.zeros(LINKS), np.zeros(LINKS), duration=duration, dt=STEP, scheme=RK8)
    angle, reference = relative(out.q), drive.reference(out.t)
    theirs = in_mujoco(model, leg, drive, {}, np.zeros(LINKS), 4 * PERIOD, STEP)
    return Followed(
        time=out.t,
        angle=angle,
        reference=reference,
        window=response(out.t, angle, drive, WINDOW),
        steady=response(out.t, angle, drive, (periods - 1, periods)),
        linear=linear_response(leg, drive),
        apart=math.degrees(np.abs(theirs - angle[: len(theirs)]).max()),
    )


def response(t: np.ndarray, angle: np.ndarray, drive: Drive, periods: tuple[int, int]) -> tuple[Response, ...]:
    """Amplitude and lag of each joint at the frequency of its reference, over whole periods (first, last)."""
    first, last = (round(k * PERIOD / STEP) for k in periods)
    rows, found = slice(first, last), []
    for joint in range(LINKS):
        turning = np.exp(-1j * drive.frequency[joint] * t[rows])
        theirs, wanted = (2.0 * np.mean(x[rows, joint] * turning) for x in (angle, drive.reference(t)))
        found.append(_response(wanted, theirs))
    return tuple(found)


def linear_response(leg: Leg, drive: Drive) -> tuple[Response, ...]:
    """What a linearisation says, about where the leg would stand if the references stayed at their means."""
    system = hanging_leg(leg, drive._replace(amplitude=np.zeros(LINKS)))
    rest, still, step = np.zeros(LINKS), np.zeros(LINKS), 1e-6

    def stiffness() -> np.ndarray:
        turned = [[system.evaluate(0.0, rest + s * step * e, still).Q for s in (-1.0, 1.0)] for e in np.eye(LINKS)]
        return np.column_stack([(back - ahead) / (2.0 * step) for back, ahead in turned])

    for _ in range(20):
        rest = rest + np.linalg.solve(stiffness(), system.evaluate(0.0, rest, still).Q)
    M = system.evaluate(0.0, rest, still).M
    rates = [(system.evaluate(0.0, rest, e).Q - system.evaluate(0.0, rest, -e).Q) / -2.0 for e in np.eye(LINKS)]
    across = np.eye(LINKS) - np.eye(LINKS, k=-1)  # joint angles of absolute ones
    found = []
    for joint in range(LINKS):
        w = drive.frequency[joint]
        wanted = drive.amplitude[joint] * np.exp(1j * drive.phase[joint]) / 1j
        torque = across.T @ (drive.K * np.eye(LINKS)[joint]) * wanted
        moved = across @ np.linalg.solve(stiffness() + 1j * w * np.column_stack(rates) - w * w * M, torque)
        found.append(_response(wanted, complex(moved[joint])))
    return tuple(found)


def _response(wanted: complex, theirs: complex) -> Response:
    return Response(math.degrees(abs(theirs)), math.degrees(float(np.angle(wanted / theirs))) % 360.0)


def measure(readings: Sequence[Reading] = READINGS) -> Report:
    """Both figures, of the shipped robot."""
    model = folder("models") / "robot.xml"
    tree = tree_at(model)
    swings = tuple(swing(tree, model, joint, reading) for joint in joints() for reading in readings)
    return Report("robot", swings, follow(tree, model))
