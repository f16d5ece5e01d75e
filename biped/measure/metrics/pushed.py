"""Metrics of a push and of the walk's return from it: impulse in the field's units, recovery time, the next steps.

Only of runs that are pushed; nothing here is computed for others.

How much of what any controller could survive a push is, is the bound of the linear inverted pendulum that steps. The
extrapolated centre of mass ξ of a pendulum of constant height z runs away from the centre of pressure p, ξ' = (ξ -
p) / τ with τ = √(z/g). It stays within bounds if and only if ∫ p(s) exp(-s/τ) ds/τ from now on is ξ, and p is within a
foot's radius of feet that are `reach` apart at most and a `step` in time at least. The farthest ξ that can be caught
is therefore known in closed form (T. Koolen, T. de Boer, J. Rebula, A. Goswami, J. Pratt, Int. J. Robot. Res. 31:1094,
2012: the pendulum with a finite foot). A force for a time counts as the ξ that it adds, discounted likewise.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from biped.measure.metrics.gait import heels
from biped.measure.pushes import declared
from biped.measure.trajectory import Trajectory
from biped.robot.ground import GRAVITY
from biped.robot.planar.tree import motion

LEAST_STEPS = 3
"""Steps before a push, from which the time of a step is known."""
LONGEST = 1.0
"""[s] of a push; what lasts longer is no push that steps of the usual time answer."""


def capture_radius(foot: float, reach: float, step: float, left: float | None = None, steps: float = math.inf) -> float:
    """How far from the middle of the standing foot an extrapolated centre of mass can be caught.

    Args:
        foot: Radius of a foot, in heights z of the centre of mass.
        reach: Longest step, likewise.
        step: Least time of a step, in √(z/g).
        left: Until the first strike, likewise; default: a whole step.
        steps: How many there may be; 0: it must be caught by the foot.
    """
    shrink = math.exp(-step)
    strikes = 1.0 / (1.0 - shrink) if math.isinf(steps) else (1.0 - shrink**steps) / (1.0 - shrink)
    return foot + reach * math.exp(-(step if left is None else left)) * strikes


def largest_push(centre: np.ndarray, foot: np.ndarray, radius: float, way: np.ndarray) -> float:
    """How far ξ can be moved in a direction and still be caught.

    Args:
        centre: (2,) ξ.
        foot: (2,) the middle of the standing foot.
        radius: Within which ξ can be caught.
        way: (2,) direction, of length one.

    Returns:
        0 where it cannot be caught as it is.
    """
    off = centre - foot
    along = float(off @ way)
    across = float(off @ off) - along**2
    return max(0.0, math.sqrt(radius**2 - across) - along) if across < radius**2 else 0.0


def push_share(t: Trajectory, start: float, end: float, impulse: Sequence[float]) -> float:
    """A push over the largest of its kind that any controller could survive with steps of a leg length.

    The time of a step is the median of those before the push; a pendulum is as high as the centre of mass when the push
    begins. Feet are discs about the middles of their contact points, and may cross.

    Args:
        t: The run.
        start: [s] when the push begins.
        end: [s] when it ends.
        impulse: [N s] forward, to the left and up.

    Returns:
        nan of a push that is straight up or down, too long, before there were steps, in the air, or that begins within
        the last tick of a run and so never acts.
    """
    row = round(start / t.tick)
    if row >= len(t):
        return math.nan
    flat = np.array(impulse[:2])
    before = [at for at, _ in t.strikes if at <= row]
    size = float(np.linalg.norm(flat))
    if size == 0.0 or end - start > LONGEST or len(before) <= LEAST_STEPS or not t.down[row].any():
        return math.nan
    height, (along, aside, normal) = float(t.com_above[row]), t.gravity
    if height <= 0.0:
        return math.nan
    tau = math.sqrt(height / -normal)
    # On a slope the pendulum is upright where it leans against gravity.
    moving = t.com[row, :2] + tau * t.com_velocity[row, :2] + tau**2 * np.array([along, aside])
    step = float(np.median(np.diff(before))) * t.tick / tau
    left = max(0.0, step - (row - before[-1]) * t.tick / tau)
    most = 0.0
    for number in np.flatnonzero(t.down[row]):
        points = t.point[row, t.robot.of_foot == number, :2]
        middle = points.mean(axis=0)
        foot = float(np.linalg.norm(points - middle, axis=1).max())
        radius = height * capture_radius(foot / height, t.robot.leg / height, step, left)
        most = max(most, largest_push(moving, middle, radius, flat / size))
    lasting = (end - start) / tau
    moved = size / t.mass * tau * -math.expm1(-lasting) / lasting
    return moved / most if most > 0.0 else math.nan


STEPS = 4
"""Steps after a push whose lengths are metrics."""
BEFORE, LEAST = 8, 3
"""Steps before a push that it is compared with at most, and at least."""
BAND = 0.1
"""A step is as before if its speed is within this share of the mean before, or two standard deviations if more."""
STEP_NAMES = ("first_step", "second_step", "third_step", "fourth_step")


class Impact(NamedTuple):
    """Pushes that are one, however their force changes meanwhile.

    Attributes:
        start: [s].
        end: [s].
        impulse: [N s] forward, to the left and up.
    """

    start: float
    end: float
    impulse: tuple[float, ...]

    @property
    def size(self) -> float:
        """[N s] with the sign of its way: of the first of its components that it has, forward positive."""
        return math.copysign(math.hypot(*self.impulse), next((one for one in self.impulse if one), 0.0))


def merged(pushes: Sequence[tuple[float, float, Sequence[float]]], ends: float, tick: float) -> list[Impact]:
    """Pushes as impulses; those that touch or overlap in time are one.

    Where one ends as another against it begins they are two: every half wave of a sine is one.

    Args:
        pushes: (start [s], end [s], force [N]).
        ends: [s] when the run does; what lies beyond is not counted.
        tick: [s].
    """
    found: list[Impact] = []
    for start, end, force in sorted(pushes, key=lambda push: push[:2]):
        end = min(end, ends)  # noqa: PLW2901
        if end <= start:
            continue
        impulse = tuple(one * (end - start) for one in force)
        if found and start <= found[-1].end + 0.5 * tick and not _turns(found[-1], start, force, tick):
            last = found.pop()
            both = tuple(a + b for a, b in zip(last.impulse, impulse, strict=True))
            found.append(Impact(last.start, max(last.end, end), both))
        else:
            found.append(Impact(start, end, impulse))
    return found


def _turns(last: Impact, start: float, force: Sequence[float], tick: float) -> bool:
    """Whether a force that begins at `start` [s] does so where the last push ends, and is against it."""
    against = sum(a * b for a, b in zip(force, last.impulse, strict=True)) < 0.0
    return start > last.end - 0.5 * tick and against


def impulses(t: Trajectory) -> list[Impact]:
    """The pushes of a run; those that touch or overlap in time are one. What lies beyond its end is not counted."""
    return merged([push[:3] for push in declared(t)], len(t) * t.tick, t.tick)


def pushed(t: Trajectory) -> dict[str, float]:
    """Impulse of the strongest push, the recovery from the last one, and the steps after that.

    A step lasts from foot strike to foot strike; its speed is how far the torso went in it. The walk has recovered when
    every step from then to the end of the run is as before the push (`BAND`), two of them at least. There is no
    recovery time where there were fewer than `LEAST` steps before, or where the walk does not recover; it is 0 where
    the walk never left.
    """
    found = impulses(t)
    if not found:
        return {}
    hardest = max(found, key=lambda push: abs(push.size))
    strongest = hardest.size
    rows = np.array([row for row, _ in t.strikes], dtype=int)
    heel = heels(t, rows)
    lengths = np.abs(heel[:, 0] - heel[:, 1])
    after = lengths[t.time[rows] >= found[-1].end - 1e-9][:STEPS]
    return {
        "push_impulse": strongest,
        "push_speed": strongest / t.mass,
        "push_froude": strongest / (t.mass * math.sqrt(GRAVITY * t.robot.leg)),
        "push_share": push_share(t, hardest.start, hardest.end, hardest.impulse),
        "recovery_time": recovery(t.x, t.time, t.tick, rows, found[0].start, found[-1].end)
        if t.end == "completed"
        else math.nan,
        **dict(zip(STEP_NAMES, (float(length) for length in after), strict=False)),
    }


def push_work(t: Trajectory) -> float:
    """Work [J] of the pushes on seven links: what they have to absorb.

    A force F over a step adds F · (v + v')/2 · dt, with the mean velocity at the first configuration.
    """
    c, s = math.cos(math.radians(t.slope)), math.sin(math.radians(t.slope))
    moved = motion(t.tree, t.q[:-1], 0.5 * (t.v[:-1] + t.v[1:])).com_velocity
    work = 0.0
    for push in declared(t):
        if push.body in t.robot.bodies:
            forward, _, up = push.force
            force = np.array([forward * c + up * s, up * c - forward * s])
            rows = slice(round(push.start / t.tick), round(push.end / t.tick))
            work += float((moved[rows, t.robot.bodies.index(push.body)] @ force).sum()) * t.tick
    return work


def recovery(x: np.ndarray, time: np.ndarray, tick: float, rows: np.ndarray, start: float, end: float) -> float:
    """[s] from the end of the last push to the first step from which on all are as before the first push.

    Args:
        x: (n,) [m] along the ground.
        time: (n,) [s].
        tick: [s] between rows.
        rows: Of the foot strikes.
        start: [s] when the first push begins.
        end: [s] when the last one ends.
    """
    if len(rows) < 2:
        return math.nan
    speed = np.diff(x[rows]) / (np.diff(rows) * tick)
    begins, ends = time[rows[:-1]], time[rows[1:]]
    before = speed[ends <= start + 1e-9][-BEFORE:]
    later = begins >= end - 1e-9
    if len(before) < LEAST or later.sum() < 2:
        return math.nan
    band = max(BAND * abs(float(before.mean())), 2.0 * float(before.std(ddof=1)))
    off = np.abs(speed[later] - before.mean()) > band
    steady = len(off) - int(np.argmax(off[::-1])) if off.any() else 0  # first of the steps that stay within the band
    if len(off) - steady < 2:
        return math.nan
    # The step in which the push ended, too, may be one of those before.
    during = (ends > start + 1e-9) & ~later
    if steady == 0 and not (np.abs(speed[during] - before.mean()) > band).any():
        return 0.0
    return float(begins[later][steady] - end)
