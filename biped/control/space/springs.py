"""Spring-damper couples as moments on bodies: Q_d = Σ J_ωᵀ τ, (3.16)-(3.17) with three axes instead of one."""

import math

from biped.base.jit import inner_kernel, kernel
from biped.control.space.topology import BASE, HIP_JOINTS, LEG, LEGS, SIDE
from biped.robot.leg_states import EXTENDED, SWING

_HOLD = 20.0
"""[1/s] how fast the springs of joints above the legs are, whatever they carry."""
_DAMPED = 0.7
"""Damping ratio of these."""


@kernel
def _placed(c, leg):
    """[rad] by which a swinging leg is abducted for where the walker is and goes: c_v v_y + c_d (y - half the hips)."""
    at, gait = c["at"], c["gait"]
    cos, sin = math.cos(gait["heading"]), math.sin(gait["heading"])
    side, stance = SIDE[leg], at["foot"][1 - leg]
    speed = side * (at["com_velocity"][1] * cos - at["com_velocity"][0] * sin)
    y = side * ((at["com"][1] - stance[1]) * cos - (at["com"][0] - stance[0]) * sin)
    return gait["velocity"] * speed + gait["position"] * (y - c["belief"]["hip"])


@inner_kernel
def desired_forces(c, m):
    """Writes Q_d [N, N m] into the record from link angles, leg states and gains.

    Torso and thighs are held to the inertial frame about three axes: across (pitch, as in the plane), forward (roll,
    abduction) and along the link itself (yaw, rotation). Knee, ankle and inversion are held to their neighbours, and so
    are the joints above the legs, stiffly.
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
    tx, ty, tz = 0.0, 0.0, 0.0  # moment on the whole walker
    lx, ly, lz = 0.0, 0.0, 0.0  # on its thighs
    for link in range(1 + LEGS):
        leg = link - 1
        if link == 0:
            pitch = -gait["k_torso"][0] * (at["torso"][0] - gait["rest_torso"][0])
            roll = -gait["k_torso"][1] * (at["torso"][1] - gait["rest_torso"][1])
            yaw = -gait["k_torso"][2] * (at["torso"][2] - gait["rest_torso"][2])
            pitch -= gait["b_torso"][0] * at["torso_rate"][0]
            roll -= gait["b_torso"][1] * at["torso_rate"][1]
            yaw -= gait["b_torso"][2] * at["torso_rate"][2]
        else:
            s = memory["phase"][leg]
            placed = _placed(c, leg) if s in (SWING, EXTENDED) else 0.0
            c["tick"]["placed"][leg] = placed
            pitch = -k[s, 0] * (at["angle"][leg, 0] - rest[s, 0]) - b[s, 0] * at["rate"][leg, 0]
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
                axis = m.axes[column[j]]
                Q[j] = axis[0] * x + axis[1] * y + axis[2] * z
            s = memory["phase"][leg]
            for i in range(HIP_JOINTS, LEG):
                couple = -k[s, i] * (at["joint"][leg, i] - rest[s, i]) - b[s, i] * at["joint_rate"][leg, i]
                Q[first + i] = c["belief"]["sign"][leg, i] * couple if column[first + i] >= 0 else 0.0
    for j in range(upper - reach, trunk):
        axis = m.axes[column[j]]
        Q[j] += axis[0] * lx + axis[1] * ly + axis[2] * lz
    for j in range(trunk + 3, upper):
        axis = m.axes[column[j]]
        Q[j] = axis[0] * tx + axis[1] * ty + axis[2] * tz
