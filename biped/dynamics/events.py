"""Where within a step an event function passes through zero."""

from biped.base.jit import kernel
from biped.dynamics.codes import NOT_PROJECTED, OK
from biped.dynamics.compiled import shared
from biped.dynamics.orthogonal import copy
from biped.dynamics.room import FIRED, PLACE, SPEED
from biped.dynamics.steps import whole_step

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
