"""Prediction of the state now from what the sensors said of the state a while ago.

A delay is physics: meanwhile the robot has moved as its mechanics and the law's own torques moved it. So the law moves
its belief by the mechanics that it believes in (its M and h, wrong where they are wrong), tick by tick, under the
torques that it has commanded since. The ground only pushes: Moreau's principle, in Anitescu's form. With the velocity
that the forces alone would lead to in a tick, v_f = v + dt M⁻¹(Q - h), that at its end is

    v⁺ = argmin ½‖v⁺ - v_f‖²_M  subject to  G v⁺ >= -gap/dt,   q⁺ = q + dt v⁺

with the edges G of the friction cones and the knees' stops, as in `biped.control.planar.pushing`, but without errors
drawn on A: a foot stands where the law computes it to be, and a row that says otherwise would have it slide. A point
above the ground by more than `contact_height` has a gap, so that it lands in the prediction before its landing is
sensed.

What is sensed is noisy as well. The belief about the instant that was sensed goes on by the same mechanics from tick to
tick, and goes towards what is sensed with a time constant: a steady-state observer. With neither delay nor time
constants the belief is what is sensed.
"""

import math
from typing import NamedTuple

import numpy as np

from biped.base.jit import kernel
from biped.control.blending import fraction
from biped.control.planar.constraints import perturbed_mass
from biped.control.planar.estimator import ground_under, sensed_posture
from biped.control.planar.pushing import Q_LANE, cone_edges, gram
from biped.numerics.lanes import LANES, load, times, total
from biped.numerics.quadratic import MOST, nonnegative
from biped.robot.ground import height_below
from biped.robot.planar.kinematics import PLACES, bias_forces, forward, mass_matrix
from biped.robot.planar.topology import BASE, KNEE, N_POINTS, N_ROWS, NQ, NU, PITCH, STOP_ROW, X, Z
from biped.robot.planar.weighing import factor_from_feet, substitute_from_feet, weigh
from biped.scenario.keys import Scenario

PREDICTOR = np.dtype(
    [
        ("dt", "f8"), ("ticks", "i8"), ("friction", "f8"),  # s; over which it predicts
        ("observing", "u1"),
        ("place", "f8"), ("rate", "f8"),  # shares of the way to what is sensed that are gone in a tick
        ("sensed", "u1", NQ),  # whether a rate is sensed, or believed from places alone
        ("q", "f8", NQ), ("v", "f8", NQ),  # believed of the instant that was sensed
        ("seen_q", "f8", NQ), ("seen_v", "f8", NQ),  # and what is sensed of it
        # Work space of a step of the mechanics.
        ("at", PLACES), ("M", "f8", (NQ, NQ)), ("full", "f8", (NQ, NQ)), ("h", "f8", NQ), ("spring", "f8", NU),
        ("n", "f8", NQ), ("t", "f8", NQ), ("speed", "f8", N_POINTS),
        ("A", "f8", (NQ, LANES)), ("C", "f8", (NQ, LANES)), ("L", "f8", (NQ, NQ)), ("H", "f8", (N_ROWS, LANES)),
        ("f", "f8", (1, LANES)), ("force", "f8", (1, LANES)), ("left", "f8", (1, LANES)), ("x", "f8", NQ),
        ("held", "u1", N_ROWS), ("order", "i8", N_ROWS), ("U", "f8", (N_ROWS, LANES)), ("W", "f8", (N_ROWS, N_ROWS)),
    ],
    align=True,
)  # fmt: skip
"""A predictor: settings, what it believes of the instant that was sensed, and work space."""


class Prediction(NamedTuple):
    """A run's predictor as loops take it.

    Attributes:
        record: (1,) `PREDICTOR`.
        commands: (ticks + 1, 9) latest generalized forces commanded; tick k's stands at k % (ticks + 1).
        sensed_q: (9,) coordinates as they are sensed [m, rad], live.
        sensed_v: (9,) velocities as they are sensed, live.
    """

    record: np.ndarray
    commands: np.ndarray
    sensed_q: np.ndarray
    sensed_v: np.ndarray


