"""The walk as numbers that a browser draws: where hips, knees, ankles, toes, heels and arms are, forces, leg states."""

import base64
import math
from itertools import pairwise
from typing import Any, NamedTuple

import mujoco
import numpy as np

from biped.measure.pushes import declared
from biped.measure.signals import corners_of, end_forces, finite, leg_states, means, stick
from biped.measure.trajectory import Trajectory
from biped.robot.ground import GRAVITY
from biped.show import spatial

RATE = 40.0
"""Pictures per second."""
LONGEST = 12.0
"""[s] of a run that are shown: of one that did not stay up the last, otherwise the first, pushes included."""
UNIT = 5e-4
"""[m] of the whole numbers that places are told in."""
NAMES = ("hip", "knee", "ankle", "toe", "heel")
"""Points of a leg, in order; after both legs come the torso's top and the centre of mass of the whole biped."""
_GRID, _BESIDE = 0.5, (-1.0, 0.0, 1.0)
"""[m] between marks along the way; where lines along it lie beside it."""


class Frames(NamedTuple):
    """A walk, picture by picture; x forward, y to the left, z up against gravity: the ground rises with the slope.

    Attributes:
        time: (n,) [s].
        place: (n, 12 + k, 3) [m] points of the right leg, of the left, the torso's top, the centre of mass, the arms.
        arms: Numbers of the points of each line of the arms.
        force: (n, 4, 3) [body weights] on toes and heels.
        state: (n, 2) leg states 1 … 4.
        slope: [degrees].
        side_slope: [degrees].
        leg: [m] length of a leg.
        pushes: (start, end, forward [N], left [N], up [N]).
        legs: What people call the legs.
        ground: (k, 2) [m] the ground's line around the walk, from the side.
        seat: (4, 2) [m] corners of what it can sit on, from the side; (0, 2) without a seat.
        space: Whether the robot moves in space.
    """

    time: np.ndarray
    place: np.ndarray
    arms: tuple[tuple[int, ...], ...]
    force: np.ndarray
    state: np.ndarray
    slope: float
    side_slope: float
    leg: float
    pushes: tuple[tuple[float, ...], ...]
    legs: tuple[str, ...]
    ground: np.ndarray
    seat: np.ndarray
    space: bool

    @property
    def base(self) -> np.ndarray:
        """(n, 3) [m] the point of the ground's plane below the centre of mass."""
        below = self.place[:, 11].copy()
        below[:, 2] = below[:, 0] * math.tan(math.radians(self.slope))
        below[:, 2] += below[:, 1] * math.tan(math.radians(self.side_slope))
        return below

    @property
    def height(self) -> float:
        """[m] of the highest point above the ground's plane."""
        return float((self.place[..., 2] - self.base[:, None, 2]).max())

    def floor(self) -> list[list[list[float]]]:
        """Lines of the ground along the way and across it, each of points [m]."""
        x, z = self.ground.T
        low, high = self.place[..., 0].min() - 3.0 * self.leg, self.place[..., 0].max() + 3.0 * self.leg
        marks = _GRID * np.arange(math.ceil(low / _GRID), math.floor(high / _GRID) + 1)
        along = np.unique(np.concatenate([[low, high], x[(x > low) & (x < high)]]))
        rise = math.tan(math.radians(self.side_slope))
        middle = self.place[:, 11, 1]
        sides = sorted({round(float(end) + beside, 3) for end in (middle.min(), middle.max()) for beside in _BESIDE})
        lines = [np.stack([along, np.full_like(along, y), np.interp(along, x, z) + y * rise], axis=1) for y in sides]
        ends = np.array([sides[0], sides[-1]])
        lines += [
            np.stack([np.full(2, mark), ends, np.interp(mark, x, z) + ends * rise], axis=1) for mark in marks.tolist()
        ]
        return [np.round(line, 3).tolist() for line in lines]

    def data(self) -> dict[str, Any]:
        """As the page's script reads it: places in `UNIT`, relative to the ground below, forces in 1/1000."""
        return {
            "dt": 1.0 / RATE,
            "start": round(float(self.time[0]), 4),
            "n": len(self.time),
            "points": self.place.shape[1],
            "unit": UNIT,
            "leg": round(self.leg, 4),
            "base": _packed(self.base, "<f4"),
            "place": _packed((self.place - self.base[:, None]) / UNIT, "<i2"),
            "arms": self.arms,
            "force": _packed(1e3 * self.force, "<i2"),
            "state": _packed(self.state, "u1"),
            "pushes": [[round(value, 4) for value in push] for push in self.pushes],
            "floor": self.floor() if self.space else [],
        }

    def shadow(self) -> dict[str, Any]:
        """As the page's script reads a ghost: when it begins, and where legs and trunk are."""
        place = self.place[:, :11] - self.base[:, None]
        return {"start": round(float(self.time[0]), 4), "n": len(self.time), "base": _packed(self.base, "<f4"),
                "place": _packed(place / UNIT, "<i2")}  # fmt: skip


