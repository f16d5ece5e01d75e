"""The loop that takes a system from step to step: compiled once, for every system and every scheme."""

from typing import NamedTuple

import numpy as np

from biped.dynamics.jit import kernel
from biped.dynamics.linalg import Workspace, apply_w, copy, dot, factor, solve_mass, workspace
from biped.dynamics.schemes import Correction

NONE, EMBEDDED, BAUMGARTE, PROJECTED = (int(c) for c in Correction)

OK, INDEFINITE, NOT_FINITE, NOT_PROJECTED, TOO_MANY_RETRIES = range(5)
"""How a march can end."""

PROJECTIONS = 30
PROJECTED_TO = 1e-14
RETRIES = 30
MOST_STEPS = 10_000_000
CUTS = (0.382, 0.618, 0.236, 0.764)
GUARD = 1e-2


KEPT, TAKEN, EVALUATED, SPLIT, REFUSED = range(5)
"""What `Samples.count` counts."""


class Grid(NamedTuple):
    """Where samples are asked for."""

    t: float  # [s] start
    dt: float  # [s] step, or the longest one when adaptive
    steps: int
    every: int  # a sample is kept every so many steps


class Samples(NamedTuple):
    """What is kept along the way, K = steps/every + 1 samples."""

    t: np.ndarray  # (K,) [s]
    q: np.ndarray  # (K, n)
    v: np.ndarray  # (K, n)
    phi: np.ndarray  # (K,) largest |Φ| since the sample before
    phi_dot: np.ndarray  # (K,) largest |Φ̇| since the sample before
    ratio: np.ndarray  # (K,) smallest pivot ratio since the sample before
    rank: np.ndarray  # (K,) smallest rank of the constraints since the sample before
    count: np.ndarray  # (5,) samples kept, steps taken, evaluations, steps split, steps refused


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
    return Room(*(np.zeros(shape) for shape in shapes), workspace(n, m))


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
    """Rates of stage s from its evaluation, and the step's corrections if it is the first; False if not finite."""
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
    if settings.correction == EMBEDDED and m > 0:
        apply_w(room.lag, w, room.x)
        for i in range(n):
            room.rate_q[s, i] += room.x[i]
        if s == 0:
            copy(room.x, room.fix_v)
            apply_w(room.phi, w, room.fix_q)
            for i in range(n):
                room.fix_q[i] *= -1.0
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


@kernel
def keep(arrived, t, q, v, room, out):
    """Note how well the state satisfies the constraints; keep it as a sample if it has arrived at one."""
    i = out.count[KEPT]
    out.phi[i] = max(out.phi[i], largest(room.phi))
    out.phi_dot[i] = max(out.phi_dot[i], largest(room.lag))
    out.ratio[i] = min(out.ratio[i], room.factors.ratio[0])
    out.rank[i] = min(out.rank[i], room.factors.rank[0])
    if arrived:
        out.t[i] = t
        copy(q, out.q[i])
        copy(v, out.v[i])
        out.count[KEPT] += 1


