"""The estimator of a robot's posture: (4.8) and (4.9) infer the torso's angle from its sensors.

Not underactuated, that is while two points or more touch that lie far enough apart, the torso's angle follows from the
joint angles, (4.8): the points lie on the ground, a line. Seen from the torso that is the line of least squares
through them, which for two points is exact. Otherwise the gyro's rate is integrated, (4.9). Where what the estimate
rests on changes, the difference is let in over a short time.

Rates are differences of successive ticks, those of the torso too, of the same points. Height and speed of the torso
follow from touching points at rest on the ground, in the air from gravity.
"""

import math
from typing import NamedTuple

import numpy as np

from biped.base.jit import kernel
from biped.robot.columns import FORCE
from biped.robot.ground import GRAVITY
from biped.robot.planar.kinematics import PLACES, TREE, forward
from biped.robot.planar.topology import BASE, N_POINTS, NQ, NU, PITCH, X, Z

ANGLE, RATE, GYRO, CLIPPED = range(4)
"""Columns of what is noted of an estimate: pitch [rad], its rate [rad/s], whether it rests on the gyro, and whether
that was clipped."""
NOTED = 4

ESTIMATOR = np.dtype(
    [
        ("tick", "f8"),  # s
        ("resolution", "f8", NU), ("reference", "f8", NU),  # rad, of the encoders; what their zeros are off by
        ("range", "f8"), ("follow", "f8"), ("bias", "f8"),  # rad/s, share of the way in a tick, rad/s
        ("force", "f8"), ("release", "f8"), ("debounce", "i8"),  # N, N, ticks
        ("width", "f8"), ("blend", "f8"),  # m, ticks
        ("tree", TREE), ("at", PLACES), ("q", "f8", NQ), ("still", "f8", NQ),
        ("before", "f8", NU), ("touching", "u1", N_POINTS), ("waiting", "i8", N_POINTS), ("basis", "i8"),
        ("filtered", "f8"), ("unfiltered", "f8"), ("clipped", "u1"),  # rad/s of the gyro, before and after its filter
        ("offset", "f8"), ("rate_offset", "f8"), ("left", "f8"),  # of the estimate from its source, and ticks to go
        # The line through the touching points, seen from the torso: its angle, its middle, and how far they spread.
        ("fit", "f8", 4),
    ],
    align=True,
)  # fmt: skip
"""The estimator: settings, what it believes of the robot, memory and work space."""


class Inference(NamedTuple):
    """A run's estimator as loops take it.

    Attributes:
        record: (1,) `ESTIMATOR`.
        noise: (n,) [rad/s] of the gyro.
        angle_noise: (n, 6) [rad] of the encoders; (0, 6) where there is none.
        past: (delay + 1, 2, 9) latest true coordinates and velocities.
        noted: (n, NOTED) what is noted of every tick.
        joints: (6,) [rad] measured joint angles of the latest tick.
    """

    record: np.ndarray
    noise: np.ndarray
    angle_noise: np.ndarray
    past: np.ndarray
    noted: np.ndarray
    joints: np.ndarray


@kernel
def read_switches(e, q, v, log, k):
    """Updates which points are taken to touch, from the ground's forces in the last tick; at the start from heights."""
    if k == 0:
        forward(e["tree"], q, v, 0.0, q[Z], e["at"])
        for i in range(N_POINTS):
            e["touching"][i] = 1 if e["at"]["point"][i, 1] < 1e-3 else 0
            e["waiting"][i] = 0
        return
    for i in range(N_POINTS):
        pressed = log[k - 1, FORCE + 2 * i + 1] >= (e["release"] if e["touching"][i] else e["force"])
        if pressed == (e["touching"][i] == 1):
            e["waiting"][i] = 0
            continue
        e["waiting"][i] += 1
        if e["waiting"][i] > e["debounce"]:
            e["touching"][i] = 1 if pressed else 0
            e["waiting"][i] = 0


@kernel
def read_encoders(e, q, noise, k, joints):
    """Writes the measured joint angles (6,) [rad]; row k of the noise (n, 6) is in them, if there is any."""
    for j in range(NU):
        joints[j] = q[BASE + j] + e["reference"][j]
        if noise.size > 0:
            joints[j] += noise[k, j]
        if e["resolution"][j] > 0.0:
            joints[j] = np.rint(joints[j] / e["resolution"][j]) * e["resolution"][j]


