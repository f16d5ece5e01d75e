"""`biped bench mechanisms`: run time against error, ours and that of packages a user would pick instead.

Errors are the largest over the samples, against the exact pendulum, the four-bars' single angle, the squeezer's
published end, or the energy of Bricard's six-bar; times are process time, the median of repeats, all in one run.
"""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from importlib.util import find_spec

import numpy as np

from biped.base.errors import BipedError
from biped.dynamics import EULER, RK4, RK8, Scheme
from biped.dynamics.bench import integrators, peers
from biped.dynamics.bench.problems import BRICARD, CHAIN, FOUR_BARS, PENDULUM, PROBLEMS, SQUEEZER, Problem

OURS = (EULER, RK4, RK8)
"""The schemes a ratio to a peer is taken with: ours without help from energy."""


@dataclass(frozen=True)
class TimedRun:
    """One run: what it cost and how wrong it was.

    Attributes:
        problem: Name of the problem.
        method: Name of the scheme or the peer.
        ours: Whether it is one of `OURS`.
        setting: Step [s], or tolerance of an adaptive method.
        error: Largest error [m]; None if it failed.
        cpu: Process time [s]; None if it failed.
        note: Why it failed, or empty.
    """

    problem: str
    method: str
    ours: bool
    setting: float
    error: float | None
    cpu: float | None
    note: str = ""


@dataclass(frozen=True)
class Benchmark:
    """Everything one benchmark measured.

    Attributes:
        points: All runs.
        ratios: Peer → [least, largest] CPU time over ours at the same error or less, on two four-bars.
        large: The same on the chain of 40.
        skipped: Peer → why it did not run.
    """

    points: list[TimedRun]
    ratios: dict[str, list[float]]
    large: dict[str, list[float]]
    skipped: dict[str, str]


Peer = tuple[str, str, str, Callable[[float], peers.Run], tuple[float, ...]]

PEERS: tuple[Peer, ...] = (
    (PENDULUM, "SUNDIALS IDA", "sksundae", integrators.ida_pendulum, (1e-4, 1e-6, 1e-8, 1e-10)),
    (FOUR_BARS, "SUNDIALS IDA", "sksundae", integrators.ida_four_bars, (1e-4, 1e-6, 1e-8, 1e-10)),
    (FOUR_BARS, "exudyn", "exudyn", peers.exudyn_index3, (1e-2, 5e-3, 2e-3, 1e-3, 5e-4)),
    (FOUR_BARS, "MuJoCo connect", "mujoco", peers.mujoco_connect, (5e-3, 2e-3, 1e-3, 5e-4, 2e-4, 1e-4)),
    (
        FOUR_BARS,
        "Pinocchio proximal",
        "pinocchio",
        peers.pinocchio_proximal,
        (2e-2, 1e-2, 5e-3, 2.5e-3, 1e-3),
    ),
    (CHAIN, "Pinocchio proximal", "pinocchio", lambda dt: peers.pinocchio_proximal(dt, 40), (2e-2, 1e-2, 5e-3)),
    (CHAIN, "scipy index 1", "scipy", lambda rtol: integrators.scipy_chain(40, rtol), (1e-6, 1e-8, 1e-9, 1e-10)),
    (BRICARD, "MuJoCo connect", "mujoco", peers.mujoco_bricard, (5e-3, 2e-3, 1e-3)),
    (SQUEEZER, "scipy index 1", "scipy", integrators.scipy_squeezer, (1e-6, 1e-8, 1e-10)),
)


def _schemes(problem: Problem) -> list[tuple[Scheme, tuple[float, ...]]]:
    steps = problem.steps
    tolerances = (1e-4, 1e-6, 1e-8, 1e-10)
    adaptive = [(RK8.adaptive(tolerance), (tolerance,)) for tolerance in tolerances]
    named = [(replace(s, name="RK8, adaptive"), t) for s, t in adaptive]
    if problem.name not in (PENDULUM, FOUR_BARS):
        return [(RK4, steps), (RK8, steps), *named]
    return [
        (EULER, (1e-3, 1e-4, 2e-5)),
        (RK4, steps),
        (RK8, (0.1, *steps[:-1])),
        (RK4.projected(), steps),
        (RK4.energy_scaled(), steps),
        (RK4.baumgarte(10.0, 10.0), steps),
        (RK4.uncorrected(), steps),
        *named,
    ]