def predicts(s: Scenario) -> bool:
    """Whether the law believes something else than what is sensed."""
    return max(s.sensing.predict, s.sensing.follow, s.sensing.follow_rates) > 0.0


def prediction_of(s: Scenario, q: np.ndarray, v: np.ndarray) -> Prediction:
    """A run's predictor.

    Args:
        s: Its scenario.
        q: (9,) sensed joint coordinates, live.
        v: (9,) sensed joint velocities, live.
    """
    keys, record = s.sensing, np.zeros(1, PREDICTOR)
    p, dt = record[0], 1.0 / s.simulation.control_rate
    p["dt"], p["ticks"] = dt, round(keys.predict / dt)
    p["friction"] = s.actuation.pushing.friction if keys.friction is None else keys.friction
    p["observing"] = max(keys.follow, keys.follow_rates) > 0.0
    p["place"], p["rate"] = fraction(keys.follow, dt), fraction(keys.follow_rates, dt)
    p["sensed"] = 1 if s.estimator is None else np.arange(NQ) == PITCH
    return Prediction(record, np.zeros((int(p["ticks"]) + 1, NQ)), q, v)


@kernel
def _least_speed(c, p, q, k):
    """The least speed [m/s, rad/s] of row k in a tick: what is above the ground may come down to it."""
    if k >= STOP_ROW:
        return min(0.0, q[KNEE[k - STOP_ROW]]) / p["dt"]
    i = k // 2
    height = q[Z] + p["at"]["point"][i, 1] - c["switches"]["under"][i]
    if c["ground"]["count"] > 0:
        height -= height_below(c["ground"], q[X] + p["at"]["point"][i, 0])
    return -height / p["dt"] if height > c["sensing"]["contact_height"] else 0.0


@kernel
def step(c, p, q, v, force):
    """Moves a state by a tick of the believed mechanics, in place.

    Args:
        c: Controller record: what the law believes.
        p: `PREDICTOR` record, for its work space.
        q: (9,) joint coordinates [m, rad].
        v: (9,) joint velocities.
        force: (9,) generalized forces that act.
    """
    at, belief, dt = p["at"], c["belief"], p["dt"]
    M, A, C, L, H, f, x, left = p["M"], p["A"], p["C"], p["L"], p["H"], p["f"], p["x"], p["force"]
    forward(c["tree"], q, v, 0.0, 0.0, at)
    bias_forces(c["tree"], at, belief["gravity"], p["h"])
    mass_matrix(c["tree"], at, M)
    if belief["perturbed"]:
        perturbed_mass(M, belief["mass_factor"], p["full"])
        for i in range(NQ):
            for j in range(NQ):
                M[i, j] = p["full"][i, j]
    cone_edges(c, at, v, p["friction"], False, p["n"], p["t"], A, p["speed"])
    for j in range(NQ):
        A[j, Q_LANE] = force[j] - p["h"][j]
    for j in range(NU):
        damping = c["tree"]["damping"][j]
        p["spring"][j] = dt * damping
        A[BASE + j, Q_LANE] -= damping * v[BASE + j]
    factor_from_feet(M, p["spring"], L)
    weigh(A, L, C)
    gram(C, H)
    for k in range(N_ROWS):
        speed = 0.0
        for j in range(NQ):
            speed += A[j, k] * v[j]
        f[0, k] = (_least_speed(c, p, q, k) - speed) / dt - H[k, Q_LANE]
    if nonnegative(H, f, N_ROWS, p["held"], p["order"], p["U"], p["W"], left, p["left"]) == MOST:
        c["tick"]["given_up"] = 1
    pushed = load(left, 0)
    for j in range(NQ):
        x[j] = C[j, Q_LANE] + total(times(pushed, load(C, j)))
    substitute_from_feet(L, x)
    for i in range(NQ):
        v[i] += dt * x[i]
        q[i] += dt * v[i]


