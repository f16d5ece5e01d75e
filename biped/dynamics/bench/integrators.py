"""General integrators on our mechanisms, for a user without a mechanics package.

Every function prepares a simulation and returns a callable that runs it and gives what the benchmark compares.
"""

import time
from collections.abc import Callable
from typing import Any

import numpy as np

from biped.dynamics import pattern
from biped.dynamics.bench.peers import TIMES, Run
from biped.dynamics.mechanisms import four_bars, pendulum, squeezer

MOST_SECONDS = 60.0
"""CPU time [s] after which SciPy is stopped: steps collapse at a singular position."""

PROJECTIONS, PROJECTED_TO = 5, 1e-12
"""Newton iterations that put a state of SciPy's onto the constraints, and the correction that ends them [m]."""


def ida_stabilised(system: Any, start: tuple[np.ndarray, np.ndarray], rtol: float) -> Callable[[], Any]:
    """SUNDIALS IDA on Gear's stabilised index-2 form of a system: q̇ = v + Aᵀμ, Mv̇ = Q + Aᵀλ, Φ = Φ̇ = 0."""
    from sksundae.ida import IDA

    n, m = system.n, system.m
    M, Q, A = np.zeros((n, n)), np.zeros(n), np.zeros((m, n))
    phi, b_q = np.zeros(m), np.zeros(m)
    mass, force, fill_phi, fill_A, fill_b_q = system.functions[:5]
    p = system.p

    def residual(t, y, yp, res):
        q, v, multiplier, mu = y[:n].copy(), y[n : 2 * n].copy(), y[2 * n : 2 * n + m], y[2 * n + m :]
        for x in (M, Q, A, phi, b_q):
            x[:] = 0.0
        mass(t, q, v, p, M)
        force(t, q, v, p, Q)
        fill_phi(t, q, v, p, phi)
        fill_A(t, q, v, p, A)
        fill_b_q(t, q, v, p, b_q)
        res[:n] = yp[:n] - v - A.T @ mu
        res[n : 2 * n] = M @ yp[n : 2 * n] - Q - A.T @ multiplier
        res[2 * n : 2 * n + m] = A @ v - b_q
        res[2 * n + m :] = phi

    e = system.evaluate(0.0, *start)
    K = np.block([[e.M, -e.A.T], [e.A, np.zeros((m, m))]])
    solved = np.linalg.solve(K, np.concatenate((e.Q, e.b_v)))
    y = np.concatenate((*start, solved[n:], np.zeros(m)))
    yp = np.concatenate((start[1], solved[:n], np.zeros(2 * m)))
    index = np.arange(2 * n, 2 * n + 2 * m)
    tolerance = np.full(y.size, rtol)
    tolerance[index] = 1e6  # no error test on the multipliers, as its authors advise for this index
    solver = IDA(residual, rtol=rtol, atol=tolerance, algebraic_idx=index, max_num_steps=20_000)

    def run() -> np.ndarray:
        solution = solver.solve(TIMES, y, yp)
        if not solution.success:
            raise RuntimeError(f"stopped at t = {solution.t[-1]:.3g} s: {solution.message}")
        return solution.y

    return run


def ida_four_bars(rtol: float) -> Run:
    """SUNDIALS IDA on the four-bars in natural coordinates."""
    run = ida_stabilised(four_bars.four_bars(), four_bars.CONSISTENT, rtol)
    return lambda: run()[:, 4]


def ida_pendulum(rtol: float) -> Run:
    """SUNDIALS IDA on the pendulum."""
    run = ida_stabilised(pendulum.pendulum(), pendulum.CONSISTENT, rtol)
    return lambda: run()[:, :2]


