"""How much of what any controller could survive a push is: the bound of the linear inverted pendulum that steps.

The extrapolated centre of mass ξ of a pendulum of constant height z runs away from the centre of pressure p, ξ' = (ξ -
p) / τ with τ = √(z/g). It stays within bounds if and only if ∫ p(s) exp(-s/τ) ds/τ from now on is ξ, and p is within a
foot's radius of feet that are `reach` apart at most and a `step` in time at least. The farthest ξ that can be caught
is therefore known in closed form (T. Koolen, T. de Boer, J. Rebula, A. Goswami, J. Pratt, Int. J. Robot. Res. 31:1094,
2012: the pendulum with a finite foot). A force for a time counts as the ξ that it adds, discounted likewise.
"""

import math
from collections.abc import Sequence

import numpy as np

from biped.measure.trajectory import Trajectory

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
        impulse: [N s] forward and up; in space forward, to the left and up.

    Returns:
        nan of a push that is straight up or down, too long, before there were steps, or in the air.
    """
    row = round(start / t.tick)
    flat = np.array([impulse[0], impulse[1] if len(impulse) > 2 else 0.0])
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
