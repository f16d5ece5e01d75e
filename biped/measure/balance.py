"""Balance on level ground: support phases, base of support, capture point, foot placement estimator, angular momentum.

Definitions are those of EuroBench's indicators for humanoids (eb_hum_bench), in a plane.
"""

from typing import NamedTuple

import numpy as np

from biped.measure.trajectory import Trajectory
from biped.robot.gravity import GRAVITY
from biped.robot.planar.topology import ENDS, LEGS
from biped.robot.planar.tree import motion

FLIGHT, FL_SINGLE, FR_SINGLE, FL_DOUBLE, FR_DOUBLE = range(5)
"""Support phases: none; the left or the right foot alone; both, after the left or the right alone."""
PHASES = {
    "fl_single": FL_SINGLE, "fr_single": FR_SINGLE, "fl_double": FL_DOUBLE, "fr_double": FR_DOUBLE,
}  # fmt: skip
"""By EuroBench's names. The first leg is the right one."""


class Balance(NamedTuple):
    """Measures of balance, at every row.

    Attributes:
        phase: (n,) support phases.
        com: (n, 2) [m] centre of mass, forward and up.
        velocity: (n, 2) [m/s] of it.
        spin: (n,) [N m s] angular momentum about it, anticlockwise seen from the right.
        back: (n,) [m] rear end of the base of support; nan in flight.
        front: (n,) [m] its front end.
        capture: (n,) [m] capture point, where the linear inverted pendulum would come to rest.
        placement: (n,) [m] foot placement estimator; nan where there is none.
    """

    phase: np.ndarray
    com: np.ndarray
    velocity: np.ndarray
    spin: np.ndarray
    back: np.ndarray
    front: np.ndarray
    capture: np.ndarray
    placement: np.ndarray

    def inside(self, place: np.ndarray) -> np.ndarray:
        """(n,) [m] distance of places (n,) to the nearer end of the base of support, negative beyond it."""
        return np.minimum(place - self.back, self.front - place)

    @property
    def margin(self) -> np.ndarray:
        """(n,) [m] margin of stability: front of the base of support less the capture point (A. Hof, 2005)."""
        return self.front - self.capture


def balance(t: Trajectory) -> Balance:
    """Balance of a run on level ground."""
    whole = motion(t.tree, t.q, t.v)
    mass, total = t.tree.mass, float(t.tree.mass.sum())
    com, velocity = t.com[:, [0, 2]], t.com_velocity[:, [0, 2]]
    r, w = whole.com - com[:, None], whole.com_velocity - velocity[:, None]
    spin = whole.rate @ t.tree.inertia + (r[..., 0] * w[..., 1] - r[..., 1] * w[..., 0]) @ mass
    inertia = t.tree.inertia.sum() + (r**2).sum(axis=-1) @ mass
    on = t.down
    x = whole.point[..., 0].reshape(-1, LEGS, ENDS)
    standing = np.repeat(on[..., None], ENDS, axis=2)
    with np.errstate(all="ignore"):
        back = np.where(standing, x, np.inf).min(axis=(1, 2))
        front = np.where(standing, x, -np.inf).max(axis=(1, 2))
    air = ~(on[:, 0] | on[:, 1])
    back[air] = front[air] = np.nan
    capture = com[:, 0] + velocity[:, 0] * np.sqrt(np.maximum(com[:, 1], 0.0) / GRAVITY)
    placement = com[:, 0] + com[:, 1] * np.tan(placement_angle(total, inertia, com[:, 1], velocity, spin))
    return Balance(_phases(on), com, velocity, spin, back, front, capture, placement)


def _phases(on: np.ndarray) -> np.ndarray:
    """Support phases (n,) of feet (n, 2) on the ground, right and left; double support at the start is the right's."""
    out = np.full(len(on), FLIGHT)
    out[on[:, 0] & ~on[:, 1]] = FR_SINGLE
    out[on[:, 1] & ~on[:, 0]] = FL_SINGLE
    single = np.where(np.isin(out, (FL_SINGLE, FR_SINGLE)), np.arange(len(on)), -1)
    latest = np.maximum.accumulate(single)
    after_left = (latest >= 0) & (out[np.maximum(latest, 0)] == FL_SINGLE)
    both = on.all(axis=1)
    out[both] = np.where(after_left[both], FL_DOUBLE, FR_DOUBLE)
    return out


def placement_angle(
    mass: float, inertia: np.ndarray, height: np.ndarray, velocity: np.ndarray, spin: np.ndarray
) -> np.ndarray:
    """Angle [rad] from the vertical at which a foot brings the biped to rest upright over it, forward positive.

    The foot keeps the angular momentum about its place; what energy is left just suffices to reach the top (D. Wight,
    E. Kubica, D. Wang, J. Comput. Nonlinear Dyn. 3, 2008, equation (11)):

        [m h (v_x cos φ + v_z sin φ) + I θ̇ cos φ]² cos² φ / (m h² + I cos² φ) = 2 m g h cos φ (1 - cos φ)

    Args:
        mass: [kg].
        inertia: (n,) [kg m²] about the centre of mass.
        height: (n,) [m] of the centre of mass.
        velocity: (n, 2) [m/s] forward and up.
        spin: (n,) [N m s] I θ̇ anticlockwise.

    Returns:
        (n,) the smallest such angle; nan where there is none below 80°.
    """
    way = np.where(mass * height * velocity[:, 0] - spin < 0.0, -1.0, 1.0)
    forward, turning = way * velocity[:, 0], -way * spin

    def left(angle: np.ndarray) -> np.ndarray:
        c, s = np.cos(angle), np.sin(angle)
        kept = (mass * height * (forward * c + velocity[:, 1] * s) + turning * c) * c
        return kept**2 / (mass * height**2 + inertia * c * c) - 2.0 * mass * GRAVITY * height * c * (1.0 - c)

    low = np.zeros(len(height))
    high = np.full(len(height), np.nan)
    for angle in np.radians(np.arange(1.0, 81.0)):
        below = np.isnan(high) & (left(np.full(len(height), angle)) <= 0.0)
        high[below], low[below] = angle, angle - np.radians(1.0)
    for _ in range(40):
        middle = 0.5 * (low + high)
        beyond = left(middle) <= 0.0
        high, low = np.where(beyond, middle, high), np.where(beyond, low, middle)
    return way * high


def spells(phase: np.ndarray, which: int) -> list[slice]:
    """The spells of a support phase as slices of rows; those cut by the start or the end of the run are left out."""
    inside = np.concatenate([[False], phase == which, [False]])
    edges = np.flatnonzero(np.diff(inside.astype(int)))
    return [
        slice(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2], strict=True) if a > 0 and b < len(phase)
    ]  # fmt: skip
