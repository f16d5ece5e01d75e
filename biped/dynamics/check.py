"""Do the functions of a system agree with each other? A test for the ones a user wrote."""

import numpy as np
from numpy.typing import ArrayLike

from biped.base.errors import InputError
from biped.dynamics.system import ConstrainedSystem

STEP = 1e-6


def check_derivatives(system: ConstrainedSystem, t: float, q: ArrayLike, v: ArrayLike, tolerance: float = 1e-6) -> None:
    """Compare A, b_q, b_v (and the potential's force) with central differences in one state.

    The potential is compared only through the power of the forces at v = 0, so dissipation and drives that
    act on a resting system count as a disagreement: leave the potential out for those.

    Args:
        system: The system.
        t: Time [s].
        q: (n,) coordinates; they need not satisfy the constraints.
        v: (n,) velocities; take no zeros, so that every term shows.
        tolerance: Largest disagreement, relative to the largest entry of the function (or to 1).

    Raises:
        InputError: A function disagrees; the message names it, the entry and both values.
    """
    q, v = system.state("q", q), system.state("v", v)
    e = system.evaluate(t, q, v)
    columns = [
        (system.evaluate(t, q + dq, v).phi - system.evaluate(t, q - dq, v).phi) / (2 * STEP)
        for dq in STEP * np.eye(system.n)
    ]
    _compare(system, "A", e.A, np.reshape(columns, (system.n, system.m)).T, tolerance)
    later, earlier = system.evaluate(t + STEP, q, v), system.evaluate(t - STEP, q, v)
    _compare(system, "b_q", e.b_q, -(later.phi - earlier.phi) / (2 * STEP), tolerance)
    ahead, behind = (system.evaluate(t + h, q + h * v, v) for h in (STEP, -STEP))
    along = (ahead.phi_dot(v) - behind.phi_dot(v)) / (2 * STEP)
    _compare(system, "b_v", e.b_v, -along, tolerance)
    if system.has_potential:
        potential = system.potential_energy
        slope = [(potential(t, q + dq, v) - potential(t, q - dq, v)) / (2 * STEP) for dq in STEP * np.eye(system.n)]
        rest = system.evaluate(t, q, 0.0 * v).Q
        _compare(system, "force (against the potential)", rest, -np.array(slope), tolerance)


def _compare(system: ConstrainedSystem, name: str, given: np.ndarray, found: np.ndarray, tolerance: float) -> None:
    if given.size == 0:
        return
    gap = np.abs(given - found)
    if not gap.max() <= tolerance * max(1.0, np.abs(found).max()):
        place = np.unravel_index(np.argmax(np.where(np.isnan(gap), np.inf, gap)), gap.shape)
        where = ", ".join(str(int(i)) for i in place)
        raise InputError(f"{system.name}: {name}[{where}] is {given[place]:g}, but differences give {found[place]:g}")
