"""What went wrong in a march, in words: when, which quantity, why."""

import numpy as np

from biped.dynamics import codes
from biped.dynamics.linalg import factor
from biped.dynamics.orthogonal import workspace
from biped.dynamics.schemes import Scheme
from biped.dynamics.system import ConstrainedSystem


def _ratio(system: ConstrainedSystem, t: float, q: np.ndarray, v: np.ndarray) -> float:
    w = workspace(system.n, system.m)
    e = system.evaluate(t, q, v)
    return float(w.ratio[0]) if np.isfinite(e.M).all() and factor(e.M, e.A, w) else 1.0


def explain(
    system: ConstrainedSystem, scheme: Scheme, code: int, t: float, q: np.ndarray, v: np.ndarray, dt: float
) -> str:
    """The message of a run that ended with a code at time t [s] in the state q, v (n,)."""
    where = f"{system.name}, {scheme.name}, dt = {dt:g} s: at t = {t:.6g} s"
    if code == codes.TOO_MANY_RETRIES:
        ratio = _ratio(system, t, q, v)
        why = (
            f" (a singular position is near, pivot ratio {ratio:.1e}: rounding errors grow there like 1/ratio²)"
            if ratio < 0.03
            else ""
        )
        return f"{where} no step passes the error test{why}; loosen the tolerance, or use fixed steps"
    if code == codes.UNSETTLED:
        return (
            f"{where} the constraint error does not settle, its correction is as large as the motion itself: "
            f"the step is too long, q = {q}, v = {v}"
        )
    if code == codes.NOT_PROJECTED:
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
    if code == codes.INDEFINITE:
        least = np.linalg.eigvalsh(e.M)[0]
        return f"{where} the mass matrix is not positive definite: smallest eigenvalue {least:.3g}, q = {q}"
    return f"{where} the acceleration is not finite, q = {q}, v = {v}"
