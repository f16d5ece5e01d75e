"""The ground below each point where it is not level: gaps, rows and impulses in its direction there.

A point that touches is held in its place, whatever the ground's direction: that only says which force would be a pull.
The direction is the one of the piece on which the point landed until it lets go. A point that swings into a ramp from
the front lands on it as anywhere else: a plastic impact, no slip; the foot has stumbled. Without tiles or steps every
function here is the level one.
"""

import math

from biped.base.jit import kernel
from biped.robot.ground import piece_below, rise_of
from biped.robot.planar.kinematics import point_row
from biped.robot.planar.topology import CHAINS, LINK_DOF, NQ, POINT_LEG, STOP_ROW, X


@kernel
def stand_on(w, i, q, v):
    """Point i's gap [m] and its rate, taken above z = 0, become those straight down to the ground."""
    ground, contact, system, at = w["ground"], w["contact"], w["system"], w["at"]
    x, speed = q[X] + at["point"][i, 0], v[X]  # velocities of places are those before an impact
    for k in CHAINS[POINT_LEG[i]]:
        speed += (at["joint"][k, 1] - at["point"][i, 1]) * v[k + LINK_DOF]
    if contact["active"][i]:
        rise = contact["sin"][i] / contact["cos"][i]
        height = contact["landed"][i] + rise * (x - contact["anchor"][i])
    else:
        k = piece_below(ground, x)
        rise = rise_of(ground, k)
        height = ground["z"][max(k, 0)] + rise * (x - ground["x"][max(k, 0)])
        contact["cos"][i] = 1.0 / math.sqrt(1.0 + rise * rise)
        contact["sin"][i] = rise * contact["cos"][i]
    system["gap"][i] -= height
    system["gap_rate"][i] -= rise * speed


@kernel
def set_down(w, i):
    """Notes the height of the ground where point i lands, at the anchor that it has just been given."""
    ground, contact = w["ground"], w["contact"]
    k = piece_below(ground, contact["anchor"][i])
    rise = rise_of(ground, k)
    contact["landed"][i] = ground["z"][max(k, 0)] + rise * (contact["anchor"][i] - ground["x"][max(k, 0)])


@kernel
def off_ground(w, q, i, direction):
    """How far [m] a point that touches is from where it landed: along the normal (0) or along the ground (1)."""
    contact, gap = w["contact"], w["system"]["gap"][i]
    c, s = contact["cos"][i], contact["sin"][i]
    if direction == 0:
        return gap * c
    return (q[X] + w["at"]["point"][i, 0] - contact["anchor"][i]) / c + s * gap


@kernel
def row_on(w, i, direction, out):
    """Writes a point's row (9,) of A along the ground's normal (0), or along the ground (1)."""
    point_row(w["at"], i, direction, out)
    if w["ground"]["count"] == 0:
        return
    other = w["contact"]["other"]
    point_row(w["at"], i, 1 - direction, other)
    c, s = w["contact"]["cos"][i], w["contact"]["sin"][i]
    if direction == 0:
        s = -s
    for j in range(NQ):
        out[j] = c * out[j] + s * other[j]


@kernel
def bias_on(w, i, direction):
    """J̇v [m/s²] of that row."""
    bias = w["at"]["point_bias"]
    if w["ground"]["count"] == 0:
        return bias[i, 1 - direction]
    c, s = w["contact"]["cos"][i], w["contact"]["sin"][i]
    return c * bias[i, 1] - s * bias[i, 0] if direction == 0 else c * bias[i, 0] + s * bias[i, 1]


@kernel
def add_impulse(w, row, size):
    """Adds a row's impulse [N s, N m s] to the tick's, which are normal and along the slope, whatever stands on it."""
    impulse = w["ledger"]["impulse"]
    if w["ground"]["count"] == 0 or row >= STOP_ROW:
        impulse[row] += size
        return
    i = row // 2
    c, s = w["contact"]["cos"][i], w["contact"]["sin"][i]
    if row % 2 == 0:
        impulse[2 * i] += c * size
        impulse[2 * i + 1] -= s * size
    else:
        impulse[2 * i] += s * size
        impulse[2 * i + 1] += c * size
