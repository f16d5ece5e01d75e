"""Speed, steps and support phases by the true state and the ground's force alone; what feet do on the ground.

Contact forces, centre of pressure, slip, penetration and clearance are of every robot; step width, heading, drift and
the margin of stability sideways of those alone that move in space.
"""

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from biped.base.jit import entry_kernel
from biped.measure.contact import LOADED, along_feet, feet_down, swings_of
from biped.measure.pushes import declared
from biped.measure.trajectory import Trajectory
from biped.robot.ground import GRAVITY
from biped.robot.planar.topology import BASE, KNEE, LEGS
from biped.scenario.devices import COMMANDED

KNEES = [joint - BASE for joint in KNEE]
"""Columns of the joint angles."""
MOVED = 0.1
"""[m] that must be travelled in the window for numbers per distance."""


def travelled(t: Trajectory, span: slice) -> float:
    """Distance [m] over a span that costs and slip are divided by; nan for one that got nowhere.

    A robot that stands has no cost of transport: what it spends over the centimetres that it sways is no number.
    """
    far = math.hypot(*(float(way[span.stop - 1] - way[span.start]) for way in (t.x, t.y)))
    return far if far >= MOVED else math.nan


def heels(t: Trajectory, rows: np.ndarray) -> np.ndarray:
    """(m, 2) [m] places of the heels along the course in some rows: the middle of the rear half of a foot's points."""
    feet, rear = t.robot.of_foot, along_feet(t.robot) < 0.5
    place = np.einsum("ijk,ik->ij", t.point[rows], t.way[rows])
    return np.stack([place[:, (feet == foot) & rear].mean(axis=1) for foot in range(len(t.robot.feet))], axis=1)


def stride(t: Trajectory, span: slice) -> dict[str, float]:
    """Speed, Froude number, steps, support phases and lean over a span of rows."""
    x, y, time, moving, lean = t.x[span], t.y[span], t.time[span], t.forward_speed[span], np.degrees(t.lean[span])
    seconds = float(time[-1] - time[0]) or math.nan  # a run that ended in its first tick has no rates
    speed = float(x[-1] - x[0]) / seconds
    strayed = (x - x.mean()) ** 2 + (y - y.mean()) ** 2
    return {
        "speed": speed,
        "speed_std": float(moving.std()),
        "froude": speed / math.sqrt(GRAVITY * t.robot.leg),
        "strayed": math.sqrt(float(strayed.max())),
        "torso_lean": float(lean.mean()),
        "torso_sway": float(lean.std()),
        "tilt": float(np.degrees(t.tilt[span].max())),
        "stance_knee": stance_knee(t, span),
        **_steps(t, span),
    }


def stance_knee(t: Trajectory, span: slice) -> float:
    """Mean flexion [degrees] of supporting knees in the middle half of the times when one foot alone is on the ground.

    Times that the span cuts are left out.
    """
    knees, down = np.degrees(t.joint_angles[span][:, KNEES]), t.down[span]
    alone = down & ~down[:, ::-1]
    held = []
    for leg in range(LEGS):
        for spell in swings_of(~alone, leg):
            quarter = (spell.stop - spell.start) // 4
            held.append(-knees[spell.start + quarter : spell.stop - quarter, leg])
    return mean_of(np.concatenate(held)) if held else math.nan


def _steps(t: Trajectory, span: slice) -> dict[str, float]:
    """Steps and support phases."""
    down, found = t.down[span], t.strikes_in(span)
    rows, feet = np.array(found, dtype=int).reshape(-1, 2).T
    heel, (right, left) = heels(t, rows), down.T
    return {
        "step_length": mean_of(np.abs(heel[:, 0] - heel[:, 1])),
        "step_frequency": steps_per_second(rows, t.tick),
        "step_duration": mean_of(t.tick * np.diff(rows)),
        "steps": len(found),
        "alternation": mean_of(feet[1:] != feet[:-1]),
        "double_support": float((right & left).mean()),
        "flight": 1.0 - float((right | left).mean()),
        "duty": float(down.mean()),
    }


def steps_per_second(rows: np.ndarray, tick: float) -> float:
    """Steps from the first strike to the last, per second, so that length times frequency is speed; 0 of less than two.

    Args:
        rows: (n,) rows of the strikes.
        tick: [s] from row to row.
    """
    return (len(rows) - 1) / (tick * float(rows[-1] - rows[0])) if len(rows) > 1 and rows[-1] > rows[0] else 0.0


def mean_of(values: Sequence[float] | np.ndarray) -> float:
    """The mean of some numbers; nan of none."""
    return float(np.mean(values)) if len(values) else math.nan


SECOND = 1.0
"""[s] over which velocities are averaged: within a step they go to and fro."""


