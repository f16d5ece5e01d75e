"""One Runge-Kutta step of the constrained motion, tentative until `biped.engines.rigid.events` accepts it."""

from __future__ import annotations

from biped.base.jit import kernel
from biped.engines.rigid.motion import evaluate
from biped.robot.planar.topology import N_CONSTRAINTS, N_ROWS, NQ


@kernel
def keep_stage(w, stage):
    """Keeps the latest evaluation as stage 0 … 3 of a step, or 4, its end."""
    stages, motion, system = w["stages"], w["motion"], w["system"]
    for j in range(NQ):
        stages["q_dot"][stage, j], stages["v_dot"][stage, j] = (
            motion["q_dot"][j],
            motion["v_dot"][j],
        )
    for row in range(N_ROWS):
        stages["lam"][stage, row] = motion["lam"][row]
    stages["power"][stage] = motion["power"]
    if stage == 0:
        for j in range(NQ):
            stages["shift"][j] = motion["shift"][j]
        for i in range(N_CONSTRAINTS):
            stages["gap"][i], stages["gap_rate"][i] = system["gap"][i], system["gap_rate"][i]


@kernel
def attempt(w, h):
    """A step of length h [s] from (q0, v0), whose evaluation is stage 0, to (q1, v1), and the evaluation there."""
    state, stages = w["state"], w["stages"]
    q0, v0, q1, v1, k_q, k_v = (
        state["q0"],
        state["v0"],
        state["q1"],
        state["v1"],
        stages["q_dot"],
        stages["v_dot"],
    )
    for stage in range(1, 4):
        part = h if stage == 3 else 0.5 * h
        for j in range(NQ):
            q1[j] = q0[j] + part * k_q[stage - 1, j]
            v1[j] = v0[j] + part * k_v[stage - 1, j]
        evaluate(w, q1, v1)
        keep_stage(w, stage)
    for j in range(NQ):
        q1[j] = q0[j] + h / 6.0 * (k_q[0, j] + 2.0 * (k_q[1, j] + k_q[2, j]) + k_q[3, j]) + stages["shift"][j]
        # -WΦ̇ at the start is what the first stage's q̇ has over v.
        v1[j] = v0[j] + h / 6.0 * (k_v[0, j] + 2.0 * (k_v[1, j] + k_v[2, j]) + k_v[3, j]) + k_q[0, j] - v0[j]
    evaluate(w, q1, v1)
    keep_stage(w, 4)
