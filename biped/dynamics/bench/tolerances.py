"""`biped bench tolerances`: the error that adaptive steps reach against their tolerance.

Every problem that the tests solve with adaptive steps, from a tolerance of 1e-3 to one of 1e-11: eight decades.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from biped.base.errors import BipedError
from biped.dynamics import RK8, ConstrainedSystem, integrate
from biped.dynamics.bench.problems import BRICARD, PROBLEMS, SQUEEZER, Problem, chain
from biped.dynamics.mechanisms import double_pendulum, overconstrained, pendulum, slider_crank

TOLERANCES = tuple(10.0**-k for k in range(3, 12))


@dataclass(frozen=True)
class AdaptiveRun:
    """One run with adaptive steps.

    Attributes:
        problem: Name of the problem.
        tolerance: Relative and absolute tolerance of a step.
        error: Largest error over the samples; None if it ended with an error.
        evaluations: Times that the system's functions were evaluated; None if it ended with an error.
        note: Why it ended, or empty.
    """

    problem: str
    tolerance: float
    error: float | None
    evaluations: int | None
    note: str = ""


def _fine(
    trusted: ConstrainedSystem, q: list[float], v: list[float], duration: float, sampling: float, dt: float = 5e-4
) -> np.ndarray:
    """States of a system without constraints, by steps that leave only rounding."""
    return integrate(trusted, q, v, duration=duration, dt=dt, sampling=sampling, scheme=RK8).q


def _double(first: float, second: float) -> Problem:
    return Problem(
        f"double pendulum, {first:g} and {second:g} kg",
        lambda: (double_pendulum.double_pendulum(first, second), *double_pendulum.START),
        lambda q, v: q,
        # A light knee swings at √(T/m), some 3000 rad/s: its steps are short even in the angles.
        lambda: double_pendulum.position(
            _fine(double_pendulum.trusted(first, second), [0.0, 0.0], [0.0, 0.0], 1.0, 0.25, 1e-5)
        ),
        duration=1.0,
        sampling=0.25,
    )


def _parallelogram() -> Problem:
    """A bar too many: two cranks and two couplers of 1 kg fall as a pendulum of length Θ/(Σ m r)."""
    plane = overconstrained.parallelograms()
    length = (2 / 3 + 1 + 1 / 4) / 2.5
    return Problem(
        "parallelogram with a bar too many",
        lambda: (plane.system, plane.q, plane.v),
        lambda q, v: plane.angle(q, plane.bodies[0]),
        lambda: _fine(pendulum.trusted(length=length), [np.pi / 2], [-1.0], 2.0, 0.25)[:, 0],
        duration=2.0,
        sampling=0.25,
    )


def _bennett() -> Problem:
    space = overconstrained.bennett()
    system = space.system

    def energy(q: np.ndarray, v: np.ndarray) -> np.ndarray:
        return np.array([system.energy(0.0, *state) for state in zip(q, v, strict=True)])

    return Problem(
        "Bennett's linkage (energy)",
        lambda: (system, space.q, space.v),
        energy,
        lambda: np.full(2, system.energy(0.0, space.q, space.v)),
        duration=2.0,
        sampling=2.0,
    )


def cases() -> tuple[Problem, ...]:
    """The problems, with samples so far apart that the tolerance decides about the steps."""
    named = {p.name: p for p in PROBLEMS}
    bricard = named[BRICARD]
    return (
        Problem(
            "pendulum",
            lambda: (pendulum.pendulum(), *pendulum.CONSISTENT),
            lambda q, v: q,
            lambda: pendulum.exact(np.linspace(0.0, 10.0, 11)),
            sampling=1.0,
        ),
        Problem(
            "slider-crank",
            lambda: (slider_crank.slider_crank(), *slider_crank.CONSISTENT),
            lambda q, v: slider_crank.slider_position(q),
            lambda: slider_crank.slider_position(_fine(slider_crank.trusted(), [0.0], [0.0], 5.0, 1.0)),
            duration=5.0,
            sampling=1.0,
        ),
        _double(1.0, 1.0),
        _double(1e-6, 1.0),
        _double(1.0, 1e-6),
        *(chain(n, sampling=0.5) for n in (2, 5, 10, 40)),
        replace(named[SQUEEZER], name="Andrews' squeezer"),
        _parallelogram(),
        _bennett(),
        replace(
            bricard,
            name=f"{BRICARD} (energy)",
            exact=lambda: np.full(5, 2.5 * 9.81),
            duration=2.0,
            sampling=0.5,
        ),
    )


def measure(
    problems: tuple[Problem, ...] | None = None,
    tolerances: tuple[float, ...] = TOLERANCES,
    progress: Callable[[str], None] = lambda line: None,
) -> list[AdaptiveRun]:
    """Run every problem at every tolerance; `progress` is told the name of each as it starts."""
    reached = []
    for case in problems or cases():
        progress(case.name)
        exact = case.exact()
        system, q, v = case.make()
        for tolerance in tolerances:
            scheme = RK8.adaptive(tolerance)
            try:
                r = integrate(system, q, v, duration=case.duration, sampling=case.sampling, scheme=scheme)
            except BipedError as failure:
                reached.append(AdaptiveRun(case.name, tolerance, None, None, str(failure)))
                continue
            error = float(np.abs(case.observe(r.q, r.v) - exact).max())
            reached.append(AdaptiveRun(case.name, tolerance, error, r.evaluations))
    return reached


def slope(reached: list[AdaptiveRun]) -> float:
    """Decades of error per decade of tolerance, of one problem's runs that ended with an answer."""
    ended = [r for r in reached if r.error]
    asked, found = np.log10([r.tolerance for r in ended]), np.log10([float(r.error or 0.0) for r in ended])
    return float(np.polyfit(asked, found, 1)[0])
