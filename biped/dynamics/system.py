"""A constrained mechanical system, as a few plain functions."""

import inspect
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numba import float64, njit, types
from numba.core.errors import NumbaError
from numpy.typing import ArrayLike

from biped.base.errors import InputError
from biped.base.jit import cached

_V, _M = float64[::1], float64[:, ::1]
VECTOR = types.void(float64, _V, _V, _V, _V)
MATRIX = types.void(float64, _V, _V, _V, _M)
SCALAR = float64(float64, _V, _V, _V)
SIGNATURES = {
    "mass": MATRIX,
    "force": VECTOR,
    "phi": VECTOR,
    "A": MATRIX,
    "b_q": VECTOR,
    "b_v": VECTOR,
    "potential": SCALAR,
    "power": VECTOR,
    "event": VECTOR,
}
"""Functions that the compiled loop calls, in its order: each gets (t, q, v, p) and an array to fill."""


def _nothing(t, q, v, p, out):
    """Leave the zeros that are there."""


def _no_potential(t, q, v, p):
    """Say that a potential was not given."""
    return np.nan


class Evaluation(NamedTuple):
    """Everything that describes a system in one state."""

    M: np.ndarray  # (n, n) mass matrix
    Q: np.ndarray  # (n,) generalized force
    phi: np.ndarray  # (m,) Φ
    A: np.ndarray  # (m, n) ∂Φ/∂q
    b_q: np.ndarray  # (m,) −∂Φ/∂t
    b_v: np.ndarray  # (m,) −Ȧv + ḃ_q

    def phi_dot(self, v: np.ndarray) -> np.ndarray:
        """Φ̇ = A v − b_q, (m,)."""
        return self.A @ v - self.b_q