def march(mass, force, phi, A, b_q, b_v, potential, p, grid, settings, tableau, q, v, room, out):
    """March from (q, v) along the grid; q and v end as the last state, or the one that failed.

    Every function of the system is called in one place, so that this same code runs compiled on compiled
    functions and as plain Python on plain ones.

    Returns:
        One of the codes above and the time it was reached [s].
    """
    w = room.factors
    stages = tableau.b.shape[0]
    adaptive = settings.rtol > 0.0
    t, ts, k, first = grid.t, grid.t, 0, 0
    h = grid.dt * 1e-3 if adaptive else grid.dt
    step = whole = passed = h
    end = grid.t + grid.dt
    reaching = not adaptive
    energy = np.nan
    ratio = 1.0
    tries = cuts = 0
    best_step = best_ratio = 0.0
    while True:
        nearest = np.inf
        failure = OK
        for s in range(first, stages):
            ts = t + tableau.c[s] * step
            enter_stage(s, step, tableau, q, v, room)
            before = np.inf
            for iteration in range(PROJECTIONS + 1):
                zero(room.M)
                zero(room.A)
                for x in (room.Q, room.phi, room.b_q, room.b_v):
                    for i in range(x.shape[0]):
                        x[i] = 0.0
                mass(ts, room.q, room.v, p, room.M)
                force(ts, room.q, room.v, p, room.Q)
                phi(ts, room.q, room.v, p, room.phi)
                A(ts, room.q, room.v, p, room.A)
                b_q(ts, room.q, room.v, p, room.b_q)
                b_v(ts, room.q, room.v, p, room.b_v)
                out.count[EVALUATED] += 1
                if not factor(room.M, room.A, w):
                    failure = INDEFINITE
                    break
                find_lag(room)
                if s > 0 or settings.correction != PROJECTED:
                    break
                apply_w(room.phi, w, room.x)
                moved = largest(room.x)
                # Close to a singularity rounding alone moves q by more than the tolerance: stop there, too.
                if moved <= PROJECTED_TO * (1.0 + largest(room.q)) or 0.5 * before <= moved < 1e-6:
                    apply_w(room.lag, w, room.x)
                    for i in range(q.shape[0]):
                        room.v[i] += room.x[i]
                    find_lag(room)
                    break
                if iteration == PROJECTIONS or not np.isfinite(moved):
                    failure = NOT_PROJECTED
                    break
                for i in range(q.shape[0]):
                    room.q[i] -= room.x[i]
                before = moved
            if failure == OK and s == 0:
                if settings.energy:
                    energy = scale_to_energy(energy, potential(ts, room.q, room.v, p), room)
                copy(room.q, q)
                copy(room.v, v)
                ratio = w.ratio[0]
                on_grid = t == grid.t + k * grid.dt
                keep(on_grid and (k % grid.every == 0 or k == grid.steps), t, q, v, room, out)
                if k == grid.steps:
                    return OK, t
            elif failure == OK:
                nearest = min(nearest, w.ratio[0])
            if failure == OK and not find_rates(s, settings, room):
                failure = NOT_FINITE
            if failure != OK:
                break
        if failure != OK and (first == 0 or not adaptive):
            copy(room.q, q)
            copy(room.v, v)
            return failure, ts
        first = 1
        # Leave a singularity between two stages, not under one: there rounding errors grow like 1/ratio².
        if failure == OK and nearest < settings.split and nearest < 0.1 * ratio and cuts < 2:
            if tries == 0:
                best_ratio = -1.0
            if nearest > best_ratio:
                best_step, best_ratio = step, nearest
            if tries < len(CUTS):
                step = whole * CUTS[tries]
                tries += 1
                continue
            cuts = 2
            if step != best_step:
                step = best_step
                continue
        finite = failure == OK and leave_step(step, tableau, q, v, room)
        if adaptive:
            error = error_norm(step, tableau, settings, q, v, room) if finite else np.inf
            if error <= 1.0:
                passed = step
                longer = step * min(5.0, 0.9 * max(error, 1e-12) ** (-1.0 / 8.0))
                h = max(h, longer) if tries == 0 and step < h else longer
            elif finite and min(nearest, ratio) < GUARD and step < 0.1 * passed:
                h = step  # so near a singularity the estimate is noise: keep the step, waive the test
            else:
                out.count[REFUSED] += 1
                tries += 1
                step *= max(0.2, 0.9 * error ** (-1.0 / 8.0))
                if tries > RETRIES or step < 1e-14 * max(abs(t), grid.dt) or out.count[TAKEN] > MOST_STEPS:
                    return TOO_MANY_RETRIES, t
                continue
        elif not finite:
            return NOT_FINITE, t
        copy(room.q, q)
        copy(room.v, v)
        out.count[TAKEN] += 1
        if reaching and step == whole:
            t, cuts = end, 0
            k += 1
        else:
            t += step
            cuts = 0 if adaptive else cuts + 1
            out.count[SPLIT] += not adaptive
        tries = first = 0
        end = grid.t + (k + 1) * grid.dt
        # A step along the grid is dt, not a rounded difference of times: that would lose time, step by step.
        rest = grid.dt if t == grid.t + k * grid.dt else end - t
        reaching = not adaptive or h >= rest
        step = whole = rest if reaching else h
