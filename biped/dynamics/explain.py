"""Failures in words: why no motion goes on from a start, and when and why a march went wrong.

Where rows of a start depend on each other, more velocities satisfy A v = 0 than branches of the motion have, and more
accelerations A a = b_v: where uᵀA = 0, the constraints of second order, uᵀ b_v = 0, remain. Redundant rows keep them of
themselves.
"""

import numpy as np

from biped.dynamics.compiled import INDEFINITE, NOT_PROJECTED, TOO_MANY_RETRIES, UNSETTLED
from biped.dynamics.linalg import factor
from biped.dynamics.orthogonal import workspace
from biped.dynamics.rank import TIGHT, Place
from biped.dynamics.schemes import Scheme
from biped.dynamics.system import ConstrainedSystem

CONTRADICTED = 1e-6
"""Part of q that constraints may be off by where they are nearest to being satisfied."""

BRANCHLESS = 1e-6
"""Part of b_v that no acceleration gives, above which no motion has the velocity."""


def obstacle(system: ConstrainedSystem, t: float, place: Place, v: np.ndarray) -> str | None:
    """Why no motion goes on from a start, or which one is not determined; None if one does.

    Args:
        system: The system.
        t: [s].
        place: The start on the constraints.
        v: (n,) velocities, which need not satisfy the constraints.
    """
    try:
        return _obstacle(system, t, place, v)
    except np.linalg.LinAlgError:
        return None  # what it stumbles over is told where the motion stops


def _obstacle(system: ConstrainedSystem, t: float, place: Place, v: np.ndarray) -> str | None:
    e = system.evaluate(t, place.q, v)
    if place.left > CONTRADICTED * (1.0 + np.abs(place.q).max()):
        return (
            "the constraints cannot all be satisfied: near the start nothing brings them closer than "
            f"{place.left:.2g} (rows of length one), where Φ = {e.phi}"
        )
    length = np.linalg.norm(e.A, axis=1)
    length[length <= TIGHT * length.max()] = np.inf
    U, s, V = np.linalg.svd(e.A / length[:, None])
    if not np.abs(e.phi / length).max() <= TIGHT * (1.0 + np.abs(place.q).max()):
        return None  # constraints that cannot be satisfied have no branches to look for
    here = int((s > TIGHT * s[0]).sum())
    dependent, allowed = U[:, here:], V[here:].T

    def nearest(x: np.ndarray, b: np.ndarray) -> np.ndarray:
        """The y nearest to x, in the metric of M, with A y = b as far as that has a solution."""
        y = V[:here].T @ ((U[:, :here].T @ (b / length)) / s[:here])
        return y + allowed @ np.linalg.solve(allowed.T @ e.M @ allowed, allowed.T @ e.M @ (x - y))

    def curvature(speed: np.ndarray) -> np.ndarray:
        """b_v at a velocity (n,), without what it is at rest."""
        b = [system.evaluate(t, place.q, x).b_v for x in (speed, -speed, 0.0 * speed)]
        return (0.5 * (b[0] + b[1]) - b[2]) / length

    v = nearest(v, e.b_q)
    if np.abs(v).max() > TIGHT:
        asked = system.evaluate(t, place.q, v).b_v / length
        if np.linalg.norm(dependent.T @ asked) <= BRANCHLESS * np.linalg.norm(asked):
            return None
        return (
            "the start is in a singular position with a velocity that no motion has there: "
            "A a = b_v has no solution; expected the velocity of one of its branches, or rest"
        )
    free = np.linalg.solve(e.M, e.Q)
    bent = curvature(nearest(free, system.evaluate(t, place.q, 0.0 * v).b_v))
    if np.linalg.norm(dependent.T @ bent) <= BRANCHLESS * max(np.linalg.norm(bent), np.linalg.norm(curvature(free))):
        return None
    return (
        "the start is at rest in a singular position, and its forces push where no motion on the constraints goes: no "
        "finite constraint force holds it, or which branch it takes is not determined; expected a position beside it, "
        "or the velocity of one of its branches"
    )


def _ratio(system: ConstrainedSystem, t: float, q: np.ndarray, v: np.ndarray) -> float:
    w = workspace(system.n, system.m)
    e = system.evaluate(t, q, v)
    return float(w.ratio[0]) if np.isfinite(e.M).all() and factor(e.M, e.A, w) else 1.0


def explain(
    system: ConstrainedSystem, scheme: Scheme, code: int, t: float, q: np.ndarray, v: np.ndarray, dt: float
) -> str:
    """The message of a run that ended with a code at time t [s] in the state q, v (n,)."""
    where = f"{system.name}, {scheme.name}, dt = {dt:g} s: at t = {t:.6g} s"
    if code == TOO_MANY_RETRIES:
        ratio = _ratio(system, t, q, v)
        why = (
            f" (a singular position is near, pivot ratio {ratio:.1e}: rounding errors grow there like 1/ratio²)"
            if ratio < 0.03
            else ""
        )
        return f"{where} no step passes the error test{why}; loosen the tolerance, or use fixed steps"
    if code == UNSETTLED:
        return (
            f"{where} the constraint error does not settle, its correction is as large as the motion itself: "
            f"the step is too long, q = {q}, v = {v}"
        )
    if code == NOT_PROJECTED:
        return f"{where} the projection onto the constraints does not converge: the step is too long"
    if not (np.isfinite(q).all() and np.isfinite(v).all()):
        return f"{where} the state is no longer finite: the motion diverged, try a shorter step"
    with np.errstate(all="ignore"):
        e = system.evaluate(t, q, v)
    for name, values in zip(e._fields, e, strict=True):
        if not np.isfinite(values).all():
            return f"{where} {name} is not finite: {name} = {values}, q = {q}, v = {v}"
    events = np.zeros(len(system.events))
    system.functions[8](t, q, v, system.p, events)
    if np.isnan(events).any():
        name = system.events[int(np.argmax(np.isnan(events)))]
        return f"{where} the event {name} is not a number, q = {q}, v = {v}"
    if code == INDEFINITE:
        least = np.linalg.eigvalsh(e.M)[0]
        return f"{where} the mass matrix is not positive definite: smallest eigenvalue {least:.3g}, q = {q}"
    return f"{where} the acceleration is not finite, q = {q}, v = {v}"
