"""The spring-damper couples: desired generalized forces Q_d, (3.16)-(3.17), in joint coordinates."""

import math

from biped.base.jit import inner_kernel
from biped.robot.leg_states import EXTENDED
from biped.robot.planar.topology import ANKLE, HIP, KNEE, LEGS, PITCH, THIGH, TORSO, X, Z


@inner_kernel
def desired_forces(c, q, v):
    """Writes Q_d (9,) [N, N m] into the record from link angles, leg states and gains.

    Torso and thighs are held to the inertial frame, knees and ankles to their neighbours. In joint coordinates a knee's
    or ankle's couple is just its joint's torque, a thigh's acts on hip and pitch, the torso's on pitch (virtual work).
    A leg that steps back (`biped.control.planar.phase`) has a thigh couple of its own.
    """
    at, gait, memory, backstep = c["at"], c["gait"], c["memory"], c["backstep"]
    Q, angle, rate, k, b = c["tick"]["Q_d"], at["angle"], at["rate"], gait["k"], gait["b"]
    upright = 0.5 * math.pi + c["belief"]["tilt"]
    Q[X] = 0.0
    Q[Z] = 0.0
    pitch = -gait["k_d1"] * (angle[TORSO] + upright - gait["theta_b"]) - gait["b_d1"] * rate[TORSO]
    for leg in range(LEGS):
        s = memory["phase"][leg]
        thigh, hip, knee, ankle = THIGH[leg], HIP[leg], KNEE[leg], ANKLE[leg]
        if memory["back"] and s == EXTENDED:
            couple = -backstep["k_d2"] * (angle[thigh] + upright - backstep["theta_l"]) - backstep["b_d2"] * rate[thigh]
        else:
            couple = -k[s, 0] * (angle[thigh] + upright - gait["theta_l"][s]) - b[s, 0] * rate[thigh]
        pitch += couple
        Q[hip] = couple
        Q[knee] = -k[s, 1] * q[knee] - b[s, 1] * v[knee]
        Q[ankle] = -k[s, 2] * (q[ankle] - gait["theta_a"][s]) - b[s, 2] * v[ankle]
    Q[PITCH] = pitch
