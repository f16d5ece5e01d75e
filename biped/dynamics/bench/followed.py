"""Fig 4.8: spring-dampers at hip, knee and ankle follow equilibria that move."""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from biped.dynamics import RK8, integrate
from biped.dynamics.bench.leg import STEP, in_mujoco, leg_of, relative
from biped.dynamics.mechanisms.leg import LINKS, HangingLeg, MovingSprings, hanging_leg

PERIOD = 4.0 / 3.0
"""[s] in which all three references of Fig 4.8 repeat."""
FIG_4_8 = MovingSprings(
    K=np.array([2.0, 1.5, 1.0]),
    B=np.array([0.2, 0.2, 0.1]),
    amplitude=np.pi * np.array([1 / 3, 1 / 6, 1 / 6]),
    frequency=np.pi * np.array([1.5, 3.0, 6.0]),
    phase=np.array([0.0, -0.5 * np.pi, 0.0]),
    mean=np.pi * np.array([1 / 20, -1 / 2, 1 / 6]),
)
"""Gains and references of the figure's caption."""


class Response(NamedTuple):
    """Motion of a joint at the frequency of its reference.

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


PERIODS = 60
"""Of the experiment; the transient of the hip falls by a factor e in three."""
WINDOW = (8, 11)


def follow(model: Path, drive: MovingSprings = FIG_4_8, periods: int = PERIODS) -> Followed:
    """The experiment of Fig 4.8, in both."""
    leg, duration = leg_of(model), periods * PERIOD
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


def response(t: np.ndarray, angle: np.ndarray, drive: MovingSprings, periods: tuple[int, int]) -> tuple[Response, ...]:
    """Amplitude and lag of each joint at the frequency of its reference, over whole periods (first, last)."""
    first, last = (round(k * PERIOD / STEP) for k in periods)
    rows, found = slice(first, last), []
    for joint in range(LINKS):
        turning = np.exp(-1j * drive.frequency[joint] * t[rows])
        theirs, wanted = (2.0 * np.mean(x[rows, joint] * turning) for x in (angle, drive.reference(t)))
        found.append(_response(wanted, theirs))
    return tuple(found)


def linear_response(leg: HangingLeg, drive: MovingSprings) -> tuple[Response, ...]:
    """Responses of the equations linearised about where the leg would stand if the references stayed at their means."""
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