def tracking(t: Trajectory, span: slice) -> dict[str, float]:
    """Velocity that was asked for and errors of what came of it, over a span of rows; nothing if none was asked for.

    The base's velocity, in the direction that it faces, and its turning are means over pieces of a second; errors are
    root mean squares over these.

    Args:
        t: The run.
        span: Rows.
    """
    if COMMANDED[0] not in t.signals:
        return {}
    asked = np.stack([t.signals[name][span] for name in COMMANDED], axis=1)
    place, turn = t.base[span, :2], t.heading[span]
    moved = np.diff(place, axis=0) / t.tick
    c, s = np.cos(turn[:-1]), np.sin(turn[:-1])
    done = np.stack(
        [c * moved[:, 0] + s * moved[:, 1], c * moved[:, 1] - s * moved[:, 0], np.diff(turn) / t.tick], axis=1
    )
    pieces = np.array_split(done - asked[:-1], max(1, round(len(done) * t.tick / SECOND)))
    off = np.array([piece.mean(axis=0) for piece in pieces])
    return {
        "commanded": float(np.linalg.norm(asked[:, :2], axis=1).mean()),
        "command_error": float(np.sqrt((off[:, :2] ** 2).sum(axis=1).mean())),
        "yaw_error": float(np.sqrt((off[:, 2] ** 2).mean())),
    }


_SWING = 0.1
"""[s] in the air from which a swing has a clearance."""


class Grounded(NamedTuple):
    """Sums over the contact of ground and feet in a span.

    Attributes:
        lost: [J] work that contacts took: the force of each row times how far its point goes until the next.
        slid: [m] way of loaded feet from row to row, of each foot the mean over its points weighted by their forces.
        pressure: Mean place of the normal force along a loaded foot, 0 heel … 1 toe; nan if none ever is.
    """

    lost: float
    slid: float
    pressure: float


def grounded(t: Trajectory, span: slice) -> Grounded:
    """Sums what ground and feet did to each other in a span of rows; tests/measure/referee.py has it in NumPy."""
    least = LOADED * t.mass * GRAVITY
    lost, slid, pressure, count = _grounded(
        t.force[span], t.point[span], t.robot.of_foot, along_feet(t.robot), least, np.zeros((3, len(t.robot.feet)))
    )
    return Grounded(lost, slid, pressure / count if count else math.nan)


@entry_kernel
def _grounded(force, point, of_foot, along, least, work):
    lost, slid, pressure, count = 0.0, 0.0, 0.0, 0
    load, place, way = work[0], work[1], work[2]
    for k in range(force.shape[0]):
        load[:] = 0.0
        place[:] = 0.0
        way[:] = 0.0
        for i in range(force.shape[1]):
            foot, normal = of_foot[i], force[k, i, 2]
            load[foot] += normal
            place[foot] += normal * along[i]
            if k + 1 < force.shape[0]:
                x, y = point[k + 1, i, 0] - point[k, i, 0], point[k + 1, i, 1] - point[k, i, 1]
                z = point[k + 1, i, 2] - point[k, i, 2]
                lost -= force[k, i, 0] * x + force[k, i, 1] * y + normal * z
                if normal != 0.0:
                    way[foot] += normal * math.sqrt(x * x + y * y)
        for foot in range(load.size):
            if load[foot] > least:
                pressure += place[foot] / load[foot]
                slid += way[foot] / load[foot]
                count += 1
    return lost, slid, pressure, count


def contact(t: Trajectory, span: slice) -> dict[str, float]:
    """Support, pull, sinking, centre of pressure, slip, losses and clearance over a span of rows."""
    weight, sums = -t.mass * t.gravity[2], grounded(t, span)
    return {
        "support": float(t.ground_force[span, 2].mean() / weight),
        "foot_support": float(t.foot_force[span].sum(axis=1).mean() / weight),
        "sinking": max(0.0, -float(t.above[span].min())) / t.robot.leg,
        "com_height": float(t.com_above[span].min()) / t.robot.leg,
        **({"pull": pull(t, span) / weight} if t.pushes else {}),
        **({} if t.seat_force is None else {"seat_load": float(t.seat_force[span, 1].mean() / weight)}),
        "centre_of_pressure": sums.pressure,
        "slip": sums.slid / travelled(t, span),
        "contact_loss": sums.lost / (t.tick * (span.stop - span.start - 1)),
        "clearance": clearance(t, span),
    }


def pull(t: Trajectory, span: slice) -> float:
    """Mean force [N] of the declared pushes along the way over a span of rows, backward negative."""
    begin, end = float(t.time[span.start]), float(t.time[span.start]) + t.tick * (span.stop - span.start)
    way = np.array([float(one[span.stop - 1] - one[span.start]) for one in (t.x, t.y)])
    impulse = np.zeros(2)
    for push in declared(t):
        impulse += max(0.0, min(push.end, end) - max(push.start, begin)) * np.array(push.force[:2])
    return float(impulse @ way) / ((end - begin) * (math.hypot(*way) or math.inf))


