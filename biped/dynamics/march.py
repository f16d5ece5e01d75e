"""The loop that takes a system from step to step: compiled once, for every system and every scheme."""

from typing import NamedTuple

import numpy as np

from biped.base.jit import kernel
from biped.dynamics.linalg import apply_w, copy, factor
from biped.dynamics.stages import (
    EMBEDDED,
    PROJECTED,
    enter_stage,
    error_norm,
    find_lag,
    find_rates,
    largest,
    leave_step,
    scale_to_energy,
    zero,
)

OK, INDEFINITE, NOT_FINITE, NOT_PROJECTED, TOO_MANY_RETRIES, UNSETTLED = range(6)
"""How a march can end."""

PROJECTIONS = 30  # Newton iterations of a projection
PROJECTED_TO = 1e-14  # and the relative motion of q that ends them
RETRIES = 30  # refusals of one adaptive step
MOST_STEPS = 1_000_000  # of an adaptive run
CUTS = (0.382, 0.618, 0.236, 0.764)  # where a step is parted to keep its stages off a singularity
LEAVE = 0.1  # part of a step that leaves a singular start: less, and rounding errors grow
GUARD = 1e-2  # pivot ratio below which an adaptive step may fail its error test
WAIVED = 1e-2  # and the relative error it may then make
LARGE = 0.1  # correction, as a part of the step's motion, that must shrink
PATIENCE = 6  # steps that it may fail to


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
    ratio, rank, other_rank = 1.0, 0, 0
    size, last_size, first_size, motion = 0.0, np.inf, np.inf, np.inf
    tries = cuts = unsettled = 0
    best_step = best_ratio = 0.0
    while True:
        nearest = np.inf
        failure = OK
        for s in range(first, stages):
            ts = t + tableau.c[s] * step
            enter_stage(s, step, tableau, q, v, room)
            before, size = np.inf, 0.0
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
                size = max(size, moved)
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
                ratio, rank, other_rank = w.ratio[0], w.rank[0], w.rank[0]
                if settings.correction == EMBEDDED:
                    apply_w(room.phi, w, room.fix_q)
                    for i in range(q.shape[0]):
                        room.fix_q[i] *= -1.0
                    size = largest(room.fix_q)
                # A start off the constraints is pulled in, less at every step; a step too long for the motion
                # leaves as large an error as it mends, again and again.
                lasting = size > LARGE * motion and size > 0.9 * last_size
                unsettled = unsettled + 1 if lasting else max(unsettled - 1, 0)
                if not adaptive and (unsettled == PATIENCE or (k == grid.steps and lasting and size > first_size)):
                    return UNSETTLED, t
                first_size = size if out.count[TAKEN] == 0 else first_size
                last_size = size
                on_grid = t == grid.t + k * grid.dt
                keep(on_grid and (k % grid.every == 0 or k == grid.steps), t, q, v, room, out)
                if k == grid.steps:
                    return OK, t
            elif failure == OK:
                nearest = min(nearest, w.ratio[0])
                other_rank = max(other_rank, w.rank[0])
            if failure == OK and not find_rates(s, settings, room):
                failure = NOT_FINITE
            if failure != OK:
                break
        if failure != OK and (first == 0 or not adaptive):
            copy(room.q, q)
            copy(room.v, v)
            return failure, ts
        first = 1
        # Standing on a singularity, forces that exist a hair beside it are not seen: leave by a short step.
        if failure == OK and rank < other_rank and step == whole and cuts < 2:
            step, cuts = LEAVE * whole, 2
            continue
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
            near = min(nearest, ratio) < GUARD
            if error <= 1.0:
                passed = passed if near else step
                longer = step * min(5.0, 0.9 * max(error, 1e-12) ** (-1.0 / 8.0))
                h = max(h, longer) if tries == 0 and step < h else longer
            elif near and step <= passed and error * settings.rtol < WAIVED:
                # So near a singularity the estimate is noise, and more noise with shorter steps: keep the
                # step that was right before.
                h = step
            else:
                out.count[REFUSED] += 1
                tries += 1
                shorter = step * max(0.2, 0.9 * error ** (-1.0 / 8.0))
                step = passed if near and step > passed else shorter
                if tries > RETRIES or step < 1e-14 * max(abs(t), grid.dt) or out.count[TAKEN] > MOST_STEPS:
                    return TOO_MANY_RETRIES, t
                continue
        elif not finite:
            return NOT_FINITE, t
        motion = 0.0
        for i in range(q.shape[0]):
            motion = max(motion, abs(room.q[i] - q[i]))
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
