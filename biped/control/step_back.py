"""The step back: a leg in the air comes down behind while the walker falls back (`biped.scenario.keys.Backstep`).

It is not in the thesis, but made of its parts: a leg state from contacts and motion, and couples of a spring and a
damper. Plane and space share it.
"""

import math

import numpy as np

from biped.base.jit import inner_kernel
from biped.robot.ground import GRAVITY
from biped.robot.leg_states import EXTENDED, FIRST_IN_AIR
from biped.scenario.keys import Backstep

BACKSTEP = np.dtype(
    [
        ("on", "u1"), ("margin", "f8"), ("theta_l", "f8"), ("k_d2", "f8"), ("b_d2", "f8"),
        ("bend", "f8"), ("k_d3", "f8"), ("b_d3", "f8"),
    ],
    align=True,
)  # fmt: skip
"""The step back [m; rad, N m/rad, N m s/rad of the hip; rad/rad, N m/rad, N m s/rad of the knee]."""


def set_backstep(record: np.void, backstep: Backstep | None) -> None:
    """Writes a step back, in SI units, into a controller record's."""
    if backstep is None:
        return
    record["on"], record["theta_l"] = 1, math.radians(backstep.theta_l)
    for name in ("margin", "k_d2", "b_d2", "bend", "k_d3", "b_d3"):
        record[name] = getattr(backstep, name)


@inner_kernel
def step_back(c, x, height, speed, rise, rear):
    """Writes whether the walker falls back into the record, and if so the extended state for legs in the air.

    It falls back while its extrapolated centre of mass (Hof 2008), x + ẋ √(y/g) along the ground and taken vertically
    below it, is behind the rearmost believed contact by more than `margin`.

    Args:
        c: The controller record.
        x: [m] where its centre of mass is, along the ground.
        height: [m] of it above the ground.
        speed: [m/s] of it along the ground.
        rise: [rad] by which the ground rises ahead.
        rear: [m] of the rearmost contact; infinite: it is in flight, and nothing is behind anything.
    """
    memory = c["memory"]
    ahead = x - height * math.tan(rise) + speed * math.sqrt(max(height, 0.0) / GRAVITY)
    memory["back"] = ahead < rear - c["backstep"]["margin"] and rear < math.inf
    if memory["back"]:
        for leg in range(memory["phase"].size):
            if memory["phase"][leg] >= FIRST_IN_AIR:
                memory["phase"][leg] = EXTENDED


@inner_kernel
def thigh_couple(backstep, to_go, rate):
    """[N m] on the thigh of a leg that steps back, which has to_go [rad] still to go, at its rate [rad/s]."""
    return -backstep["k_d2"] * to_go - backstep["b_d2"] * rate


@inner_kernel
def knee_couple(backstep, to_go, knee, rate):
    """[N m] on its knee [rad, rad/s], which is bent as long as the thigh has to go."""
    rest = -backstep["bend"] * max(to_go, 0.0)
    return -backstep["k_d3"] * (knee - rest) - backstep["b_d3"] * rate