def clearance(t: Trajectory, span: slice) -> float:
    """Lowest point of a foot above the ground in the middle half of its swings [m]: the smallest of a span's.

    Swings that the span cuts are left out.
    """
    lowest, least, feet = math.nan, round(_SWING / t.tick), t.robot.of_foot
    down, above = t.down[span], t.above[span]
    for foot in range(len(t.robot.feet)):
        for swing in swings_of(down, foot):
            length = swing.stop - swing.start
            if length >= least:
                middle = slice(swing.start + length // 4, swing.stop - length // 4)
                lowest = float(np.fmin(lowest, above[middle][:, feet == foot].min()))
    return lowest


def foot_places(t: Trajectory) -> np.ndarray:
    """(n, feet, 3) [m] middle of each foot's contact points."""
    feet = t.robot.of_foot
    return np.stack([t.point[:, feet == i].mean(axis=1) for i in range(len(t.robot.feet))], axis=1)


def sideways(t: Trajectory, span: slice) -> dict[str, float]:
    """Step width, cross-over and margin of stability over a span of rows; heading, drift and veering of the whole run.

    Widths are across the course at the strike; a foot that lands beyond the other's place has crossed over. A pelvis
    turns to and fro by 20° in each stride, so where the walker heads in the end is the mean of its last stride, against
    the x axis: a start in the middle of a stride faces aside. Which way it went is another number: one may walk
    straight and face aside, or face ahead and drift.
    """
    place = foot_places(t)[span]
    # Which foot is the left one: the one that is left of the other over the window as a whole.
    across = ((place[:, 1, :2] - place[:, 0, :2]) * t.aside[span]).sum(axis=1)
    sign = 1.0 if float(np.median(across)) >= 0.0 else -1.0
    widths = [sign * float(across[row - span.start]) for row, _ in t.strikes_in(span)]
    ahead, drift = (t.base[-1, :2] - t.base[0, :2]).tolist()
    went = math.hypot(ahead, drift) > t.robot.leg
    return {
        "step_width": mean_of(widths),
        "cross_over": mean_of([width < 0.0 for width in widths]),
        "heading": math.degrees(float(t.course[-1])),
        "drift": drift,
        "veering": math.degrees(math.atan2(drift, ahead)) if went else math.nan,
        "margin_of_stability": margin_of_stability(t, span),
    }


def bearing(t: Trajectory) -> np.ndarray:
    """(n, P) whether each contact point bears its share of what makes a foot loaded (`biped.measure.contact`)."""
    points = np.bincount(t.robot.of_foot)[t.robot.of_foot]
    return feet_down(t.force[:, :, 2] * points, t.mass * GRAVITY, t.tick)


def extrapolated(t: Trajectory) -> np.ndarray:
    """(n, 2) [m] extrapolated centre of mass (Hof): where a foot would have to be for it to come to rest above."""
    height = np.maximum(t.com[:, 2] - t.ground.height(t.com[:, 0]), 1e-3)
    return t.com[:, :2] + t.com_velocity[:, :2] * np.sqrt(height / GRAVITY)[:, None]


def outline(points: np.ndarray) -> np.ndarray:
    """(k, 2) corners of the convex hull of points (n, 2) [m], anticlockwise from the rearmost (Andrew's chain)."""
    places = sorted({(float(x), float(y)) for x, y in points})
    if len(places) < 3:
        return np.array(places).reshape(-1, 2)
    half: list[list[tuple[float, float]]] = []
    for way in (places, places[::-1]):
        chain: list[tuple[float, float]] = []
        for place in way:
            while len(chain) > 1 and _turn(chain[-2], chain[-1], place) <= 0.0:
                chain.pop()
            chain.append(place)
        half.append(chain[:-1])
    return np.array(half[0] + half[1])


def _turn(a: tuple[float, float], b: tuple[float, float], c: tuple[float, float]) -> float:
    """Twice the area of a triangle; positive if a, b, c go round anticlockwise."""
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


def margin_of_stability(t: Trajectory, span: slice) -> float:
    """[m] lateral distance from the extrapolated centre of mass to the outer edge of what it stands on.

    The mean over steps of the least in each; of a robot that takes none, the least.
    """
    reach = (t.point[:, :, :2] * t.aside[:, None]).sum(axis=2)
    at = (extrapolated(t) * t.aside).sum(axis=1)
    touching = bearing(t)
    left = np.where(touching, reach, -np.inf).max(axis=1) - at
    right = at - np.where(touching, reach, np.inf).min(axis=1)
    margin = np.where(touching.any(axis=1), np.minimum(left, right), np.nan)
    # By what bears, as the edges are: a foot that lost its force for a moment is down, but bounds nothing.
    standing = np.stack([touching[:, t.robot.of_foot == foot].any(axis=1) for foot in range(len(t.robot.feet))], axis=1)
    single = standing.sum(axis=1) == 1
    if single[span].any():
        # On one foot only its outer edge bounds it: beyond the inner one the other foot comes down.
        foot = np.argmax(standing, axis=1)
        middle = (foot_places(t)[:, :, :2] * t.aside[:, None]).sum(axis=2)
        outer_left = np.take_along_axis(middle, foot[:, None], 1)[:, 0] > middle.mean(axis=1)
        margin = np.where(single, np.where(outer_left, left, right), margin)
    cuts = [span.start, *(row for row, _ in t.strikes if span.start < row < span.stop), span.stop]
    least = [float(np.nanmin(margin[a:b])) for a, b in pairwise(cuts)
             if np.isfinite(margin[a:b]).any()]  # fmt: skip
    return float(np.mean(least)) if least else math.nan
