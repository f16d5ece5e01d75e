"""One control tick of a biped with a free base: sense, losses of joints, leg states, Q_d of springs, joint torques.

Losses by damping and dry friction show where a leg swings: one whose sole is clear of the ground is pushed by its
motors, by gravity and by what its joints lose, and by nothing else: with M, h and the torques of the latest tick the
losses follow from how its joints speed up. The file's losses are taken to be right but for a factor, one of each joint
of a leg; both legs have the same. Factors are least squares over all swings so far. What is known of all joints
together counts as a little knowledge of each, and the file as a little knowledge of all.
"""

import math

from biped.base.jit import inner_kernel, kernel
from biped.control.blending import smooth
from biped.control.pace import excess, extended, flexed, leaned, straightened
from biped.control.space.disturbance import notice_push
from biped.control.space.places import believe_contacts, headed, point_motion, sense_places
from biped.control.space.pushing import pushing_torques
from biped.control.space.record import ANKLE, BASE, HEEL_END, HIP_JOINTS, KNEE, LEG, LEG_POINTS, LEGS, SIDE, TOE_END
from biped.control.step_back import knee_couple, step_back, thigh_couple
from biped.robot.leg_states import EXTENDED, SWING, leg_state

_HOLD = 20.0
"""[1/s] how fast the springs of joints above the legs are, whatever they carry."""
_DAMPED = 0.7
"""Damping ratio of these."""


@kernel
def _placed(c, leg, leftward, rise_left):
    """[rad] by which a swinging leg is abducted for where the walker is and goes: c_v v_y + c_d (y - half the hips).

    And for how the ground rises on its side, and for what pushes the walker to that side. A foot that has not passed
    the other yet is kept apart from it.
    """
    at, gait = c["at"], c["gait"]
    side, stance = SIDE[leg], at["foot"][1 - leg]
    _, beside = headed(c, at["com"][0] - stance[0], at["com"][1] - stance[1])
    placed = gait["velocity"] * side * leftward + gait["position"] * (side * beside - c["belief"]["hip"])
    placed += gait["pace"][2] * side * rise_left
    placed += gait["push"] * max(side * c["memory"]["pushed"], 0.0)
    if gait["apart"] > 0.0:
        before, beside = headed(c, at["foot"][leg, 0] - stance[0], at["foot"][leg, 1] - stance[1])
        if before < gait["crossing"]:
            further = (gait["apart"] - side * beside) / (2.0 * c["belief"]["shank"])  # two shanks are a leg
            rest = gait["rest"][c["memory"]["phase"][leg], 1]
            placed = max(placed, at["angle"][leg, 1] + further - rest)
    return placed


@kernel
def _moment(m, column, x, y, z):
    """[N m] of a couple (x, y, z) about a coordinate's axis; of one that the walker has not, none."""
    if column < 0:
        return 0.0
    axis = m.axes[column]
    return axis[0] * x + axis[1] * y + axis[2] * z