def exact(problem: str) -> np.ndarray:
    """The truth that runs of a problem are compared with."""
    return next(p for p in PROBLEMS if p.name == problem).exact()


def _measure(run: peers.Run, exact: np.ndarray, repeats: int) -> tuple[float, float]:
    """Error and median process time [s] of runs that repeat until they last long enough to be timed."""
    error = float(np.abs(run() - exact).max())
    times: list[float] = []
    while len(times) < repeats or (sum(times) < 0.02 * repeats and len(times) < 50):
        start = time.process_time()
        run()
        times.append(time.process_time() - start)
    return error, float(np.median(times))


def measure(
    quick: bool = False,
    progress: Callable[[str], None] = lambda line: None,
    problems: Sequence[Problem] = PROBLEMS,
) -> Benchmark:
    """Measure every scheme and every peer that is installed.

    Args:
        quick: One repeat, the three longest steps or loosest tolerances of each, no peers on large problems.
        progress: Called with the name of each method as it starts.
        problems: Problems to solve.
    """
    repeats = 1 if quick else 5
    points: list[TimedRun] = []
    skipped: dict[str, str] = {}
    for case in problems:
        problem, exact = case.name, case.exact()
        jobs = [
            (s.name, s.name in {x.name for x in OURS}, setting, case.run(s, setting))
            for s, settings in _schemes(case)
            for setting in (settings[:3] if quick else settings)
        ]
        for where, name, module, prepare, settings in PEERS:
            if where != problem or (quick and problem not in (PENDULUM, FOUR_BARS)):
                continue
            if find_spec(module) is None:
                skipped[name] = f"{module} is not installed (the extra 'bench' of pyproject.toml)"
                continue
            jobs += [(name, False, s, _prepared(prepare, s)) for s in (settings[:3] if quick else settings)]
        for name, ours, setting, run in jobs:
            progress(f"{problem}: {name}, {setting:g}")
            start = time.process_time()
            try:
                error, cpu = _measure(run, exact, repeats)
            except (BipedError, RuntimeError, ValueError) as failure:
                spent = time.process_time() - start
                note = f"{str(failure).split(' s: ')[-1].split(':')[0]}, after {1e3 * spent:.0f} ms"
                points.append(TimedRun(problem, name, ours, setting, None, None, note))
                continue
            finite = bool(np.isfinite(error))
            points.append(
                TimedRun(problem, name, ours, setting, error if finite else None, cpu, "" if finite else "diverged")
            )
    return Benchmark(points, ratios(points), ratios(points, CHAIN), skipped)


def _prepared(prepare: Callable[[float], peers.Run], setting: float) -> peers.Run:
    """Prepare once, outside the clock: the first run of a measurement is not timed."""
    ready: list[peers.Run] = []

    def run() -> np.ndarray:
        if not ready:
            ready.append(prepare(setting))
        return ready[0]()

    return run


def ratios(points: Sequence[TimedRun], problem: str = FOUR_BARS) -> dict[str, list[float]]:
    """How many times our CPU time each peer takes, least and largest over its runs, at equal error or less."""
    ours = [
        (p.error, p.cpu)
        for p in points
        if p.ours and p.problem == problem and p.error is not None and p.cpu is not None
    ]
    found: dict[str, list[float]] = {}
    for name in dict.fromkeys(peer[1] for peer in PEERS):
        all_ratios = [
            p.cpu / min(cpu for error, cpu in ours if error <= p.error)
            for p in points
            if p.method == name
            and p.problem == problem
            and p.error is not None
            and p.cpu is not None
            and p.error < 0.1  # beyond a tenth of the length the solution is lost, and so is its price
            and any(error <= p.error for error, _ in ours)
        ]
        if all_ratios:
            found[name] = [float(min(all_ratios)), float(max(all_ratios))]
    return found
