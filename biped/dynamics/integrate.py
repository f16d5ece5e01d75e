"""From a system, a start and a scheme to a trajectory, or to an error that says what went wrong."""

from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from numba import float64, int64, typeof, types
from numpy.typing import ArrayLike

from biped.base.errors import InputError, RunError
from biped.base.jit import kernel
from biped.dynamics import march, stages
from biped.dynamics.schemes import RK4, Scheme
from biped.dynamics.system import SIGNATURES, ConstrainedSystem

MOST_VALUES = 500_000_000
"""Numbers a trajectory may hold (4 GB)."""


@dataclass(frozen=True, eq=False)
class Trajectory:
    """What an integration leaves behind, K samples.

    Attributes:
        t: (K,) time [s].
        q: (K, n) coordinates.
        v: (K, n) velocities.
        phi: (K,) largest |Φ| of all steps since the sample before.
        phi_dot: (K,) largest |Φ̇| of all steps since the sample before.
        ratio: (K,) smallest pivot ratio of C at the steps since the sample before; small: near a singularity.
        rank: (K,) smallest rank of C at the steps since the sample before.
        steps: Steps taken.
        evaluations: Times the system's functions were evaluated.
        splits: Steps taken in unequal parts to keep away from a singularity.
        refused: Steps an adaptive scheme did again.
    """

    t: np.ndarray
    q: np.ndarray
    v: np.ndarray
    phi: np.ndarray
    phi_dot: np.ndarray
    ratio: np.ndarray
    rank: np.ndarray
    steps: int
    evaluations: int
    splits: int
    refused: int


