"""One step of a scheme, stage by stage: everything in it but the calls of the system's functions."""

from typing import NamedTuple

import numpy as np

from biped.base.jit import kernel
from biped.dynamics.linalg import Workspace, apply_w, copy, dot, solve_mass, workspace
from biped.dynamics.schemes import Correction

NONE, EMBEDDED, BAUMGARTE, PROJECTED = (int(c) for c in Correction)


class Room(NamedTuple):
    """Everything the march writes on its way, so that it allocates nothing."""

    M: np.ndarray  # (n, n)
    A: np.ndarray  # (m, n)
    Q: np.ndarray  # (n,)
    phi: np.ndarray  # (m,)
    b_q: np.ndarray  # (m,)
    b_v: np.ndarray  # (m,) of a stage, then what C⁺ is applied to
    lag: np.ndarray  # (m,) b_q − A v = −Φ̇
    a: np.ndarray  # (n,) M⁻¹Q
    x: np.ndarray  # (n,) W times something
    q: np.ndarray  # (n,) of a stage
    v: np.ndarray  # (n,) of a stage
    rate_q: np.ndarray  # (s, n) q̇ of the stages
    rate_v: np.ndarray  # (s, n) v̇ of the stages
    fix_q: np.ndarray  # (n,) −WΦ of the step's start
    fix_v: np.ndarray  # (n,) −WΦ̇ of the step's start
    factors: Workspace


def room(n: int, m: int, stages: int) -> Room:
    """Room for a system of n coordinates and m constraints under a scheme of so many stages."""
    shapes = ((n, n), (m, n), n, m, m, m, m, n, n, n, n, (stages, n), (stages, n), n, n)
    return Room._make([*(np.zeros(shape) for shape in shapes), workspace(n, m)])


@kernel
def zero(x):
    """Write zeros into every row of x."""
    for i in range(x.shape[0]):
        for j in range(x.shape[1]):
            x[i, j] = 0.0


@kernel
def largest(x):
    """Largest magnitude in x; nan if there is a nan."""
    s = 0.0
    for i in range(x.shape[0]):
        if np.isnan(x[i]):
            return np.nan
        s = max(s, abs(x[i]))
    return s


@kernel
def find_lag(room):
    """room.lag = b_q − A v, of the stage."""
    for i in range(room.lag.shape[0]):
        room.lag[i] = room.b_q[i] - dot(room.A[i], room.v)


@kernel
def scale_to_energy(energy, potential, room):
    """Scale v so that ½vᵀMv + V = energy, where that is a small change; return the energy held."""
    kinetic = 0.0
    for i in range(room.v.shape[0]):
        kinetic += 0.5 * room.v[i] * dot(room.M[i], room.v)
    if np.isnan(energy):
        return kinetic + potential
    if kinetic > 0.0:
        square = (energy - potential) / kinetic
        # At a turning point the kinetic energy is smaller than its error: nothing to be learnt there.
        if 0.81 < square < 1.21:
            for i in range(room.v.shape[0]):
                room.v[i] *= np.sqrt(square)
            find_lag(room)
    return energy


@kernel
def enter_stage(s, step, tableau, q, v, room):
    """room.q, room.v = the state in which stage s is evaluated."""
    copy(q, room.q)
    copy(v, room.v)
    for j in range(s):
        weight = step * tableau.A[s, j]
        if weight != 0.0:
            for i in range(q.shape[0]):
                room.q[i] += weight * room.rate_q[j, i]
                room.v[i] += weight * room.rate_v[j, i]


@kernel
def find_rates(s, settings, room):
    """Rates of stage s from its evaluation, −WΦ̇ if it is the step's first; False if they are not finite."""
    n, m = room.q.shape[0], room.lag.shape[0]
    w = room.factors
    solve_mass(room.Q, w, room.a)
    for i in range(m):
        room.b_v[i] -= dot(room.A[i], room.a)
        if settings.correction == BAUMGARTE:
            room.b_v[i] += 2.0 * settings.alpha * room.lag[i] - settings.beta**2 * room.phi[i]
    apply_w(room.b_v, w, room.x)
    for i in range(n):
        room.rate_q[s, i] = room.v[i]
        room.rate_v[s, i] = room.a[i] + room.x[i]
    if settings.correction == EMBEDDED:
        apply_w(room.lag, w, room.x)
        for i in range(n):
            room.rate_q[s, i] += room.x[i]
        if s == 0:
            copy(room.x, room.fix_v)
    return np.isfinite(largest(room.rate_q[s]) + largest(room.rate_v[s]))


@kernel
def leave_step(step, tableau, q, v, room):
    """room.q, room.v = the state at the end of the step; False if it is not finite."""
    for i in range(q.shape[0]):
        dq = dv = 0.0
        for s in range(tableau.b.shape[0]):
            dq += tableau.b[s] * room.rate_q[s, i]
            dv += tableau.b[s] * room.rate_v[s, i]
        room.q[i] = q[i] + (step * dq + room.fix_q[i])
        room.v[i] = v[i] + (step * dv + room.fix_v[i])
    return np.isfinite(largest(room.q) + largest(room.v))


@kernel
def error_norm(step, tableau, settings, q, v, room):
    """Size of the step's error in units of the tolerance, from two embedded estimates (as in DOP853)."""
    fifth = third = 0.0
    for i in range(q.shape[0]):
        for rate, old, new in ((room.rate_q, q, room.q), (room.rate_v, v, room.v)):
            scale = settings.atol + settings.rtol * max(abs(old[i]), abs(new[i]))
            e5 = e3 = 0.0
            for s in range(rate.shape[0]):
                e5 += tableau.E[0, s] * rate[s, i]
                e3 += tableau.E[1, s] * rate[s, i]
            fifth += (e5 / scale) ** 2
            third += (e3 / scale) ** 2
    if fifth == 0.0:
        return 0.0
    return abs(step) * fifth / np.sqrt((fifth + 0.01 * third) * 2 * q.shape[0])
