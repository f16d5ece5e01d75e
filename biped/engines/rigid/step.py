"""One Runge-Kutta step of the constrained motion, tentative until `biped.engines.rigid.events` accepts it."""

from __future__ import annotations

from biped.base.jit import kernel
from biped.engines.rigid.motion import evaluate


@kernel
def keep_stage(w, stage):
    """Keeps the latest evaluation as stage 0 … 3 of a step, or 4, its end."""
    for j in range(9):
        w["k_q"][stage, j], w["k_v"][stage, j] = w["q_dot"][j], w["v_dot"][j]
    for row in range(10):
        w["k_lam"][stage, row] = w["lam"][row]
    w["k_power"][stage] = w["power"]
    if stage == 0:
        for j in range(9):
            w["k_shift"][j] = w["shift"][j]
        for i in range(6):
            w["k_gap"][i], w["k_gap_rate"][i] = w["gap"][i], w["gap_rate"][i]


@kernel
def attempt(w, h):
    """A step of length h [s] from (q0, v0), whose evaluation is stage 0, to (q1, v1), and the evaluation there."""
    q0, v0, q1, v1, k_q, k_v = w["q0"], w["v0"], w["q1"], w["v1"], w["k_q"], w["k_v"]
    for stage in range(1, 4):
        part = h if stage == 3 else 0.5 * h
        for j in range(9):
            q1[j] = q0[j] + part * k_q[stage - 1, j]
            v1[j] = v0[j] + part * k_v[stage - 1, j]
        evaluate(w, q1, v1)
        keep_stage(w, stage)
    for j in range(9):
        q1[j] = q0[j] + h / 6.0 * (k_q[0, j] + 2.0 * (k_q[1, j] + k_q[2, j]) + k_q[3, j]) + w["k_shift"][j]
        # -WΦ̇ at the start is what the first stage's q̇ has over v.
        v1[j] = v0[j] + h / 6.0 * (k_v[0, j] + 2.0 * (k_v[1, j] + k_v[2, j]) + k_v[3, j]) + k_q[0, j] - v0[j]
    evaluate(w, q1, v1)
    keep_stage(w, 4)