@kernel
def read_gyro(e, rate, noise, first):
    """The gyro's reading [rad/s] of the torso's rate; notes whether it was clipped."""
    seen = rate + e["bias"] + noise
    e["clipped"] = 1 if abs(seen) > e["range"] else 0
    seen = min(max(seen, -e["range"]), e["range"])
    e["unfiltered"] = seen
    e["filtered"] = seen if first else e["filtered"] + e["follow"] * (seen - e["filtered"])
    return e["filtered"]


@kernel
def fit_line(e, joints):
    """Fits the ground's line to the touching points seen from the torso, into `fit`; returns their number.

    Args:
        e: Estimator record.
        joints: (6,) joint angles [rad].
    """
    q, point, fit = e["q"], e["at"]["point"], e["fit"]
    for j in range(NU):
        q[BASE + j] = joints[j]
    forward(e["tree"], q, e["still"], 0.0, 0.0, e["at"])
    count, x, z = 0, 0.0, 0.0
    for i in range(N_POINTS):
        if e["touching"][i]:
            count, x, z = count + 1, x + point[i, 0], z + point[i, 1]
    if count == 0:
        return count
    x, z = x / count, z / count
    xx, xz, zz = 0.0, 0.0, 0.0
    for i in range(N_POINTS):
        if e["touching"][i]:
            dx, dz = point[i, 0] - x, point[i, 1] - z
            xx, xz, zz = xx + dx * dx, xz + dx * dz, zz + dz * dz
    fit[0], fit[1], fit[2] = -0.5 * math.atan2(2.0 * xz, xx - zz), x, z
    fit[3] = 2.0 * math.sqrt((xx + zz) / count)
    return count


@kernel
def estimate(e, noise, angle_noise, noted, q, v, log, k, late, joints, out_q, out_v):
    """Writes the coordinates and velocities that the robot infers at tick k, and what is noted of them.

    Args:
        e: `ESTIMATOR` record.
        noise: (n,) [rad/s] of the gyro.
        angle_noise: (n, 6) [rad] of the encoders; (0, 6) where there is none.
        noted: (n, NOTED) row k is written.
        q: (9,) true joint coordinates [m, rad] at tick k - late.
        v: (9,) true joint velocities then.
        log: (n, WIDTH) log; the row before that has its ground forces.
        k: Number of the tick.
        late: How many ticks ago what the sensors say was; what they say first is the start.
        joints: (6,) work space.
        out_q: (9,) inferred coordinates; those of the tick before, overwritten.
        out_v: (9,) inferred velocities; likewise.
    """
    dt = e["tick"]
    seen = max(0, k - late)
    first = seen == 0
    read_switches(e, q, v, log, seen)
    read_encoders(e, q, angle_noise, k, joints)
    gyro = read_gyro(e, v[PITCH], noise[k], first)
    if first:  # two accelerometers and a robot at rest: the start is known
        for j in range(NQ):
            out_q[j], out_v[j] = q[j], v[j]
        for j in range(NU):
            e["before"][j] = joints[j]
        e["basis"], e["left"] = -1, 0.0
    count = fit_line(e, e["before"])
    fit = e["fit"]
    angle_before, x_before, z_before = fit[0], fit[1], fit[2]
    fit_line(e, joints)
    by_points = count >= 2 and fit[3] >= e["width"]
    basis = 0
    if by_points:
        for i in range(N_POINTS):
            basis += e["touching"][i] << i
    rate = (fit[0] - angle_before) / dt if by_points else gyro
    expected = out_q[PITCH] + gyro * dt
    angle = fit[0] if by_points else expected
    if basis != e["basis"] and not first:
        e["offset"], e["rate_offset"], e["left"] = expected - angle, out_v[PITCH] - rate, e["blend"]
    elif not by_points:
        e["offset"] = 0.0  # what is integrated has it in it
    share = e["left"] / e["blend"] if e["left"] > 0.0 else 0.0
    e["basis"] = basis
    e["left"] -= 1.0
    angle += share * e["offset"]
    rate += share * e["rate_offset"]
    if first:
        angle, rate = out_q[PITCH], out_v[PITCH]
    _carry(e, dt, count, angle, rate, x_before, z_before, out_q, out_v)
    for j in range(NU):
        out_q[BASE + j] = joints[j]
        if not first:
            out_v[BASE + j] = (joints[j] - e["before"][j]) / dt
        e["before"][j] = joints[j]
    noted[k, ANGLE], noted[k, RATE] = angle, rate
    noted[k, GYRO], noted[k, CLIPPED] = 0.0 if by_points else 1.0, e["clipped"]


