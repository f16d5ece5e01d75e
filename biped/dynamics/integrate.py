"""From a system, a start and a scheme to a trajectory, or to an error that says what went wrong."""

from functools import cache
from typing import Any

import numpy as np
from numba import float64, typeof, types
from numpy.typing import ArrayLike

from biped.base.errors import InputError, RunError
from biped.base.jit import kernel
from biped.dynamics import march, pattern
from biped.dynamics import room as rooms
from biped.dynamics.compiled import EVENT, OK, SPILLED
from biped.dynamics.explain import explain, obstacle
from biped.dynamics.rank import structural_rank
from biped.dynamics.schemes import RK4, Scheme
from biped.dynamics.sparse import Sparse, dense
from biped.dynamics.system import SIGNATURES, ConstrainedSystem
from biped.dynamics.trajectory import Solution

MOST_VALUES = 500_000_000
"""Numbers a trajectory may hold (4 GB)."""

SAMPLED = rooms.Samples._fields[:8]
"""Arrays that a trajectory takes over from the march, by the same names."""

PATTERNS = 20
"""Times that entries may turn up where none were expected, before all are expected everywhere."""


def integrate(
    system: ConstrainedSystem,
    q: ArrayLike,
    v: ArrayLike,
    *,
    duration: float,
    dt: float | None = None,
    sampling: float | None = None,
    scheme: Scheme = RK4,
    t: float = 0.0,
    every: int = 1,
    rank: int | None = None,
) -> Solution:
    """Simulate a system from a start that need not satisfy the constraints.

    Args:
        system: The system.
        q: (n,) coordinates at the start.
        v: (n,) velocities at the start.
        duration: Time to simulate [s]; rounded to whole steps.
        dt: The step [s]; with an adaptive scheme the longest one. Not given: `sampling`.
        sampling: Time between samples [s], a multiple of dt. Not given: `every` times dt.
        scheme: How to step.
        t: Time of the start [s].
        every: Keep one sample in so many steps; the last state is always kept. An alternative to `sampling`.
        rank: Largest rank the constraints may have; not given: found from the start and its neighbours.

    Returns:
        The trajectory, the start and the last state included; shorter than asked for if an event ended it.

    Raises:
        InputError: A size, step or duration cannot be used, or the mass matrix is not symmetric.
        RunError: The motion could not be carried to its end; the message has time, quantity and cause.
    """
    if not isinstance(system, ConstrainedSystem):
        raise InputError(f"integrate needs a ConstrainedSystem, not {system!r}")
    if not isinstance(scheme, Scheme):
        raise InputError(f"{system.name}: the scheme must be EULER, RK4, RK8 or derived from one, not {scheme!r}")
    optional = {"dt": dt, "sampling": sampling, "rank": rank}
    _numbers(system, duration=duration, t=t, every=every, **{k: x for k, x in optional.items() if x is not None})
    q, v = system.state("q", q), system.state("v", v)
    system.try_out(t, q, v)
    dt, every = _sampling(system, dt, sampling, every)
    steps = _steps(system, duration, dt, t, every)
    _check_start(system, t, q, v, scheme)
    samples = -(-steps // every) + 1
    if samples * (2 * system.n + 5 + len(system.powers)) > MOST_VALUES:
        raise InputError(f"{samples} samples of {system.name} do not fit in memory: raise every={every}")
    grid = rooms.Grid(float(t), float(dt), steps, every)
    filled = pattern.find(system, t, q, v) if system.n + system.m >= pattern.LEAST_SIZE else None
    for _ in range(PATTERNS):
        K = dense() if filled is None else pattern.plan(*filled)
        most = _rank(system, rank, t, q, v, K)
        place = rooms.room(system.n, system.m, scheme.rows, len(system.powers), len(system.events), K)
        place.factors.use[1] = most
        out = rooms.samples(samples, system.n, len(system.powers))
        end_q, end_v = q.copy(), v.copy()
        loop: Any = compiled_march() if system.compiled else march.march
        code, when = loop(
            *system.functions, system.p, grid, scheme.settings(), scheme.tableau, end_q, end_v, place, out
        )
        if code != SPILLED or filled is None:
            break
        filled = (filled[0] | (place.M != 0.0) | (place.M != 0.0).T, filled[1] | (place.A != 0.0))
    if code not in (OK, EVENT):
        raise RunError(explain(system, scheme, code, when, end_q, end_v, dt))
    kept = out.count[rooms.KEPT]
    return Solution(
        **{name: values[:kept] for name, values in zip(SAMPLED, out[:8], strict=True)},
        steps=int(out.count[rooms.TAKEN]),
        evaluations=int(place.seen[rooms.EVALUATED]),
        splits=int(place.seen[rooms.SPLIT]),
        leaps=int(place.seen[rooms.LEAPT]),
        refused=int(place.seen[rooms.REFUSED]),
        structural_rank=most,
        event=system.events[int(place.seen[rooms.FIRED])] if code == EVENT else None,
        system=system,
    )


@cache
def compiled_march() -> Any:
    """The marching loop, compiled for any system; from numba's cache after the first time."""
    functions = [types.FunctionType(signature) for signature in SIGNATURES.values()]
    vector = float64[::1]
    grid = typeof(rooms.Grid(0.0, 0.0, 1, 1))
    scheme = (typeof(RK4.settings()), typeof(RK4.tableau))
    room = typeof(rooms.room(1, 1, 1, 1, 1))
    signature = (*functions, vector, grid, *scheme, vector, vector, room, typeof(rooms.samples(1, 1, 1)))
    return kernel(march.march, signature)


def _numbers(system: ConstrainedSystem, **given: object) -> None:
    """Refuse what is given as a number and is none."""
    for name, value in given.items():
        if isinstance(value, bool) or not isinstance(value, (int, float, np.integer, np.floating)):
            raise InputError(f"{system.name}: {name} must be a number, not {value!r}")
        if name in ("every", "rank") and not isinstance(value, (int, np.integer)):
            raise InputError(f"{system.name}: {name} must be a whole number, not {value!r}")


def _sampling(system: ConstrainedSystem, dt: float | None, sampling: float | None, every: int) -> tuple[float, int]:
    """The step [s] and the number of steps between two samples."""
    if sampling is None:
        if dt is not None:
            return dt, every
        raise InputError(f"{system.name}: give the step dt or, with an adaptive scheme, the time between samples")
    if not (np.isfinite(sampling) and sampling > 0.0):
        raise InputError(f"{system.name}: sampling must be positive and finite, not {sampling}")
    if every != 1:
        raise InputError(f"{system.name}: give sampling={sampling} or every={every}, not both")
    if dt is None:
        return sampling, 1
    if not (np.isfinite(dt) and dt > 0.0):
        raise InputError(f"{system.name}: the step dt must be positive and finite, not {dt}")
    steps = round(sampling / dt)
    if steps < 1 or abs(steps * dt - sampling) > 1e-9 * sampling:
        raise InputError(f"{system.name}: sampling must be a multiple of dt, but {sampling} / {dt} = {sampling / dt:g}")
    return dt, steps


def _rank(system: ConstrainedSystem, cap: int | None, t: float, q: np.ndarray, v: np.ndarray, K: Sparse) -> int:
    """The rank as given or found; a start that is found to lead nowhere is refused."""
    if cap is None:
        most, place = structural_rank(system, t, q, v, K)
        why = None if place is None else obstacle(system, t, place, v)
        if why is not None:
            raise InputError(f"{system.name}: {why}")
        return most
    most = min(system.n, system.m)
    if not 0 <= cap <= most:
        raise InputError(f"{system.name}: rank must be from 0 to {most}, not {cap}")
    return cap


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
