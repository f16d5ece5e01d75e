"""How long a step is: whole, parted to keep away from a singularity, or as long as the tolerance allows."""

import numpy as np

from biped.base.jit import kernel
from biped.dynamics.compiled import NOT_FINITE, NOT_LEAPT, OK, TOO_MANY_RETRIES, shared
from biped.dynamics.leap import leap
from biped.dynamics.room import PLACE, REFUSED, SPEED
from biped.dynamics.stages import attempt, leave_step

RETRIES = 30  # refusals of one adaptive step
CUTS = (0.382, 0.618, 0.236, 0.764)  # where a step is parted to keep its stages off a singularity
LEAVE = 0.1  # part of a step that leaves a singular start: less, and rounding errors grow
LEAPS = 5  # lengths of a leap that are tried
LEAST = 0.02  # part of a step that shows a singular position below which no leap is tried
FAR = 0.2  # pivot ratio that an adaptive leap lands at
LONGEST = 4.0  # steps that it is at most
REACH = 0.3  # pivot ratio below which an adaptive scheme looks out for a singular position
AHEAD = 4.0  # steps ahead that it sees one
SHORTEST = 1e-5  # part of the longest step below which a step beside a singular position drowns in rounding


@shared
def whole_step(f, t, p, step, ratio, rank, settings, tableau, q, v, room):
    """A step of this length whatever its error, by a leap where a singular position is near; room holds its end.

    Returns:
        A code, the time it was reached [s], the step taken [s]: less if no leap of this length settles.
    """
    watching = settings.settle > 0.0
    while True:
        code, ts, _, _, _ = attempt(watching, f, t, p, step, ratio, rank, settings, tableau, q, v, room)
        if not watching or code == OK or (code != NOT_LEAPT and ratio >= settings.settle):
            break
        shorter = step
        for _ in range(LEAPS):
            landed, when = leap(f, t, p, shorter, ratio, rank, settings, q, v, room)
            if landed == OK:
                return OK, when, shorter
            shorter *= 0.5
        watching = False
    if code == OK and not leave_step(step, q, v, room):
        return NOT_FINITE, t, step
    return code, ts, step


@shared
def part(f, t, p, whole, cuts, ratio, rank, settings, tableau, q, v, room):
    """A step, or the part of it whose stages keep away from a singularity.

    `whole` [s] is the step asked for, `cuts` how often it was parted already (twice is enough), `ratio` and `rank`
    are those of its start; the other arguments are those of `attempt`.

    Returns:
        A code, the time it was reached [s], the step taken [s], how often it is parted now.
    """
    step = best = whole
    widest, trial = -1.0, 0
    while True:
        code, ts, nearest, most, _ = attempt(False, f, t, p, step, ratio, rank, settings, tableau, q, v, room)
        if code == OK and not leave_step(step, q, v, room):
            return NOT_FINITE, t, step, cuts
        if code != OK or cuts >= 2:
            return code, ts, step, cuts
        if trial == 0 and rank < most:
            # Standing on a singularity, forces that exist a hair beside it are not seen: leave by a short step.
            step, cuts = LEAVE * whole, 2
            continue
        # Leave a singularity between two stages, not under one: there rounding errors grow like 1/ratio².
        if not (nearest < settings.split and nearest < 0.1 * ratio):
            return code, ts, step, cuts
        if nearest > widest:
            best, widest = step, nearest
        if trial < len(CUTS):
            step = whole * CUTS[trial]
            trial += 1
            continue
        cuts = 2
        if step == best:
            return code, ts, step, cuts
        step = best


@kernel
def error_norm(step, settings, q, v, room):
    """Size of the step's error in units of the tolerance, from two embedded estimates (as in DOP853)."""
    fifth = third = 0.0
    weights, places, speeds = room.weights, room.c[PLACE], room.c[SPEED]
    for i in range(q.shape[0]):
        for rate, old, new in ((room.rate[0], q, places), (room.rate[1], v, speeds)):
            scale = settings.atol + settings.rtol * max(abs(old[i]), abs(new[i]))
            e5 = e3 = 0.0
            for s in range(rate.shape[0]):
                e5 += weights[1, s] * rate[s, i]
                e3 += weights[2, s] * rate[s, i]
            fifth += (e5 / scale) ** 2
            third += (e3 / scale) ** 2
    if fifth == 0.0:
        return 0.0
    return abs(step) * fifth / np.sqrt((fifth + 0.01 * third) * 2 * q.shape[0])