def frames_of(trajectory: Trajectory, model: mujoco.MjModel | None = None) -> Frames:
    """Pictures of a run.

    Args:
        trajectory: The run.
        model: Of its robot; without one no arms are drawn.
    """
    trajectory = finite(trajectory)
    stride = max(1, round(1.0 / (RATE * trajectory.tick)))
    rows = np.arange(0, len(trajectory), stride)
    most = round(LONGEST * RATE)
    if trajectory.end == "completed":
        last = max([LONGEST, *(push[1] + 2.0 for push in trajectory.pushes)])
        rows = rows[trajectory.time[rows] <= last]
    rows = rows[-most:]
    turn = spatial.tilt(trajectory).T
    aside = turn[np.ix_((0, 2), (0, 2))]
    weight = trajectory.mass * GRAVITY
    force = np.clip(means(end_forces(trajectory), rows) / weight, -30.0, 30.0)
    along = trajectory.x[rows]
    reach = 4.0 * trajectory.robot.leg
    place, arms = stick(trajectory, rows), ()
    if model is not None:
        hung, lines = arms_of(trajectory, model, rows)
        arms = tuple(tuple(place.shape[1] + i for i in line) for line in lines)
        place = np.concatenate([place, hung], axis=1)
    return Frames(
        time=trajectory.time[rows],
        place=place @ turn,
        arms=arms,
        force=force @ turn,
        state=leg_states(trajectory)[rows].astype(int),
        slope=trajectory.slope,
        side_slope=trajectory.side_slope,
        leg=trajectory.robot.leg,
        pushes=tuple((push.start, push.end, *push.force) for push in declared(trajectory)),
        legs=trajectory.robot.legs,
        ground=np.stack(trajectory.ground.between(along.min() - reach, along.max() + reach), axis=1) @ aside,
        seat=corners_of(trajectory) @ aside,
        space=not trajectory.robot.planar,
    )  # fmt: skip


def _packed(values: np.ndarray, kind: str) -> str:
    whole = values if kind == "<f4" else np.clip(np.rint(values), *((-32767, 32767) if kind == "<i2" else (0, 255)))
    return base64.b64encode(np.ascontiguousarray(whole.astype(kind)).tobytes()).decode()


_MIDLINE = 0.03
"""Share of a leg's length from the trunk's middle within which a part is a neck or a head, not an arm."""


def arms_of(t: Trajectory, model: mujoco.MjModel, rows: np.ndarray) -> tuple[np.ndarray, list[tuple[int, ...]]]:
    """Points of the arms and the lines that join them.

    Args:
        t: The run.
        model: Of its robot.
        rows: (m,) rows of the run.

    Returns:
        Points (m, k, 3) [m] in the ground's frame, and each line's numbers of points, of the right arm first.
    """
    data, q = mujoco.MjData(model), t.qpos(model)[rows]
    data.qpos[:] = q[0]
    mujoco.mj_kinematics(model, data)
    chains = [chain for chain in _chains(t, model) if _beside(t, data, chain)]
    chains.sort(key=lambda chain: float(data.xpos[chain[-1]][1]))
    numbers = [body for chain in chains for body in chain]
    place = np.empty((len(rows), len(numbers) + len(chains), 3))
    last = [chain[-1] for chain in chains]
    for row, pose in zip(place, q, strict=True):
        data.qpos[:] = pose
        mujoco.mj_kinematics(model, data)
        row[: len(numbers)] = data.xpos[numbers]
        row[len(numbers) :] = 2.0 * data.xipos[last] - data.xpos[last]  # the mass is in the middle of the last part
    lines, first = [], 0
    for i, chain in enumerate(chains):
        lines.append((*range(first, first + len(chain)), len(numbers) + i))
        first += len(chain)
    if len(lines) == 2:
        lines.append((lines[0][0], lines[1][0]))
    return place, lines


def _chains(t: Trajectory, model: mujoco.MjModel) -> list[list[int]]:
    """Bodies from where a limb leaves the trunk to its end, of limbs that carry no foot."""
    parent, legs = model.body_parentid, set()
    for foot in t.robot.feet:
        for part in foot.bodies:
            body = part
            while body > 0 and body not in legs:
                legs.add(body)
                body = int(parent[body])
    free = [body for body in range(1, model.nbody) if body not in legs and _hangs_on(parent, body, t.robot.base_number)]
    branches = {body: sum(1 for child in free if parent[child] == body) for body in {*free, *legs}}
    chains = []
    for leaf in (body for body in free if not branches[body]):
        chain, body = [leaf], int(parent[leaf])
        while body in free and branches[body] == 1:
            chain.insert(0, body)
            body = int(parent[body])
        chains.append(chain)
    return chains


def _hangs_on(parent: np.ndarray, body: int, base: int) -> bool:
    while body > 0 and body != base:
        body = int(parent[body])
    return body == base


def _beside(t: Trajectory, data: mujoco.MjData, chain: list[int]) -> bool:
    """Whether a chain is an arm: it has an extent, and lies beside the trunk's middle."""
    points = [*data.xpos[chain], 2.0 * data.xipos[chain[-1]] - data.xpos[chain[-1]]]
    long = sum(float(np.linalg.norm(b - a)) for a, b in pairwise(points))
    aside = max(abs(float(point[1] - data.xpos[t.robot.base_number][1])) for point in points)
    return long > 0.2 * t.robot.leg and aside > _MIDLINE * t.robot.leg