def scipy_index1(
    system: Any, start: tuple[np.ndarray, np.ndarray], rtol: float, times: np.ndarray
) -> Callable[[], Any]:
    """SciPy's DOP853 on the index-1 form, its states put onto the constraints before the forces are asked for.

    Without that a chain leaves the singular position on the wrong branch (Baumgarte's terms at 10/s, any tolerance).
    The whole of [M Aᵀ; A 0] is factored as a band (LAPACK's gbsv), in the order of Cuthill and McKee.
    """
    from scipy.integrate import solve_ivp
    from scipy.linalg.lapack import dgbsv  # pyright: ignore[reportAttributeAccessIssue]
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import reverse_cuthill_mckee

    n, m = system.n, system.m
    p, found = system.p, pattern.find(system, times[0], *start)
    M, Q, A, phi, b_q, b_v = (np.zeros(shape) for shape in ((n, n), n, (m, n), m, m, m))
    filled = np.zeros((n + m, n + m), bool)
    filled[:n, :n], filled[:n, n:], filled[n:, :n] = found[0], found[1].T, found[1]
    place = np.argsort(reverse_cuthill_mckee(csr_array(filled), symmetric_mode=True))
    in_M, in_A = np.nonzero(found[0]), np.nonzero(found[1])
    row = np.concatenate((place[in_M[0]], place[n + in_A[0]], place[in_A[1]]))
    column = np.concatenate((place[in_M[1]], place[in_A[1]], place[n + in_A[0]]))
    width = int(np.abs(row - column).max())
    band, at = np.zeros((3 * width + 1, n + m)), (2 * width + row - column, column)
    stop = [np.inf]

    def solve(right: np.ndarray) -> np.ndarray:
        """[M Aᵀ; A 0]⁻¹ right (n + m, k), its first n rows."""
        rows = A[in_A]
        band[:] = 0.0
        band[at] = np.concatenate((M[in_M], rows, rows))
        _, _, x, info = dgbsv(width, width, band, right[np.argsort(place)])
        if info > 0:
            raise RuntimeError("stopped: the constraints are singular to the last digit")
        return x[place[:n]]

    def fill(t: float, q: np.ndarray, v: np.ndarray) -> None:
        for function, out in zip(system.functions[:6], (M, Q, phi, A, b_q, b_v), strict=True):
            out[:] = 0.0
            function(t, q, v, p, out)

    def rate(t: float, y: np.ndarray) -> np.ndarray:
        if time.process_time() > stop[0]:
            raise RuntimeError(f"stopped at t = {t:.3g} s of {times[-1]:.3g} s: more than {MOST_SECONDS:g} s")
        q, v = y[:n].copy(), y[n:].copy()
        for _ in range(PROJECTIONS):
            fill(t, q, v)
            right = np.zeros((n + m, 2))
            right[n:, 0], right[n:, 1] = phi, A @ v - b_q
            off = solve(right)
            q, v = q - off[:, 0], v - off[:, 1]
            if np.abs(off[:, 0]).max() < PROJECTED_TO:
                break
        fill(t, q, v)
        return np.concatenate((y[n:], solve(np.concatenate((Q, b_v))[:, None])[:, 0]))

    def run() -> np.ndarray:
        stop[0] = time.process_time() + MOST_SECONDS
        span, y = (times[0], times[-1]), np.concatenate(start)
        solution = solve_ivp(rate, span, y, method="DOP853", rtol=rtol, atol=rtol, t_eval=times)
        if not solution.success:
            raise RuntimeError(f"stopped at t = {solution.t[-1]:.3g} s of {times[-1]:.3g} s: {solution.message}")
        return solution.y.T

    return run


def scipy_chain(linkages: int, rtol: float) -> Run:
    """SciPy on a chain of four-bars in natural coordinates."""
    run = scipy_index1(four_bars.four_bars(linkages), four_bars.start(np.pi / 2, -1.0, linkages), rtol, TIMES)
    return lambda: run()[:, 2 * linkages]


def scipy_squeezer(rtol: float) -> Run:
    """SciPy on Andrews' squeezing mechanism."""
    s = squeezer.squeezer()
    times = np.linspace(0.0, squeezer.DURATION, 11)
    run = scipy_index1(s.plane.system, (s.plane.q, s.plane.v), rtol, times)
    return lambda: s.plane.angle(run()[:, : s.plane.system.n], s.crank)[-1:]