@dataclass(frozen=True, eq=False)
class ConstrainedSystem:
    """M(t, q) v̇ = Q(t, q, v) under Φ(t, q) = 0: equations (2.1)–(2.7).

    Every function has the arguments `(t, q, v, p, out)`: time [s], coordinates (n,), velocities (n,), the
    parameters of the system, and an array **full of zeros** in which it writes what is not zero. They are
    compiled with numba when first needed, so each must be a plain function of numbers and numpy arrays.

    The constraints may be redundant, time-dependent (`b_q`) and singular in places. A row that exists on
    the velocity level alone (nonholonomic, A v = b_q) leaves its Φ at zero.

    Attributes:
        n: Number of coordinates.
        m: Number of constraints.
        mass: Fills M (n, n), symmetric and positive definite; called as (t, q, v, p, M).
        force: Fills the generalized force Q (n,), velocity-dependent inertia terms included.
        phi: Fills Φ (m,).
        A: Fills A = ∂Φ/∂q (m, n).
        b_q: Fills b_q = −∂Φ/∂t (m,); not given: zero, the constraints do not depend on time.
        b_v: Fills b_v (m,), such that A v̇ = b_v is dΦ̇/dt = 0; not given: derived by differences of A v − b_q
            (`differences`), good to about 1e-11, at some 18 evaluations of A each; `motion.notes` says so.
        potential: Returns the potential energy [J], called as (t, q, v, p); for energies and `energy_scaled`.
        power: Fills the power [W] of every force named in `powers` (k,); its integral is the work in the results.
        event: Fills a number for every event named in `events` (e,); the motion ends where one passes zero.
        params: Parameters, handed to every function as the array p.
        powers: Names of the forces whose work is wanted.
        events: Names of the events.
        name: Name in messages.
        compiled: False runs the functions as ordinary Python (slow: for functions numba cannot compile).
    """

    n: int
    m: int
    mass: Callable[..., Any] = field(repr=False)
    force: Callable[..., Any] = field(repr=False)
    phi: Callable[..., Any] = field(default=_nothing, repr=False)
    A: Callable[..., Any] = field(default=_nothing, repr=False)
    b_q: Callable[..., Any] = field(default=_nothing, repr=False)
    b_v: Callable[..., Any] = field(default=_nothing, repr=False)
    potential: Callable[..., Any] = field(default=_no_potential, repr=False)
    power: Callable[..., Any] = field(default=_nothing, repr=False)
    event: Callable[..., Any] = field(default=_nothing, repr=False)
    params: Sequence[float] | np.ndarray = ()
    powers: tuple[str, ...] = ()
    events: tuple[str, ...] = ()
    name: str = "system"
    compiled: bool = True

    def __post_init__(self) -> None:
        """Refuse sizes that make no sense and constraints without their functions."""
        for name in ("n", "m"):
            if not isinstance(getattr(self, name), (int, np.integer)):
                raise InputError(f"{self.name}: {name} must be a whole number, not {getattr(self, name)!r}")
        if self.n < 1 or self.m < 0:
            raise InputError(f"{self.name}: n must be at least 1 and m at least 0, not n={self.n}, m={self.m}")
        missing = [name for name in ("phi", "A", "b_v") if getattr(self, name) is _nothing]
        if self.m > 0 and "A" in missing:
            raise InputError(f"{self.name}: {self.m} constraints need the functions phi, A and b_v")
        for name, names in (("power", "powers"), ("event", "events")):
            if (getattr(self, name) is _nothing) != (len(getattr(self, names)) == 0):
                raise InputError(f"{self.name}: the function {name} and the names in {names} need each other")

    @cached_property
    def p(self) -> np.ndarray:
        """The parameters as the functions get them, (k,)."""
        try:
            p = np.ascontiguousarray(self.params, dtype=float).ravel()
        except (TypeError, ValueError) as error:
            raise InputError(f"{self.name}: params must be numbers, not {self.params}") from error
        if not np.isfinite(p).all():
            raise InputError(f"{self.name}: params must be finite, not {p}")
        return p

    @property
    def has_potential(self) -> bool:
        """Whether a potential was given."""
        return self.potential is not _no_potential

    @property
    def derives_b_v(self) -> bool:
        """Whether b_v is derived by differences, because none was given."""
        return self.m > 0 and self.b_v is _nothing

    @cached_property
    def functions(self) -> tuple[Callable[..., Any], ...]:
        """The functions in the order of `SIGNATURES`, compiled unless `compiled` is False."""
        chosen = {name: getattr(self, name) for name in SIGNATURES}
        if self.derives_b_v:
            from biped.dynamics.differences import b_v_from

            plain = [getattr(chosen[name], "py_func", chosen[name]) for name in ("A", "b_q")]
            chosen["b_v"] = b_v_from(*plain, self.compiled)
        if not self.compiled:
            return tuple(chosen.values())
        return tuple(_compile(self.name, name, chosen[name]) for name in SIGNATURES)

    def state(self, name: str, value: ArrayLike) -> np.ndarray:
        """(n,) coordinates or velocities as floats, called `name` in messages.

        Raises:
            InputError: They are not n finite numbers.
        """
        try:
            array = np.array(value)
            array = np.array(array, dtype=complex if np.iscomplexobj(array) else float)
        except (TypeError, ValueError) as error:
            raise InputError(f"{self.name}: {name} must be {self.n} numbers: {error}") from error
        if array.shape != (self.n,):
            raise InputError(f"{self.name}: {name} must have shape ({self.n},), not {array.shape}")
        if np.iscomplexobj(array) or not np.isfinite(array).all():
            raise InputError(f"{self.name}: {name} must be finite at the start, not {array}")
        return array

    def try_out(self, t: float, q: np.ndarray, v: np.ndarray) -> None:
        """Call every function once as plain Python, which looks where it reads and writes; compiled code does not.

        Raises:
            InputError: A function takes other arguments, or goes beyond its arrays.
        """
        n, m, shapes = self.n, self.m, {"power": len(self.powers), "event": len(self.events), "force": self.n}
        functions = tuple(getattr(self, name) for name in SIGNATURES)
        known = (functions, n, m, self.p.size, *shapes.values())
        if known in _TRIED:
            return
        for name, function in zip(SIGNATURES, functions, strict=True):
            plain = getattr(function, "py_func", function)
            shape = {"mass": (n, n), "A": (m, n)}.get(name, shapes.get(name, m))
            arguments = [t, q.copy(), v.copy(), self.p] + ([np.zeros(shape)] if name != "potential" else [])
            wanted = "(t, q, v, p)" if name == "potential" else "(t, q, v, p, out)"
            try:
                inspect.signature(plain).bind(*arguments)
            except TypeError as error:
                raise InputError(f"{self.name}: the function {name} must take {wanted}: {error}") from error
            try:
                plain(*arguments)
            except IndexError as error:
                raise InputError(
                    f"{self.name}: the function {name} goes beyond its arrays: q and v have {n} numbers, "
                    f"p {self.p.size}, out {shape}: {error}"
                ) from error
        _TRIED.add(known)

    def with_params(self, params: Sequence[float] | np.ndarray) -> "ConstrainedSystem":
        """The same system with other parameters; nothing is compiled again."""
        return replace(self, params=params)

    def evaluate(self, t: float, q: np.ndarray, v: np.ndarray) -> Evaluation:
        """Every function in one state."""
        mass, force, phi, A, b_q, b_v = self.functions[:6]
        n, m = self.n, self.m
        e = Evaluation(*(np.zeros(shape) for shape in ((n, n), n, m, (m, n), m, m)))
        for function, out in ((mass, e.M), (force, e.Q), (phi, e.phi), (A, e.A), (b_q, e.b_q), (b_v, e.b_v)):
            function(t, q, v, self.p, out)
        return e

    def potential_energy(self, t: float, q: np.ndarray, v: np.ndarray) -> float:
        """Potential energy [J]; not a number if the system was given no potential."""
        return float(self.functions[6](t, q, v, self.p))

    def energy(self, t: float, q: np.ndarray, v: np.ndarray) -> float:
        """Kinetic and potential energy [J].

        Raises:
            InputError: The system was given no potential.
        """
        if not self.has_potential:
            raise InputError(f"{self.name}: energies need a potential")
        return float(0.5 * v @ self.evaluate(t, q, v).M @ v + self.potential_energy(t, q, v))


_TRIED: set[tuple[Any, ...]] = set()
_COMPILED: dict[tuple[Callable[..., Any], str], Callable[..., Any]] = {}


def _compile(system: str, name: str, function: Callable[..., Any]) -> Callable[..., Any]:
    plain = getattr(function, "py_func", function)
    kind = "matrix" if SIGNATURES[name] is MATRIX else name if SIGNATURES[name] is SCALAR else "vector"
    if (plain, kind) not in _COMPILED:
        try:
            _COMPILED[plain, kind] = _jit(plain, SIGNATURES[name])
        except NumbaError as error:
            raise InputError(
                f"{system}: the function {name} cannot be compiled; mend it or pass compiled=False.\n{error}"
            ) from error
    return _COMPILED[plain, kind]


def _jit(function: Callable[..., Any], signature: Any) -> Callable[..., Any]:
    if function.__closure__ is not None:  # numba would keep another copy of it beside the source in every process
        return njit(signature, error_model="numpy")(function)
    try:
        with cached():
            return njit(signature, cache=True, error_model="numpy")(function)
    except RuntimeError:  # no file to keep the compiled code beside: a prompt, a notebook, exec
        return njit(signature, error_model="numpy")(function)