def integrate(
    system: ConstrainedSystem,
    q: ArrayLike,
    v: ArrayLike,
    *,
    duration: float,
    dt: float,
    scheme: Scheme = RK4,
    t: float = 0.0,
    every: int = 1,
) -> Trajectory:
    """Simulate a system from a start that need not satisfy the constraints.

    Args:
        system: The system.
        q: (n,) coordinates at the start.
        v: (n,) velocities at the start.
        duration: Time to simulate [s]; rounded to whole steps.
        dt: Step [s]; with an adaptive scheme the time between samples, which its steps do not cross.
        scheme: How to step.
        t: Time of the start [s].
        every: Keep one sample in so many steps; the last state is always kept.

    Returns:
        The trajectory, the start and the last state included.

    Raises:
        InputError: A size, step or duration cannot be used, or the mass matrix is not symmetric.
        RunError: The motion could not be carried to its end; the message has time, quantity and cause.
    """
    q, v = _state(system, "q", q), _state(system, "v", v)
    steps = _steps(system, duration, dt, t, every)
    _check_start(system, t, q, v, scheme)
    samples = -(-steps // every) + 1
    if samples * (2 * system.n + 5) > MOST_VALUES:
        raise InputError(f"{samples} samples of {system.name} do not fit in memory: raise every={every}")
    out = march.Samples(
        np.zeros(samples),
        np.zeros((samples, system.n)),
        np.zeros((samples, system.n)),
        np.zeros(samples),
        np.zeros(samples),
        np.ones(samples),
        np.full(samples, system.m),
        np.zeros(5, np.int64),
    )
    loop: Any = compiled_march() if system.compiled else march.march
    grid = march.Grid(float(t), float(dt), steps, every)
    room = stages.room(system.n, system.m, scheme.tableau.b.size)
    code, when = loop(*system.functions, system.p, grid, scheme.settings(), scheme.tableau, q, v, room, out)
    if code != march.OK:
        raise RunError(_explain(system, scheme, code, when, q, v, dt))
    return Trajectory(*out[:7], *(int(c) for c in out.count[1:]))


@cache
def compiled_march() -> Any:
    """The marching loop, compiled for any system; from numba's cache after the first time."""
    functions = [types.FunctionType(signature) for signature in SIGNATURES.values()]
    vector, matrix = float64[::1], float64[:, ::1]
    grid = typeof(march.Grid(0.0, 0.0, 1, 1))
    out = types.NamedTuple((vector, matrix, matrix, vector, vector, vector, int64[::1], int64[::1]), march.Samples)
    scheme = (typeof(RK4.settings()), typeof(RK4.tableau))
    signature = (*functions, vector, grid, *scheme, vector, vector, typeof(stages.room(1, 1, 1)), out)
    return kernel(march.march, signature)


def _state(system: ConstrainedSystem, name: str, value: ArrayLike) -> np.ndarray:
    try:
        array = np.array(value, dtype=float)
    except (TypeError, ValueError) as error:
        raise InputError(f"{system.name}: {name} must be {system.n} numbers: {error}") from error
    if array.shape != (system.n,):
        raise InputError(f"{system.name}: {name} must have shape ({system.n},), not {array.shape}")
    if not np.isfinite(array).all():
        raise InputError(f"{system.name}: {name} must be finite at the start, not {array}")
    return array


def _steps(system: ConstrainedSystem, duration: float, dt: float, t: float, every: int) -> int:
    if not (np.isfinite(dt) and dt > 0.0):
        raise InputError(f"{system.name}: the step dt must be positive and finite, not {dt}")
    if not (np.isfinite(duration) and duration > 0.0 and np.isfinite(t)):
        raise InputError(f"{system.name}: duration must be positive and t finite, not {duration} and {t}")
    if every < 1:
        raise InputError(f"{system.name}: every must be at least 1, not {every}")
    if not 0.5 <= duration / dt < 1e12 or t + dt == t:
        raise InputError(f"{system.name}: steps of {dt} s do not go into {duration} s from t = {t} s")
    return round(duration / dt)


def _check_start(system: ConstrainedSystem, t: float, q: np.ndarray, v: np.ndarray, scheme: Scheme) -> None:
    if scheme.energy and not system.has_potential:
        raise InputError(f"{system.name}: {scheme.name} needs a potential")
    M = system.evaluate(t, q, v).M
    size = np.abs(M).max()
    if np.isfinite(size) and np.abs(M - M.T).max() > 1e-12 * size:
        i, j = np.unravel_index(np.argmax(np.abs(M - M.T)), M.shape)
        raise InputError(
            f"{system.name}: the mass matrix must be symmetric, but M[{i},{j}] = {M[i, j]:g} "
            f"and M[{j},{i}] = {M[j, i]:g}"
        )


def _explain(
    system: ConstrainedSystem, scheme: Scheme, code: int, t: float, q: np.ndarray, v: np.ndarray, dt: float
) -> str:
    where = f"{system.name}, {scheme.name}, dt = {dt:g} s: at t = {t:.6g} s"
    if code == march.TOO_MANY_RETRIES:
        return f"{where} no step passes the error test; loosen the tolerance, or use fixed steps"
    if code == march.UNSETTLED:
        return (
            f"{where} the constraint error does not settle, its correction is as large as the motion itself: "
            f"the step is too long, q = {q}, v = {v}"
        )
    if code == march.NOT_PROJECTED:
        return f"{where} the projection onto the constraints does not converge: the step is too long"
    if not (np.isfinite(q).all() and np.isfinite(v).all()):
        return f"{where} the state is no longer finite: the motion diverged, try a shorter step"
    with np.errstate(all="ignore"):
        e = system.evaluate(t, q, v)
    for name, values in zip(e._fields, e, strict=True):
        if not np.isfinite(values).all():
            return f"{where} {name} is not finite: {name} = {values}, q = {q}, v = {v}"
    if code == march.INDEFINITE:
        least = np.linalg.eigvalsh(e.M)[0]
        return f"{where} the mass matrix is not positive definite: smallest eigenvalue {least:.3g}, q = {q}"
    return f"{where} the acceleration is not finite, q = {q}, v = {v}"
