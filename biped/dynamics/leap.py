"""One step across a singular position, or out of one.

There a constraint force is a quotient of two small numbers: a stage that is off the constraints by e errs by
e²/ratio, one that stands at a pivot ratio by ε/ratio², and a Runge–Kutta method has stages that are off by O(h²)
and stand where they happen to. The motion itself is smooth. So the step is taken by collocation: its nodes are
states *on* the constraints, found by iteration, and what happens at the node that is nearest to the singular
position is not asked there but told by the polynomial of the others.
"""

import numpy as np

from biped.base.jit import kernel
from biped.dynamics.collocation import ERROR, INTEGRAL, NODE, NODES, WEIGHT, WITHOUT
from biped.dynamics.compiled import NOT_LEAPT, OK, shared
from biped.dynamics.evaluate import evaluate, find_power, project, resolve
from biped.dynamics.orthogonal import copy
from biped.dynamics.room import LAST_Q, LAST_V, LEAPT, PLACE, SPEED, largest
from biped.dynamics.stages import find_acceleration, leave_step

SWEEPS = 25  # iterations of a leap
FEWEST = 3  # before a change that does not shrink is taken for rounding
SHRINKS = 0.7  # how much a change must shrink from one iteration to the next
GROWN = 100.0  # times the least change that the iteration has lost its way
SETTLED = 1e-15  # relative change that ends the iteration of a fixed step, however small its error
DOUBTFUL = 1e-7  # relative change up to which one that does not shrink is taken for rounding
ROUGH = 1e-9  # relative change from which on that must be shown, with nodes on the constraints to the last digit
SHARE = 1e-2  # part of its tolerance, or of its error, that a step iterates to
CLOSER = 0.01  # part of what an iteration changes that the nodes of the next may be off the constraints by
TRUSTED = 1e-4  # pivot ratio at which an acceleration is good enough to go on by in the first iteration


@kernel
def foresee(j, passed, step, known, q, v, room):
    """room.c[PLACE], room.c[SPEED] = the state at node j as far as the nodes before it tell, in the first iteration.

    `passed` nodes before it (and the start) have rates to go by, and what the room holds is the state at the last of
    them: from there it goes on by divided differences of up to three accelerations. Without any it is Taylor's series
    from the start; `known` is the row of the rates with the acceleration that the series has, negative: it has none.
    """
    place, speed, rate, c = room.c[PLACE], room.c[SPEED], room.rate, room.gauss[NODE]
    if passed == 0:
        h = step * c[j]
        for i in range(q.shape[0]):
            a = rate[1, known, i] if known >= 0 else 0.0
            place[i] = q[i] + h * (v[i] + 0.5 * h * a)
            speed[i] = v[i] + h * a
        return
    here = c[j - 1] if j > 0 else 0.0
    h = step * (c[j] - here)
    one = step * (here - (c[j - 2] if j > 1 else 0.0))
    two = step * (here - (c[j - 3] if j > 2 else 0.0))
    for i in range(q.shape[0]):
        a, b, second = rate[1, j, i], 0.0, 0.0
        if passed > 1:
            b = (a - rate[1, j - 1, i]) / one
        if passed > 2:
            second = (b - (rate[1, j - 1, i] - rate[1, j - 2, i]) / (two - one)) / two
        place[i] += h * (speed[i] + h * (a / 2 + h * (b / 6 + (h / 12 + one / 6) * second)))
        speed[i] += h * (a + h * (b / 2 + (h / 3 + one / 2) * second))


@kernel
def enter_node(j, step, q, v, room):
    """room.c[PLACE], room.c[SPEED] = the state at node j, by collocation and by what it was moved by before."""
    place, speed, rate, gauss, away = room.c[PLACE], room.c[SPEED], room.rate, room.gauss, room.away[j]
    for i in range(q.shape[0]):
        place[i] = q[i] + away[i]
        speed[i] = v[i]
    for k in range(NODES):
        weight = step * gauss[INTEGRAL + j, k]
        for i in range(q.shape[0]):
            place[i] += weight * rate[0, k + 1, i]
            speed[i] += weight * rate[1, k + 1, i]


@kernel
def interpolate(j, room):
    """Rates and powers at node j by those at the other nodes."""
    rate, power, weights = room.rate, room.power, room.gauss[WITHOUT + j]
    for i in range(rate.shape[2]):
        dq = dv = 0.0
        for k in range(NODES):
            dq += weights[k] * rate[0, k + 1, i]
            dv += weights[k] * rate[1, k + 1, i]
        rate[0, j + 1, i], rate[1, j + 1, i] = dq, dv
    for i in range(power.shape[1]):
        dp = 0.0
        for k in range(NODES):
            dp += weights[k] * power[k + 1, i]
        power[j + 1, i] = dp


