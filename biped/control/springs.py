"""The spring-damper couples: desired generalized forces Q_d, (3.16)-(3.17), in joint coordinates."""

from __future__ import annotations

import math

from biped.base.jit import kernel


@kernel
def desired_forces(c, q, v):
    """Writes Q_d (9,) [N, N m] into the record from link angles, leg states and gains.

    Torso and thighs are held to the inertial frame, knees and ankles to their neighbours. In joint coordinates a knee's
    or ankle's couple is just its joint's torque, a thigh's acts on hip and pitch, the torso's on pitch (virtual work).
    A leg that steps back (`biped.control.backstep`) has a thigh couple of its own.
    """
    Q, angle, rate, k, b = c["Q_d"], c["angle"], c["rate"], c["k"], c["b"]
    upright = 0.5 * math.pi + c["tilt"]
    Q[0] = 0.0
    Q[1] = 0.0
    pitch = -c["k_d1"] * (angle[0] + upright - c["theta_b"]) - c["b_d1"] * rate[0]
    for leg in range(2):
        s = c["phase"][leg]
        thigh = 1 + 3 * leg
        hip = 3 + 3 * leg
        if c["back"] and s == 3:
            couple = -c["k_back"] * (angle[thigh] + upright - c["theta_back"]) - c["b_back"] * rate[thigh]
        else:
            couple = -k[s, 0] * (angle[thigh] + upright - c["theta_l"][s]) - b[s, 0] * rate[thigh]
        pitch += couple
        Q[hip] = couple
        Q[hip + 1] = -k[s, 1] * q[hip + 1] - b[s, 1] * v[hip + 1]
        Q[hip + 2] = -k[s, 2] * (q[hip + 2] - c["theta_a"][s]) - b[s, 2] * v[hip + 2]
    Q[2] = pitch
