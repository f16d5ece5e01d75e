"""Losses of joints by damping and dry friction, and how a swinging leg shows them.

A leg whose sole is clear of the ground is pushed by its motors, by gravity and by what its joints lose, and by nothing
else: with M, h and the torques of the latest tick the losses follow from how its joints speed up. The file's losses are
taken to be right but for a factor, one of each joint of a leg; both legs have the same. Factors are least squares over
all swings so far. What is known of all joints together counts as a little knowledge of each, and the file as a little
knowledge of all.
"""

import math

from biped.base.jit import inner_kernel, kernel
from biped.control.space.topology import BASE, LEG, LEG_POINTS, LEGS

_CREEP = 0.05
"""[rad/s] within which dry friction changes its sign."""
_CLEAR = 0.015
"""[lengths of a shank] that all corners of a sole are above the ground where nothing pushes it."""
_ROOM = 0.02
"""[rad] from the end of its range within which a joint's stop may push it."""
_SHARED = 4.0
"""Of a joint's factor, what all joints show counts so many times what the file counts."""
_MOST = 3.0
"""Largest factor."""
WORTH = 0.05, 0.01
"""The file counts as much as this time [s] with losses of this moment [m g l]."""


@kernel
def _loss(c, j, rate):
    """[N m] that coordinate j loses at a rate, as the file has it."""
    belief = c["belief"]
    return belief["damping"][j] * rate + belief["dry"][j] * rate / math.sqrt(rate * rate + _CREEP * _CREEP)


@kernel
def _at_end(c, m, leg, i):
    """Whether a joint of a leg is near an end of its range that the law counts on."""
    belief = c["belief"]
    for one in range(belief["stop_leg"].size):
        if belief["stop_leg"][one] == leg and belief["stop_joint"][one] == i:
            place = belief["place"][c["at"]["M_base"].shape[0] + LEG * leg + i]
            if belief["stop_way"][one] * (m.q[place] - belief["stop_end"][one]) < _ROOM:
                return True
    return False


@kernel
def _look(c, m, leg):
    """Adds what the latest tick shows of a swinging leg's joints: their losses against what the file says."""
    at, memory, column, tick = c["at"], c["memory"], c["belief"]["column"], c["actuation"]["tick"]
    v, before = at["v"], memory["before"]
    upper, reach = at["M_base"].shape[0], at["M_cross"].shape[2]
    first = upper + LEG * leg
    for i in range(LEG):
        j = first + i
        if column[j] < 0 or _at_end(c, m, leg, i):
            continue
        s = m.h[column[j]] - c["tick"]["u"][j - BASE]
        for k in range(LEG):
            s += at["M_leg"][leg, i, k] * (v[first + k] - before[first + k]) / tick
        for k in range(reach):
            s += at["M_cross"][leg, i, k] * (v[upper - reach + k] - before[upper - reach + k]) / tick
        loss = _loss(c, j, 0.5 * (v[j] + before[j]))
        memory["shown"][i] -= tick * loss * s
        memory["weight"][i] += tick * loss * loss


@kernel
def _factors(c):
    """Writes the factors that follow from all that was shown."""
    act, memory, factor = c["actuation"], c["memory"], c["memory"]["factor"]
    shown, weight, worth = act["compensation"] * act["worth"], act["worth"], _SHARED * act["worth"]
    for i in range(LEG):
        shown += memory["shown"][i]
        weight += memory["weight"][i]
    common = shown / weight
    trunk = factor.size - LEGS * LEG
    for j in range(trunk):
        factor[j] = min(max(common, 0.0), _MOST)
    for i in range(LEG):
        own = (memory["shown"][i] + worth * common) / (memory["weight"][i] + worth)
        for leg in range(LEGS):
            factor[trunk + LEG * leg + i] = min(max(own, 0.0), _MOST)


@inner_kernel
def learn_losses(c, m, first):
    """Updates the factors of what joints lose, after places are sensed and before torques are changed."""
    at, memory = c["at"], c["memory"]
    for leg in range(LEGS):
        lowest = at["height"][LEG_POINTS * leg]
        for p in range(LEG_POINTS * leg, LEG_POINTS * leg + LEG_POINTS):
            lowest = min(lowest, at["height"][p])
        clear = 1 if lowest > _CLEAR * c["belief"]["shank"] else 0
        if clear and memory["clear"][leg] and not first:
            _look(c, m, leg)
        memory["clear"][leg] = clear
    _factors(c)
    for j in range(at["v"].size):
        memory["before"][j] = at["v"][j]


@inner_kernel
def passive_forces(c):
    """Writes what motors make up for [N m]: the joints' damping and dry friction as the controller knows them."""
    at, out, factor = c["at"], c["tick"]["passive"], c["memory"]["factor"]
    for j in range(out.size):
        out[j] = factor[j] * _loss(c, j, at["v"][j])