@kernel
def change(settings, room):
    """How far the end of the step moved in an iteration: in units of an adaptive step's tolerance, and relative."""
    units = most = 0.0
    for last, now in ((LAST_Q, PLACE), (LAST_V, SPEED)):
        size = 1.0 + largest(room.c[now])
        for i in range(room.c.shape[1]):
            gap = abs(room.c[now, i] - room.c[last, i])
            most = max(most, gap / size)
            if settings.rtol > 0.0:
                units = max(units, gap / (settings.atol + settings.rtol * abs(room.c[now, i])))
        copy(room.c[now], room.c[last])
    return units if settings.rtol > 0.0 else most, most


@kernel
def error_left(step, room):
    """Relative error of a step at the nodes as they stand: its estimate, which sees far more than there is."""
    c, rate, weights = room.c, room.rate, room.weights[1]
    most = 0.0
    for part, now in ((rate[0], c[PLACE]), (rate[1], c[SPEED])):
        size = 1.0 + largest(now)
        for i in range(part.shape[1]):
            e = 0.0
            for s in range(part.shape[0]):
                e += weights[s] * part[s, i]
            most = max(most, abs(step * e) / size)
    return most


@shared
def leap(f, t, p, step, ratio, rank, settings, q, v, room):
    """The rates of a step at the nodes, found by iteration, from a start of this pivot ratio and rank.

    What an iteration has moved a node by, onto the constraints, the next one begins with: one evaluation a node does.

    Returns:
        A code and the time it was reached [s]; room holds the end of the step.
    """
    # Of a start too close the acceleration is not known: that of the first node, moved to in a straight line, is.
    known = 0 if ratio > TRUSTED and rank == room.factors.use[1] else -1
    aside, before, least_moved = -1, np.inf, np.inf
    # An error test looks at the nodes' rates: a step that is tested takes them by the series and to the last digit.
    adaptive = settings.rtol > 0.0
    closer = 0.0 if adaptive else CLOSER
    limit, doubtful = (SHARE, 1.0) if adaptive else (SETTLED, DOUBTFUL)
    for s in range(room.rate.shape[1]):
        for i, row in enumerate((WEIGHT, ERROR, ERROR + 1)):
            room.weights[i, s] = room.gauss[row, s - 1] if 1 <= s <= NODES else 0.0
    # The series of the first iteration is off by no more than its last term.
    changed = 0.5 * step**2 * largest(room.rate[1, 0]) if known == 0 else step * largest(v)
    changed /= 1.0 + largest(q)
    for j in range(NODES):
        for i in range(q.shape[0]):
            room.away[j, i] = 0.0
    passed = 1 if known == 0 and not adaptive else 0
    if passed > 0:
        copy(q, room.c[PLACE])
        copy(v, room.c[SPEED])
    for sweep in range(SWEEPS):
        least, within = np.inf, closer * changed
        for j in range(NODES):
            if j == aside:
                continue
            ts = t + room.gauss[NODE, j] * step
            if sweep == 0:
                foresee(j, passed, step, known, q, v, room)
            else:
                enter_node(j, step, q, v, room)
            evaluate(f, ts, p, room)
            found = resolve(True, room)
            here = room.factors.ratio[0] if found else 0.0
            if found:
                code, _ = project(False, True, room.away[j], within, f, ts, p, room)
                found = code == OK
                here = room.factors.ratio[0] if found else 0.0
            if found:
                find_acceleration(j + 1, settings, room)
                find_power(f, ts, p, j + 1, room)
                found = np.isfinite(largest(room.rate[0, j + 1]) + largest(room.rate[1, j + 1]))
            if not found:
                # One node may stand where nothing can be said: that is the one to leave to the others.
                if sweep > 0 or least < 0.0:
                    return NOT_LEAPT, ts
                here = -1.0
            if aside < 0 and here < least:
                least, nearest = here, j
            if known < 0 and found:
                known = j + 1
            passed = passed + 1 if here > TRUSTED and not adaptive else 0
        if aside < 0:
            aside = nearest
        interpolate(aside, room)
        if not leave_step(step, q, v, room):
            return NOT_LEAPT, t + step
        moved, relative = change(settings, room)
        changed = relative if sweep > 0 else changed
        if not adaptive:
            limit = max(SETTLED, SHARE * error_left(step, room))
        stalls = sweep >= FEWEST and moved > SHRINKS * before and moved <= doubtful
        if (sweep > 0 and moved <= limit) or (stalls and (closer == 0.0 or moved < ROUGH)):
            room.seen[LEAPT] += 1
            return OK, t + step
        least_moved = min(least_moved, moved)
        if not moved < np.inf or moved > GROWN * max(least_moved, doubtful):
            return NOT_LEAPT, t + step
        before = moved
        if stalls:  # it may be what the nodes are off by
            closer, before = 0.0, np.inf
    return NOT_LEAPT, t + step
