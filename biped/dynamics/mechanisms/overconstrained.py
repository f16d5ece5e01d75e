"""Mechanisms that move although their constraints say they should not: rows that depend on each other on Φ = 0."""

import numpy as np

from biped.dynamics.bodies import GROUND, Plane, Space

THICK = 1e-6
"""Inertia of a rod of 1 kg about itself [kg m²]: rods in space need some."""


def _cube() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Joints (6, 3), rods (6, 3) and axes (6, 3) of Bricard's six-bar, around the edges of a cube of 1 m."""
    joints = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [1, 1, 1], [0, 1, 1], [0, 0, 1]], float)
    rods = np.roll(joints, -1, axis=0) - joints
    return joints, rods, np.cross(np.roll(rods, 1, axis=0), rods)


def bricard_mjcf() -> str:
    """Bricard's six-bar: six revolutes at right angles, five rods of 1 m and 1 kg, the sixth joint two connects.

    Five hinges, six rows of rank four on Φ = 0 and of rank five beside it.
    """
    joints, rods, axes = _cube()

    def text(x: np.ndarray) -> str:
        return " ".join(f"{c:.17g}" for c in x)

    body = ""
    for i in range(4, -1, -1):
        offset = joints[0] if i == 0 else rods[i - 1]
        inertia = np.maximum((1.0 - rods[i] ** 2) / 12.0, THICK)
        body = (
            f'<body name="rod{i}" pos="{text(offset)}"><joint name="hinge{i}" axis="{text(axes[i])}"/>'
            f'<inertial pos="{text(rods[i] / 2)}" mass="1" diaginertia="{text(inertia)}"/>{body}</body>'
        )
    ends = (rods[4], rods[4] + 0.5 * axes[5])
    connects = "".join(f'<connect body1="rod4" body2="ground" anchor="{text(end)}"/>' for end in ends)
    return (
        '<mujoco model="bricard"><option gravity="0 0 -9.81"/><worldbody>'
        f'<body name="ground">{body}</body></worldbody><equality>{connects}</equality></mujoco>'
    )


def _ring(name: str, joints: np.ndarray, axes: np.ndarray) -> Space:
    """Rods from joint to joint, the last one the ground."""
    space = Space(name=name)
    count, last = len(joints), GROUND
    rods = np.roll(joints, -1, axis=0) - joints
    for i in range(count):
        length = float(np.linalg.norm(rods[i]))
        inertia = (length**2 * np.eye(3) - np.outer(rods[i], rods[i])) / 12.0 + THICK * np.eye(3)
        rod = (
            space.body(f"rod{i}", mass=1.0, inertia=inertia, at=joints[i], centre=rods[i] / 2)
            if i < count - 1
            else GROUND
        )
        before = joints[i] if last is GROUND else rods[i - 1]
        after = joints[i] if rod is GROUND else np.zeros(3)
        space.hinge(f"hinge{i}", last, before, rod, after, axes[i])
        last = rod
    return space


def bricard() -> Space:
    """The same six-bar in natural coordinates: 60 of them, 60 rows of rank 59."""
    joints, _, axes = _cube()
    return _ring("bricard", joints, axes)


def bennett(short: float = 1.0, twist: float = np.pi / 6, other: float = np.pi / 2, angle: float = 2.0) -> Space:
    """Bennett's linkage: four revolutes, opposite rods alike, lengths as the sines of their twists.

    Closed at tan(θ₁/2) tan(θ₂/2) = sin((β + α)/2)/sin((β − α)/2): 36 coordinates, 38 rows of rank 35.

    Args:
        short: Length of the first and third rod [m].
        twist: Angle α between the axes at its ends [rad].
        other: Angle β between the axes at the ends of the second and fourth [rad].
        angle: θ₁, at the first joint [rad].
    """
    second = 2 * np.arctan(np.sin((other + twist) / 2) / np.sin((other - twist) / 2) / np.tan(angle / 2))
    lengths = (short, short * np.sin(other) / np.sin(twist)) * 2
    place, turn = np.zeros(3), np.eye(3)
    joints, axes = [], []
    for i, theta in enumerate((angle, second, -angle, -second)):
        joints.append(place)
        axes.append(turn[:, 2])
        c, s = np.cos(theta), np.sin(theta)
        turn = turn @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
        place = place + lengths[i] * turn[:, 0]
        c, s = np.cos((twist, other)[i % 2]), np.sin((twist, other)[i % 2])
        turn = turn @ np.array([[1, 0, 0], [0, c, -s], [0, s, c]])
    return _ring("bennett", np.array(joints), np.array(axes))


def parallelograms(cells: int = 1, bars: int = 3, spin: float = -1.0) -> Plane:
    """Upright cranks of 1 m and 1 kg in a row, neighbours tied by parallel couplers, all but one too many.

    Args:
        cells: Number of parallelograms.
        bars: With 2, each has its coupler on top; with 3, another one halfway up.
        spin: Of the cranks at the start [rad/s].
    """
    plane = Plane(name=f"{cells} parallelograms")
    rod = {"mass": 1.0, "inertia": 1.0 / 12.0, "centre": (0.5, 0.0)}
    cranks = [plane.body(f"crank{i}", **rod, at=(float(i), 0.0), angle=np.pi / 2, spin=spin) for i in range(cells + 1)]
    for i, crank in enumerate(cranks):
        plane.hinge(f"foot{i}", GROUND, (float(i), 0.0), crank, (0.0, 0.0))
    for i in range(cells):
        for k, height in enumerate((1.0, 0.5)[: bars - 1]):
            coupler = plane.body(f"coupler{i}.{k}", **rod, at=(float(i), height), velocity=(-spin * height, 0.0))
            plane.hinge(f"left{i}.{k}", cranks[i], (height, 0.0), coupler, (0.0, 0.0))
            plane.hinge(f"right{i}.{k}", coupler, (1.0, 0.0), cranks[i + 1], (height, 0.0))
    return plane
