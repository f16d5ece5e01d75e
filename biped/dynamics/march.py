"""The loop that takes a system from step to step, compiled once for every system and every scheme, and its events."""

import numpy as np

from biped.base.jit import kernel
from biped.dynamics.compiled import EVENT, NOT_FINITE, NOT_PROJECTED, OK, SPILLED, TOO_MANY_RETRIES, UNSETTLED, shared
from biped.dynamics.orthogonal import copy
from biped.dynamics.reference import refer
from biped.dynamics.room import FIRED, PLACE, SPEED, SPLIT, TAKEN, Functions, keep, largest
from biped.dynamics.sparse import spilled
from biped.dynamics.stages import begin
from biped.dynamics.steps import advance, whole_step

TRIALS = 100  # steps that may be spent on finding one event
WITHIN = 1e-13  # part of the step that its time is found to


@kernel
def passed(before, after):
    """Whether an event function goes from one side of zero to the other, or reaches it."""
    return (before < 0.0 <= after) or (after <= 0.0 < before)


@kernel
def happened(before, after):
    """Whether any event function (e,) passes zero between two states."""
    for i in range(before.shape[0]):
        if passed(before[i], after[i]):
            return True
    return False


@kernel
def earliest(before, after):
    """Number of the function whose straight line between the values is zero first."""
    first, share = -1, 2.0
    for i in range(before.shape[0]):
        if passed(before[i], after[i]) and before[i] / (before[i] - after[i]) < share:
            first, share = i, before[i] / (before[i] - after[i])
    return first


@kernel
def halve(x):
    """Divide x by two."""
    for i in range(x.shape[0]):
        x[i] *= 0.5


@shared
def locate(f, t, p, step, ratio, rank, settings, tableau, q, v, room):
    """Shorten a step until it ends where the first event happens: steps from the same start, regula falsi.

    Returns:
        A code and the step; room holds its rates and its end.
    """
    low, high, done, side = 0.0, step, step, 0
    before, after, between = room.event[0], room.event[1], room.event[2]
    edge = 0.4 * WITHIN * step
    for trial in range(TRIALS):
        found = high - low <= WITHIN * step or trial == TRIALS - 1
        if found and done == high and trial > 0:
            break
        i = earliest(before, after)
        room.seen[FIRED] = i
        zero = low + before[i] / (before[i] - after[i]) * (high - low)
        done = high if found else min(max(zero, low + edge), high - edge)
        code, _, taken = whole_step(f, t, p, done, ratio, rank, settings, tableau, q, v, room)
        if code != OK or taken != done:
            return code if code != OK else NOT_PROJECTED, done
        if found:
            break
        f.event(t + done, room.c[PLACE], room.c[SPEED], p, between)
        if happened(before, between):
            high = done
            copy(between, after)
            # The end that stays twice counts half: without this, one end would stay for ever (Illinois).
            if side > 0:
                halve(before)
            side = 1
        else:
            low = done
            copy(between, before)
            if side < 0:
                halve(after)
            side = -1
    return OK, high


FIRST = 1e-3  # an adaptive scheme's first step, as a part of its longest
LARGE = 0.1  # correction, as a part of the step's motion, that must shrink
PATIENCE = 6  # steps that it may fail to
MOST_STEPS = 1_000_000  # of an adaptive run
ROUNDING = 1e-12  # relative size up to which a correction is none
OPEN = 1e-6  # relative size from which on a correction is no rounding error, however short an adaptive step


@kernel
def lasts(size, motion, last):
    """Whether a correction is large beside the motion and no smaller than the one before.

    A start off the constraints is pulled in, less at every step; a step too long for the motion leaves as large
    an error as it mends, again and again.
    """
    return size > LARGE * motion and size > 0.9 * last


@kernel
def accept(step, q, v, room):
    """Take over the state at the end of a step and the work done in it; return the largest motion of q."""
    motion = 0.0
    place, power, weights, stages = room.c[PLACE], room.power, room.weights[0], room.rate.shape[1]
    for i in range(q.shape[0]):
        motion = max(motion, abs(place[i] - q[i]))
    copy(place, q)
    copy(room.c[SPEED], v)
    for s in range(stages):
        for i in range(power.shape[1]):
            power[stages, i] += step * weights[s] * power[s, i]
    return motion


def march(mass, force, phi, A, b_q, b_v, potential, power, event, p, grid, settings, tableau, q, v, room, out):
    """March from (q, v) along the grid; q and v end as the last state, or the one that failed.

    Returns:
        One of the codes of `codes` and the time it was reached [s].
    """
    f = refer(Functions(mass, force, phi, A, b_q, b_v, potential, power, event))
    K = room.sparse
    adaptive = settings.rtol > 0.0
    t, k, cuts, stop = grid.t, 0, 0, False
    h = grid.dt * FIRST if adaptive else grid.dt
    energy, motion, last_size, first_size, unsettled = np.nan, np.inf, np.inf, np.inf, 0
    while True:
        code, size, energy = begin(f, t, p, settings, energy, q, v, room)
        if code != OK:
            copy(room.c[PLACE], q)
            copy(room.c[SPEED], v)
            return code, t
        if K.use.shape[0] > 0 and (spilled(room.M, K.M) or spilled(room.A, K.A)):
            return SPILLED, t
        lasting = lasts(size, motion, last_size)
        # Where nothing moves, or adaptive steps are short, rounding is all the motion there is.
        lasting = lasting and size > (OPEN if adaptive else ROUNDING) * (1.0 + largest(q))
        unsettled = unsettled + 1 if lasting else max(unsettled - 1, 0)
        if unsettled == PATIENCE or (k == grid.steps and lasting and size > first_size):
            return UNSETTLED, t
        first_size = size if out.count[TAKEN] == 0 else first_size
        last_size = size
        on_grid = t == grid.t + k * grid.dt
        keep(stop or (on_grid and (k % grid.every == 0 or k == grid.steps)), t, q, v, room, out)
        if stop:
            return EVENT, t
        if k == grid.steps:
            return OK, t
        f.event(t, q, v, p, room.event[0])
        # A step along the grid is dt, not a rounded difference of times: that would lose time, step by step.
        end = grid.t + (k + 1) * grid.dt
        rest = grid.dt if on_grid else end - t
        ratio, rank = room.factors.ratio[0], room.factors.rank[0]
        code, ts, step, h, cuts = advance(f, t, p, h, rest, grid.dt, cuts, ratio, rank, settings, tableau, q, v, room)
        if code != OK:
            copy(room.c[PLACE], q)
            copy(room.c[SPEED], v)
            return code, ts
        f.event(t + step, room.c[PLACE], room.c[SPEED], p, room.event[1])
        if np.isnan(largest(room.event[0]) + largest(room.event[1])):
            copy(room.c[PLACE], q)
            copy(room.c[SPEED], v)
            return NOT_FINITE, t + step
        if happened(room.event[0], room.event[1]):
            code, step = locate(f, t, p, step, ratio, rank, settings, tableau, q, v, room)
            if code != OK:
                return code, t
            stop = True
        motion = accept(step, q, v, room)
        out.count[TAKEN] += 1
        if adaptive and out.count[TAKEN] > MOST_STEPS:
            return TOO_MANY_RETRIES, t
        if step == rest and not stop:
            t, k, cuts = end, k + 1, 0
        else:
            t += step
            cuts += not adaptive
            room.seen[SPLIT] += not adaptive and not stop