@inner_kernel
def desired_forces(c, m):
    """Writes Q_d [N, N m] into the record from link angles, leg states and gains.

    Torso and thighs are held to the inertial frame about three axes: across (pitch, as in the plane), forward (roll,
    abduction) and along the link itself (yaw, rotation). Knee, ankle and inversion are held to their neighbours, and so
    are the joints above the legs, stiffly. A leg that steps back has couples of its own (`biped.control.step_back`).
    """
    at, gait, memory, column = c["at"], c["gait"], c["memory"], c["belief"]["column"]
    Q, k, b, rest = c["tick"]["Q_d"], gait["k"], gait["b"], gait["rest"]
    upper, reach = at["M_base"].shape[0], at["M_cross"].shape[2]
    trunk = upper - BASE
    cos, sin = math.cos(gait["heading"]), math.sin(gait["heading"])
    for j in range(trunk):
        away, M = m.q[c["belief"]["place"][j]] - c["belief"]["upright"][j], at["M_base"][j, j]
        Q[j] = -M * _HOLD * (_HOLD * away + 2.0 * _DAMPED * at["v"][j])
    for j in range(3):
        Q[trunk + j] = 0.0
    tilt, velocity = c["belief"]["tilt"], at["com_velocity"]
    rise, rise_left = headed(c, tilt[0], tilt[1])
    forward, leftward = headed(c, velocity[0], velocity[1])
    faster = excess(gait["pace"], forward, rise)
    tx, ty, tz = 0.0, 0.0, 0.0  # moment on the whole walker
    lx, ly, lz = 0.0, 0.0, 0.0  # on its thighs
    back, to_go = False, 0.0  # of the leg that was looked at last
    for link in range(1 + LEGS):
        leg = link - 1
        if link == 0:
            at_rest = gait["rest_torso"][0] - leaned(gait["pace"], rise)
            pitch = -gait["k_torso"][0] * (at["torso"][0] - at_rest)
            roll = -gait["k_torso"][1] * (at["torso"][1] - gait["rest_torso"][1])
            yaw = -gait["k_torso"][2] * (at["torso"][2] - gait["rest_torso"][2])
            pitch -= gait["b_torso"][0] * at["torso_rate"][0]
            roll -= gait["b_torso"][1] * at["torso_rate"][1]
            yaw -= gait["b_torso"][2] * at["torso_rate"][2]
        else:
            s = memory["phase"][leg]
            placed = _placed(c, leg, leftward, rise_left) if s in (SWING, EXTENDED) else 0.0
            c["tick"]["placed"][leg] = placed
            back, to_go = memory["back"] and s == EXTENDED, at["angle"][leg, 0] - c["backstep"]["theta_l"]
            if back:
                pitch = thigh_couple(c["backstep"], to_go, at["rate"][leg, 0])
            else:
                further = flexed(gait["pace"], s, faster) - gait["shorten"] * placed * placed
                pitch = -k[s, 0] * (at["angle"][leg, 0] - rest[s, 0] - further) - b[s, 0] * at["rate"][leg, 0]
            roll = -k[s, 1] * (at["angle"][leg, 1] - rest[s, 1] - placed) - b[s, 1] * at["rate"][leg, 1]
            yaw = -k[s, 2] * (at["angle"][leg, 2] - rest[s, 2]) - b[s, 2] * at["rate"][leg, 2]
            roll *= SIDE[leg]
            yaw *= SIDE[leg]
        own = at["axis"][link]
        x = pitch * sin + roll * cos + yaw * own[0]
        y = -pitch * cos + roll * sin + yaw * own[1]
        z = yaw * own[2]
        tx += x
        ty += y
        tz += z
        if link > 0:
            lx += x
            ly += y
            lz += z
            first = upper + LEG * leg
            for j in range(first, first + HIP_JOINTS):
                Q[j] = _moment(m, column[j], x, y, z)
            s = memory["phase"][leg]
            for i in range(HIP_JOINTS, LEG):
                couple = -k[s, i] * (at["joint"][leg, i] - rest[s, i]) - b[s, i] * at["joint_rate"][leg, i]
                if i == KNEE and back and c["backstep"]["k_d3"] > 0.0:
                    couple = knee_couple(c["backstep"], to_go, at["joint"][leg, i], at["joint_rate"][leg, i])
                elif i == KNEE:
                    couple += straightened(gait["pace"], s, faster)
                elif i == ANKLE:
                    couple -= extended(gait["pace"], s, faster, rise)
                Q[first + i] = c["belief"]["sign"][leg, i] * couple if column[first + i] >= 0 else 0.0
    for j in range(upper - reach, trunk):
        Q[j] += _moment(m, column[j], lx, ly, lz)
    for j in range(trunk + 3, upper):
        Q[j] = _moment(m, column[j], tx, ty, tz)


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


@inner_kernel
def leg_states(c):
    """Writes the states of both legs into the record: toe or heel is on the ground if any of its two points is."""
    memory, angle, joint = c["memory"], c["at"]["angle"], c["at"]["joint"]
    for leg in range(LEGS):
        toe, heel = memory["believed"][2 * leg + TOE_END], memory["believed"][2 * leg + HEEL_END]
        thigh, other = angle[leg, 0], angle[1 - leg, 0]
        memory["phase"][leg] = leg_state(c["sensing"], toe, heel, thigh, other, thigh, joint[leg, KNEE])


@inner_kernel
def walker_falls_back(c):
    """As `biped.control.step_back.step_back`, for the whole walker's centre of mass, along its heading."""
    at, tilt, rear = c["at"], c["belief"]["tilt"], math.inf
    for end in range(2 * LEGS):
        if c["memory"]["believed"][end]:
            for p in range(2 * end, 2 * end + 2):
                rear = min(rear, headed(c, at["place"][p, 0], at["place"][p, 1])[0])
    x, _ = headed(c, at["com"][0], at["com"][1])
    speed, _ = headed(c, at["com_velocity"][0], at["com_velocity"][1])
    step_back(c, x, at["com"][2], speed, headed(c, tilt[0], tilt[1])[0], rear)


@inner_kernel
def decide_forces(c, m, first):
    """The first half of a tick: leg states, Q_d, and what makes up for the joints' losses.

    Args:
        c: The controller record.
        m: `biped.control.space.places.Mechanics`.
        first: Whether this is the run's first tick.
    """
    sense_places(c, m)
    believe_contacts(c, first)
    leg_states(c)
    if c["backstep"]["on"]:
        walker_falls_back(c)
    if c["gait"]["push"] > 0.0:
        notice_push(c, first)
    desired_forces(c, m)
    if c["actuation"]["learning"]:
        learn_losses(c, m, first)
    passive_forces(c)


@inner_kernel
def allocate(c, m, first):
    """The second half: joint torques that do Q_d as well as ground that only pushes allows; arguments as before."""
    c["tick"]["limited"] = pushing_torques(c, m)
    smooth(c["tick"]["u"], c["memory"]["latest"], c["actuation"]["follow"], c["actuation"]["most"], first)


@inner_kernel
def spatial_tick(record, m, first):
    """The law for one tick; u or Q_d is left in the record.

    Args:
        record: (1,) `biped.control.space.record.CONTROL`.
        m: `biped.control.space.places.Mechanics`.
        first: Whether this is the run's first tick.
    """
    c = record[0]
    decide_forces(c, m, first)
    if c["actuation"]["generalized"] == 0:
        point_motion(c, m)
        allocate(c, m, first)