@kernel
def factor_of(error):
    """How many times longer the next step may be than one of this error."""
    return min(5.0, 0.9 * max(error, 1e-12) ** (-1.0 / 8.0))


@kernel
def span(step, passed, ratio, last, rank, most):
    """Length of a leap [s] that lands well clear of the singular position that a step showed; 0: none is near.

    `ratio` is the pivot ratio at the start, `last` at the last stage that was reached, `passed` [s] later; `rank` and
    `most` are the ranks at the start and on the way.
    """
    if most > rank:
        return step * max(1.0, FAR / last)
    slope = abs(last - ratio) / passed
    ahead = ratio if last < ratio else 0.0
    if not (slope > 0.0 and ahead <= AHEAD * step * slope):
        return 0.0
    return max(step, min((ahead + FAR) / slope, LONGEST * step))


@shared
def adapt(f, t, p, h, rest, longest, ratio, rank, settings, tableau, q, v, room):
    """The next step, as long as the error test allows.

    `h` [s] is the step that the last error suggests, `rest` [s] the time to the grid, which no step crosses,
    `longest` [s] the longest step; the other arguments are those of `attempt`.

    Returns:
        A code, the time it was reached [s], the step taken [s], the step suggested for the next [s].
    """
    step = min(h, rest)
    failed, when = TOO_MANY_RETRIES, t
    watching, refused = settings.settle > 0.0, 0
    while refused < RETRIES:
        code, ts, _, most, last = attempt(watching, f, t, p, step, ratio, rank, settings, tableau, q, v, room)
        near = code == NOT_LEAPT or (code != OK and ratio < settings.settle)
        if watching and (near or last < min(ratio, REACH)):
            length = min(rest, span(step, ts - t, ratio, last, rank, most))
            length = step if near and length < step else length
            shortest = LEAST * step if near else step
            shortened = False
            for _ in range(LEAPS):
                if length < shortest:
                    break
                landed, _ = leap(f, t, p, length, ratio, rank, settings, q, v, room)
                error = error_norm(length, settings, q, v, room) if landed == OK else np.inf
                if error <= 1.0:
                    # What did not settle, or erred, at a greater length will not do so in the next step either.
                    return OK, t + length, length, length if shortened else max(h, length * factor_of(error))
                shortened = True
                room.seen[REFUSED] += 1
                length *= max(0.3, 0.9 * error ** (-1.0 / 8.0))
                near = True
            watching = False
            if near:  # the rates of the stages are gone
                continue
        if code == OK and not leave_step(step, q, v, room):
            code, ts = NOT_FINITE, t
        error = error_norm(step, settings, q, v, room) if code == OK else np.inf
        if error <= 1.0:
            longer = step * factor_of(error)
            return OK, ts, step, max(h, longer) if refused == 0 and step < h else longer
        if code != OK and failed == TOO_MANY_RETRIES:  # what the longest step met says more than the last does
            failed, when = code, ts
        refused += 1
        room.seen[REFUSED] += 1
        step *= max(0.2, 0.9 * error ** (-1.0 / 8.0))
        if step < 1e-14 * max(abs(t), rest) or (ratio < settings.settle and step < SHORTEST * longest):
            break
    return failed, when, step, h


@shared
def advance(f, t, p, h, rest, longest, cuts, ratio, rank, settings, tableau, q, v, room):
    """The next step, as the scheme says; its arguments are those of `adapt` and `part`.

    Returns:
        A code, the time it was reached [s], the step taken [s], the step suggested for the next [s], how often
        the step is parted now.
    """
    if settings.rtol > 0.0:
        code, ts, step, h = adapt(f, t, p, h, rest, longest, ratio, rank, settings, tableau, q, v, room)
        return code, ts, step, h, 0
    if settings.settle > 0.0:
        code, ts, step = whole_step(f, t, p, rest, ratio, rank, settings, tableau, q, v, room)
        return code, ts, step, h, cuts
    code, ts, step, cuts = part(f, t, p, rest, cuts, ratio, rank, settings, tableau, q, v, room)
    return code, ts, step, h, cuts
