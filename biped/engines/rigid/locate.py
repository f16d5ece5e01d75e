"""When within a step the first event happens: gaps close, and forces begin to pull.

The first crossing is bracketed, predicted by the cubic through gaps and gap rates at both ends of the bracket (forces:
by the chord), and the step is tried again with that length until the event is met.
"""

from biped.base.jit import kernel
from biped.engines.rigid.motion import evaluate
from biped.engines.rigid.release import TOUCH, multiplier_row, pulled
from biped.robot.planar.topology import N_CONSTRAINTS, N_ROWS, NQ

PULL = 1e-3
"""[N, N m] of pull within which a release is met."""
HOP = 1e-3
"""Fraction of a step: what leaves the ground for a shorter time has not left it. The hops of a rocking foot become
ever shorter; this is where they end."""
SEARCH = 16
"""Most shortened steps tried for one event; two or three are usual."""


@kernel
def _open(w, i):
    return w["contact"]["active"][i] == 0


@kernel
def _may_release(w, i):
    contact = w["contact"]
    return contact["active"][i] == 1 and contact["held"][i] == 0


@kernel
def beyond_event(w):
    """Whether the tentative step ends beyond an event."""
    for i in range(N_CONSTRAINTS):
        if _open(w, i) and w["system"]["gap"][i] < -TOUCH:
            return True
    return pulled(w)


@kernel
def _bracket(w, end, stage):
    """Keeps one end of the bracket; stage 0 is the step's start, 4 the end of the latest attempt."""
    bracket, stages, system = w["bracket"], w["stages"], w["system"]
    for i in range(N_CONSTRAINTS):
        if stage == 0:
            bracket["gap"][end, i], bracket["gap_rate"][end, i] = (
                stages["gap"][i],
                stages["gap_rate"][i],
            )
        else:
            bracket["gap"][end, i], bracket["gap_rate"][end, i] = (
                system["gap"][i],
                system["gap_rate"][i],
            )
        bracket["lam"][end, i] = stages["lam"][stage, multiplier_row(i)]
        if end == 1:
            gone_through = _open(w, i) and system["gap"][i] < -TOUCH
            bracket["beyond"][i] = gone_through or (_may_release(w, i) and bracket["lam"][end, i] < 0.0)


@kernel
def locate(w, h):
    """Shortens the step to its first event and leaves the attempt that ends there.

    Args:
        w: Record; the latest attempt had length h and ended beyond an event.
        h: [s].

    Returns:
        The length [s] of the step.
    """
    low, high = 0.0, h
    for i in range(N_CONSTRAINTS):
        w["bracket"]["resting"][i] = 0
    _bracket(w, 0, 0)
    _bracket(w, 1, 4)
    for search in range(SEARCH):
        if _met(w):
            return high
        # Every fourth try halves the bracket, so that no shape of a gap can keep the prediction at one end.
        part = 0.5 if search % 4 == 3 else _first_crossing(w, high - low)
        middle = low + part * (high - low)
        if part == 0.0:
            attempt(w, low)
            return low
        attempt(w, middle)
        if beyond_event(w):
            high = middle
            _bracket(w, 1, 4)
        elif _closed(w):
            return middle
        else:
            low = middle
            _bracket(w, 0, 4)
    attempt(w, high)
    return high


@kernel
def _met(w):
    """Whether the late end of the bracket is an event within tolerance."""
    bracket = w["bracket"]
    for i in range(N_CONSTRAINTS):
        if bracket["beyond"][i] and (_open(w, i) or bracket["lam"][1, i] < -PULL):
            return False
    return True


@kernel
def _closed(w):
    """Whether a gap has just closed, within tolerance, at the end of the latest attempt."""
    system = w["system"]
    for i in range(N_CONSTRAINTS):
        if _open(w, i) and system["gap"][i] < TOUCH and system["gap_rate"][i] < 0.0:
            return True
    return False


@kernel
def _first_crossing(w, length):
    """Fraction of the bracket at which the first of those that are beyond crosses, as predicted."""
    bracket = w["bracket"]
    first = 1.0
    for i in range(N_CONSTRAINTS):
        if not bracket["beyond"][i]:
            continue
        if _open(w, i):
            g = bracket["gap"]
            crossing = _cubic_crossing(g[0, i], bracket["gap_rate"][0, i], g[1, i], bracket["gap_rate"][1, i], length)
            bracket["resting"][i] = crossing == 0.0
            first = min(first, crossing)
        else:
            early, late = bracket["lam"][0, i] + 0.5 * PULL, bracket["lam"][1, i] + 0.5 * PULL
            if early > late:
                # Never all the way back: a release needs a pull, however small, and that needs a step.
                first = min(first, max(1e-2, early / (early - late)))
    return first


@kernel
def _cubic_crossing(gap, rate, late_gap, late_rate, length):
    """Fraction 0 … 1 at which the cubic through two gaps and their rates [1/s] falls through zero; late_gap < 0."""
    a, b = length * rate, length * late_rate
    c2 = 3.0 * (late_gap - gap) - 2.0 * a - b
    c3 = a + b - 2.0 * (late_gap - gap)
    low, high = 0.0, 1.0
    if gap <= 0.0:
        # A point that has just left the ground starts at zero: look for where it is above.
        low = 0.5
        while low > HOP and gap + low * (a + low * (c2 + low * c3)) <= 0.0:
            high = low
            low *= 0.5
        if low <= HOP:
            return 0.0
    for _ in range(50):
        middle = 0.5 * (low + high)
        if gap + middle * (a + middle * (c2 + middle * c3)) > 0.0:
            low = middle
        else:
            high = middle
    return low


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
