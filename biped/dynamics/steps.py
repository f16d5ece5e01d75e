"""How long a step is: whole, parted to keep away from a singularity, or as long as the tolerance allows."""

import numpy as np

from biped.base.jit import kernel
from biped.dynamics.compiled import shared
from biped.dynamics.room import PLACE, REFUSED, SPEED
from biped.dynamics.stages import NOT_FINITE, OK, TOO_MANY_RETRIES, attempt, leave_step

RETRIES = 30  # refusals of one adaptive step
CUTS = (0.382, 0.618, 0.236, 0.764)  # where a step is parted to keep its stages off a singularity
NOISE = 1e-15  # rounding error of an acceleration [1/s] times the square of its pivot ratio
WIDEST = 3e-2  # pivot ratio beyond which no tolerance asks for a step to be parted
CROSSING = 30.0  # times its tolerance that a step may err that leads over a singular position
SHORTEST = 1e-5  # part of the longest step below which a step beside a singular position drowns in rounding
LEAVE = 0.1  # part of a step that leaves a singular start: less, and rounding errors grow


@shared
def part(f, t, p, whole, cuts, ratio, rank, settings, tableau, q, v, room):
    """A step, or the part of it whose stages keep away from a singularity.

    `whole` [s] is the step asked for, `cuts` how often it was parted already (twice is enough), `ratio` and `rank`
    are those of its start; the other arguments are those of `attempt`.

    Returns:
        A code, the time it was reached [s], the step taken [s], the smallest pivot ratio on the way, how often it is
        parted now.
    """
    step = best = whole
    widest, trial = -1.0, 0
    narrow, closer = settings.split, 0.1
    if settings.rtol > 0.0:
        rounding, truncation = np.sqrt(NOISE * whole / settings.rtol), np.sqrt(settings.rtol)
        narrow, closer = max(narrow, min(WIDEST, max(rounding, truncation))), 0.5
    while True:
        code, ts, nearest, highest = attempt(f, t, p, step, settings, tableau, q, v, room)
        if code != OK or cuts >= 2:
            return code, ts, step, nearest, cuts
        if trial == 0 and rank < highest:
            # Standing on a singularity, forces that exist a hair beside it are not seen: leave by a short step.
            step, cuts = LEAVE * whole, 2
            continue
        # Leave a singularity between two stages, not under one: there rounding errors grow like 1/ratio².
        if not (nearest < narrow and nearest < closer * ratio):
            return code, ts, step, nearest, cuts
        if nearest > widest:
            best, widest = step, nearest
        if trial < len(CUTS):
            step = whole * CUTS[trial]
            trial += 1
            continue
        cuts = 2
        if step == best:
            return code, ts, step, nearest, cuts
        step = best


@kernel
def error_norm(step, tableau, settings, q, v, room):
    """Size of the step's error in units of the tolerance, from two embedded estimates (as in DOP853)."""
    fifth = third = 0.0
    for i in range(q.shape[0]):
        for rate, old, new in ((room.rate[0], q, room.c[PLACE]), (room.rate[1], v, room.c[SPEED])):
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


@shared
def advance(f, t, p, h, rest, longest, cuts, ratio, rank, settings, tableau, q, v, room):
    """The next step: of the length asked for, or with an adaptive scheme as long as its error test allows.

    `h` [s] is the step that an adaptive scheme's last error suggests, `rest` [s] the time to the grid, which no
    step crosses, `longest` [s] the longest step; the other arguments are those of `part`.

    Returns:
        A code, the time it was reached [s], the step taken [s], the step suggested for the next [s], how often
        the step is parted now.
    """
    adaptive = settings.rtol > 0.0
    step = min(h, rest) if adaptive else rest
    failed, when = TOO_MANY_RETRIES, t
    for tries in range(RETRIES):
        code, ts, step, nearest, parted = part(f, t, p, step, cuts, ratio, rank, settings, tableau, q, v, room)
        if code == OK and not leave_step(step, tableau, q, v, room):
            code, ts = NOT_FINITE, t
        if not adaptive:
            return code, ts, step, h, parted
        error = error_norm(step, tableau, settings, q, v, room) if code == OK else np.inf
        near = min(ratio, nearest) < WIDEST
        if error <= (CROSSING if near else 1.0):
            longer = step * min(5.0, 0.9 * max(error, 1e-12) ** (-1.0 / 8.0))
            return OK, ts, step, max(h, longer) if tries == 0 and step < h else longer, 0
        if code != OK and failed == TOO_MANY_RETRIES:  # what the longest step met says more than the last does
            failed, when = code, ts
        room.seen[REFUSED] += 1
        step *= max(0.2, 0.9 * error ** (-1.0 / 8.0))
        if step < 1e-14 * max(abs(t), rest) or (near and step < SHORTEST * longest):
            break
    return failed, when, step, h, 0