@kernel
def _read_ground(c, p, estimator):
    """Takes points whose switches are closed to be on the ground and the others off it, at the sensed instant."""
    if len(estimator) == 0:
        return
    at, q = p["at"], p["q"]
    forward(c["tree"], q, p["v"], 0.0, 0.0, at)
    for i in range(N_POINTS):
        p["speed"][i] = q[Z] + at["point"][i, 1]
    ground_under(estimator, p["speed"], c["sensing"]["contact_height"], c["switches"]["under"])


@kernel
def _observe(c, p, estimator, commands, k, sensed_q, sensed_v):
    """Brings what is believed of the sensed instant up to tick k."""
    q, v, seen_q, seen_v, ticks = p["q"], p["v"], p["seen_q"], p["seen_v"], p["ticks"]
    for j in range(NQ):
        seen_q[j], seen_v[j] = sensed_q[j], sensed_v[j]
    if k > ticks:
        step(c, p, q, v, commands[(k - 1 - ticks) % (ticks + 1)])
        if len(estimator) > 0:
            forward(c["tree"], q, v, 0.0, 0.0, p["at"])
            sensed_posture(estimator, k, q, p["at"]["point"], seen_q, seen_v)
    if k <= ticks:  # every tick senses the start: the mean of what they say
        for j in range(NQ):
            q[j] += (seen_q[j] - q[j]) / (k + 1)
            v[j] += (seen_v[j] - v[j]) / (k + 1)
        return
    place, rate = p["place"], p["rate"]
    for j in range(NQ):
        off = seen_q[j] - q[j]
        if p["sensed"][j]:
            q[j] += place * off
            v[j] += rate * (seen_v[j] - v[j])
        else:  # critically damped
            q[j] += (2.0 - place) * place * off
            v[j] += place * place / p["dt"] * off


@kernel
def believe(predictor, estimator, record, k, q, v):
    """Writes what the law believes of the state at tick k, where it predicts; otherwise nothing.

    Args:
        predictor: (`Prediction`,), or () for none: a tuple's length is part of its type, so that loops are compiled
            with a predictor or without.
        estimator: (`biped.control.planar.estimator.Inference`,) where the posture is inferred, otherwise ().
        record: (1,) `biped.control.planar.setup.CONTROL`, which has the command of the tick before.
        k: Number of the tick.
        q: (9,) believed coordinates [m, rad], overwritten.
        v: (9,) believed velocities, overwritten.
    """
    if len(predictor) == 0:
        return
    one = predictor[0]
    c, p, commands = record[0], one.record[0], one.commands
    ticks = p["ticks"]
    if k > 0:
        latest = commands[(k - 1) % (ticks + 1)]
        for j in range(NQ):
            if c["actuation"]["generalized"]:
                latest[j] = c["tick"]["Q_d"][j]
            else:
                latest[j] = c["tick"]["u"][j - BASE] + c["observer"]["estimate"][j - BASE] if j >= BASE else 0.0
    if p["observing"]:
        _read_ground(c, p, estimator)
        _observe(c, p, estimator, commands, k, one.sensed_q, one.sensed_v)
    else:
        for j in range(NQ):
            p["q"][j], p["v"][j] = one.sensed_q[j], one.sensed_v[j]
    _read_ground(c, p, estimator)
    for j in range(NQ):
        q[j], v[j] = p["q"][j], p["v"][j]
    for i in range(max(0, k - ticks), k):
        step(c, p, q, v, commands[i % (ticks + 1)])
    for j in range(NQ):
        if not (math.isfinite(q[j]) and math.isfinite(v[j])):
            for i in range(NQ):
                q[i], v[i] = one.sensed_q[i], one.sensed_v[i]
            return
