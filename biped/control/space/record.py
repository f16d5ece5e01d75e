"""Everything the compiled control tick of a biped with a free base reads and remembers, and in which order it counts.

The sizes of the record are those of the biped: kernels are compiled for them, so that a walker without arms does not
pay for them.

Joints that are neither the base's nor a leg's (waist, arms, head) come first, the outermost of the file first, those
that both legs hang on last. The base's velocities are linear ones along the world's axes and angular ones about its own
(MuJoCo's order). A leg's coordinates, right leg first, are three of the hip in the file's order, knee, ankle,
inversion; what a leg has not stands there as a mass of its own that nothing moves. A foot has four points.
"""

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from biped.control.pace import PARTS
from biped.control.step_back import BACKSTEP
from biped.numerics.lanes import LANES
from biped.robot.leg_states import STATES

BASE = 6
"""Coordinates of a free base."""
LEGS = 2
LEG = 6
"""Coordinates of a leg, all driven."""
HIP_JOINTS = 3
"""The first coordinates of a leg turn its thigh."""
KNEE, ANKLE, INVERSION = range(HIP_JOINTS, LEG)
"""The others turn shank and foot."""
SIDE = (-1.0, 1.0)
"""Sign of y on the right and left: outward of a leg is `SIDE` times leftward."""

LEG_POINTS = 4
"""Corners of a sole: inner and outer toe, inner and outer heel."""
N_POINTS = LEGS * LEG_POINTS
"""Of both feet."""
TOE_END, HEEL_END = 0, 1
"""Numbers of a foot's ends."""
ENDS = 2 * LEGS
"""Toe and heel of the right and the left foot: an end touches if any of its two points does."""


DIRECTIONS = 3
"""A point can be pushed up, forward and to the left."""
EDGES = 4
"""Of a point's friction pyramid: up with friction forward, backward, to the left and to the right."""
PLANE_EDGES = 2
"""Of these, the first ones, which are those in the plane."""
LEG_EDGES = LEG_POINTS * EDGES
N_EDGES = LEGS * LEG_EDGES


class Sizes(NamedTuple):
    """How many coordinates and stops a biped has beside those that all have.

    Attributes:
        trunk: Joints that are neither the base's nor a leg's.
        shared: Of these, those that both legs hang on.
        stops: Ends of joints' ranges that the law counts on, the knees' first.
    """

    trunk: int = 0
    shared: int = 0
    stops: int = LEGS


GAIT = np.dtype(
    [
        ("k_torso", "f8", 3), ("b_torso", "f8", 3), ("rest_torso", "f8", 3),  # pitch, roll, yaw
        ("k", "f8", (STATES, LEG)), ("b", "f8", (STATES, LEG)), ("rest", "f8", (STATES, LEG)),
        ("position", "f8"), ("velocity", "f8"),  # of foot placement [rad/m, rad s/m]
        ("apart", "f8"), ("crossing", "f8"), ("shorten", "f8"), ("push", "f8"),  # likewise [m, m, rad/rad², rad s²/m]
        # [m/s; m/s per rad of slope; rad per rad], what thighs do above it [rad s/m]: in the air, on the ground
        ("pace", "f8", PARTS),
        ("heading", "f8"),  # rad to the left, where the inertial frame's x axis is taken to point
    ],
    align=True,
)  # fmt: skip
"""The gait [rad, N m/rad, N m s/rad] by leg state; a leg's six are flexion … inversion, outward positive."""

_SENSING = np.dtype(
    [
        ("contact_height", "f8"),
        ("hold", "i8", 4),
        ("extended", "f8"),
        ("ahead", "f8"),
        ("late_stance", "f8"),
        ("passing", "f8"),
    ],
    align=True,
)
"""As in `biped.control.planar.setup`."""


def _belief(upper: int, stops: int) -> np.dtype:
    """The controller's knowledge of the walker; coordinates are in the law's order.

    [rad] pitch and roll of the ground's frame against what angles are measured from; [m/s²] gravity along the ground,
    forward and to the left; [m] half the distance of the hips; [kg]; [m] length of a shank; where coordinates stand in
    v and q (-1: nowhere); what its joints' dampers [N m s/rad] and dry friction [N m] do; rest of the joints above the
    legs [rad]; which bodies carry it, and their own axes: base, right thigh, left thigh; soles; stops by leg and joint,
    which way [1] they push a coordinate, and from where [rad].
    """
    number = upper + LEGS * LEG
    return np.dtype(
        [
            ("tilt", "f8", 2), ("downhill", "f8", 2), ("hip", "f8"), ("mass", "f8"), ("shank", "f8"),
            ("column", "i8", number), ("place", "i8", number), ("damping", "f8", number), ("dry", "f8", number),
            ("upright", "f8", upper), ("root", "i8"), ("link", "i8", 1 + LEGS), ("foot", "i8", LEGS),
            ("across", "f8", (1 + LEGS, 3)), ("along", "f8", (1 + LEGS, 3)), ("sole", "f8", (N_POINTS, 3)),
            ("twin", "u1", N_POINTS), ("edges", "i8"),  # points in another's place; of a point, those that count
            ("sign", "f8", (LEGS, LEG)), ("zero", "f8", (LEGS, LEG)),
            ("stop_leg", "i8", stops), ("stop_joint", "i8", stops),
            ("stop_way", "f8", stops), ("stop_end", "f8", stops),
        ],
        align=True,
    )  # fmt: skip