@kernel
def _carry(e, dt, count, angle, rate, x_before, z_before, q, v):
    """Writes the torso's pitch, and its place and speed from the middle of what touches, at rest on the ground."""
    q[PITCH], v[PITCH] = angle, rate
    if count == 0:
        v[Z] -= GRAVITY * dt
        q[Z] += v[Z] * dt
    else:
        x, z = e["fit"][1], e["fit"][2]
        c, s = math.cos(angle), math.sin(angle)
        was = angle - rate * dt
        c_was, s_was = math.cos(was), math.sin(was)
        q[Z] = -(s * x + c * z)
        v[X] = (c_was * x_before - s_was * z_before - c * x + s * z) / dt
        v[Z] = (s_was * x_before + c_was * z_before - s * x - c * z) / dt
    q[X] += v[X] * dt


@kernel
def infer(estimator, law, q, v, log, k, out_q, out_v):
    """`estimate`, and the contacts into the law's record, where there is an estimator.

    Args:
        estimator: (`Inference`,), or () for none: a tuple's length is part of its type, so that loops are compiled
            with an estimator or without.
        law: (1,) `biped.control.planar.setup.CONTROL`.
        q: As for `estimate`; so are the rest.
        v: Likewise.
        log: Likewise.
        k: Likewise.
        out_q: Likewise.
        out_v: Likewise.
    """
    if len(estimator) == 0:
        return
    one = estimator[0]
    e, past = one.record[0], one.past
    size = past.shape[0]
    for i in range(size if k == 0 else 1):
        for j in range(NQ):
            past[(k + i) % size, 0, j] = q[j]
            past[(k + i) % size, 1, j] = v[j]
    oldest = past[(k + 1) % size]
    estimate(e, one.noise, one.angle_noise, one.noted, oldest[0], oldest[1], log, k, size - 1, one.joints, out_q, out_v)
    for i in range(N_POINTS):
        law[0]["switches"]["touching"][i] = e["touching"][i]


@kernel
def ground_under(estimator, height, lifted, under):
    """Writes the heights (4,) [m] that the ground under the points has, as the switches say that they touch or do not.

    Args:
        estimator: (`Inference`,), or () for none: then the ground has no heights but its own.
        height: (4,) of the points [m], at the instant of the switches.
        lifted: Least height [m] of a point that does not touch.
        under: (4,) result.
    """
    if len(estimator) == 0:
        return
    touching = estimator[0].record[0]["touching"]
    for i in range(N_POINTS):
        under[i] = height[i] if touching[i] else min(0.0, height[i] - lifted)


@kernel
def sensed_posture(estimator, k, q, places, out_q, out_v):
    """Writes the posture of the instant that is sensed, as it is seen from what is believed of it.

    Joint angles are the encoders', the torso's rate is the gyro's, its filter undone. The torso's angle and height
    follow from the points that touch, as far as they say them; its place from theirs, which is believed. What nobody
    says is what is believed.

    Args:
        estimator: (`Inference`,), or () for none.
        k: Number of the tick.
        q: (9,) believed joint coordinates at that instant.
        places: (4, 2) of the points at them, seen from the torso's origin.
        out_q: (9,) result.
        out_v: (9,) result, of which only the torso's rate is written.
    """
    if len(estimator) == 0:
        return
    one = estimator[0]
    e = one.record[0]
    angle = q[PITCH] if one.noted[k, GYRO] > 0.0 else e["fit"][0]
    count, ahead = 0, 0.0
    for i in range(N_POINTS):
        if e["touching"][i]:
            count, ahead = count + 1, ahead + places[i, 0]
    c, s = math.cos(angle), math.sin(angle)
    x, z = e["fit"][1], e["fit"][2]
    out_q[X] = q[X] + (ahead / count - (c * x - s * z) if count > 0 else 0.0)
    out_q[Z] = -(s * x + c * z) if count > 0 else q[Z]
    out_q[PITCH] = angle
    for j in range(NU):
        out_q[BASE + j] = one.joints[j]
    out_v[PITCH] = e["unfiltered"]  # two outputs of a filter whose cutoff is known say what went in