def _actuation(driven: int) -> np.dtype:
    """How Q_d becomes torques [N m]: as in `biped.control.planar.setup`."""
    return np.dtype(
        [
            ("generalized", "u1"), ("limit", "f8", driven),
            ("friction", "f8"), ("approach", "f8"), ("reach", "f8"), ("yielding", "f8"), ("regularisation", "f8"),
            ("braking", "f8"), ("stops", "u1"), ("compensation", "f8"), ("follow", "f8"), ("most", "f8"),
            ("learning", "u1"), ("tick", "f8"), ("worth", "f8"), ("noticing", "f8"),
        ],
        align=True,
    )  # fmt: skip


def _memory(driven: int, unknowns: int) -> np.dtype:
    """The memory that lasts from tick to tick.

    Contacts, ticks that a change has lasted, leg states, whether the walker falls back; its velocity to the left [m/s]
    and what pushes it there [m/s²]; the allocation's latest sets and torques; factors of what joints lose, by
    coordinate, and what they follow from (`biped.control.space.tick`).
    """
    return np.dtype(
        [
            ("believed", "u1", ENDS), ("waiting", "i8", ENDS), ("phase", "i8", LEGS), ("back", "u1"),
            ("leftward", "f8"), ("pushed", "f8"),
            ("held", "u1", unknowns), ("pressed", "u1", unknowns), ("side", "i8", driven),
            ("latest", "f8", driven), ("factor", "f8", driven + BASE), ("before", "f8", driven + BASE),
            ("clear", "u1", LEGS), ("shown", "f8", LEG), ("weight", "f8", LEG),
        ],
        align=True,
    )  # fmt: skip


def _at(upper: int, reach: int) -> np.dtype:
    """Where the walker is."""
    number = upper + LEGS * LEG
    return np.dtype(
        [
            ("height", "f8", N_POINTS), ("speed", "f8", N_POINTS),  # m, m/s upward
            ("place", "f8", (N_POINTS, 3)),  # m
            ("A", "f8", (reach + LEG, LEGS * LANES)),  # by column: motions of base and leg that move a point
            ("bias", "f8", (N_POINTS, DIRECTIONS)),  # J̇v [m/s²], up, forward, left
            ("v", "f8", number), ("joint", "f8", (LEGS, LEG)), ("joint_rate", "f8", (LEGS, LEG)),
            ("angle", "f8", (LEGS, 3)), ("rate", "f8", (LEGS, 3)),  # thighs: sagittal, outward, about their axis
            ("torso", "f8", 3), ("torso_rate", "f8", 3),  # pitch, roll, yaw
            ("axis", "f8", (1 + LEGS, 3)),  # of torso and thighs, upward
            ("com", "f8", 3), ("com_velocity", "f8", 3), ("foot", "f8", (LEGS, 3)),
            ("M_leg", "f8", (LEGS, LEG, LEG)), ("M_cross", "f8", (LEGS, LEG, reach)), ("M_base", "f8", (upper, upper)),
        ],
        align=True,
    )  # fmt: skip


def _tick(number: int, driven: int, unknowns: int) -> np.dtype:
    """The results of a tick."""
    return np.dtype(
        [
            ("Q_d", "f8", number), ("u", "f8", driven), ("passive", "f8", number), ("limited", "u1"),
            ("placed", "f8", LEGS), ("force", "f8", unknowns), ("changes", "i8", 3), ("given_up", "i8"),
        ],
        align=True,
    )  # fmt: skip


def _work(upper: int, reach: int, stops: int) -> np.dtype:
    """Work space of the allocation."""
    number, unknowns = upper + LEGS * LEG, N_EDGES + stops
    width = -(-unknowns // LANES) * LANES
    return np.dtype(
        [
            ("soft", "f8", number - BASE), ("R_leg", "f8", (LEGS, LEG, LEG)), ("W", "f8", (LEGS, LEG, reach)),
            ("R_base", "f8", (upper, upper)), ("C", "f8", (reach + LEG, LEGS * LANES)),
            ("D", "f8", (LEGS * LANES + stops + 1, LEGS * LANES)), ("stop", "f8", (stops, reach + LEG)),
            # Of the forces that count, in order:
            ("kept", "i8", unknowns), ("up", "i8", unknowns), ("across", "i8", unknowns), ("slope", "f8", unknowns),
            ("least", "f8", unknowns), ("away", "f8", unknowns), ("price", "f8", unknowns),
            ("free", "u1", unknowns), ("order", "i8", unknowns),
            ("edges", "i8"), ("knees", "i8"),  # how many of them are edges, and edges or knees
            ("near", "u1", N_POINTS), ("standing", "u1", LEGS),  # points and legs that count
            ("row", "f8", (1, LEGS * LANES)), ("wanted", "f8", number), ("forces", "f8", number),
            ("H", "f8", (width, width)), ("U", "f8", (width, width)), ("L", "f8", (width, width)),
            ("f", "f8", (1, width)), ("x", "f8", (1, width)), ("y", "f8", (1, width)),
        ],
        align=True,
    )  # fmt: skip


@lru_cache
def control_type(sizes: Sizes) -> np.dtype:
    """The controller of a biped of these sizes."""
    upper, reach, unknowns = sizes.trunk + BASE, sizes.shared + BASE, N_EDGES + sizes.stops
    number = upper + LEGS * LEG
    driven = number - BASE
    return np.dtype(
        [
            ("gait", GAIT), ("belief", _belief(upper, sizes.stops)), ("sensing", _SENSING), ("backstep", BACKSTEP),
            ("actuation", _actuation(driven)), ("memory", _memory(driven, unknowns)), ("at", _at(upper, reach)),
            ("tick", _tick(number, driven, unknowns)), ("work", _work(upper, reach, sizes.stops)),
        ],
        align=True,
    )  # fmt: skip


HUMAN = Sizes()
"""Of a torso on two legs."""


def new(sizes: Sizes = HUMAN) -> np.ndarray:
    """A zeroed controller record, (1,)."""
    return np.zeros(1, control_type(sizes))
