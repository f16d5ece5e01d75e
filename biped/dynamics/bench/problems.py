"""Problems of `biped bench mechanisms`: each with its start, what is compared, and the truth."""

import tempfile
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np

from biped.dynamics import RK8, ConstrainedSystem, Scheme, integrate
from biped.dynamics.bench.peers import DURATION, SAMPLE, TIMES, Run
from biped.dynamics.mechanisms import four_bars, overconstrained, pendulum, squeezer


@dataclass(frozen=True)
class Problem:
    """One problem.

    Attributes:
        name: Its name.
        make: Makes the system and its start q, v.
        observe: What is compared, from q (K, n) and v (K, n).
        exact: What it should be.
        steps: Steps our fixed schemes are measured at [s], longest first.
        duration: [s]
        sampling: [s]
    """

    name: str
    make: Callable[[], tuple[ConstrainedSystem, np.ndarray, np.ndarray]]
    observe: Callable[[np.ndarray, np.ndarray], np.ndarray]
    exact: Callable[[], np.ndarray]
    steps: tuple[float, ...] = (0.05, 0.02, 0.01, 5e-3, 2.5e-3, 1e-3)
    duration: float = DURATION
    sampling: float = SAMPLE

    def run(self, scheme: Scheme, setting: float) -> Run:
        """A run of ours; `setting` is the step [s], or the tolerance that an adaptive scheme has already."""
        system, q, v = self.make()
        dt = None if scheme.rtol else setting

        def run() -> np.ndarray:
            r = integrate(system, q, v, duration=self.duration, dt=dt, sampling=self.sampling, scheme=scheme)
            return self.observe(r.q, r.v)

        return run


def chain(linkages: int, name: str = "", sampling: float = SAMPLE) -> Problem:
    """Four-bars in a row, compared by the last joint's x [m]."""

    def exact() -> np.ndarray:
        start = ([np.pi / 2], [-1.0])
        trusted = four_bars.trusted(linkages)
        fine = integrate(trusted, *start, duration=DURATION, dt=1e-3, sampling=sampling, scheme=RK8)
        return linkages + np.cos(fine.q[:, 0])

    return Problem(
        name or f"chain of {linkages} four-bars",
        lambda: (four_bars.four_bars(linkages), *four_bars.start(np.pi / 2, -1.0, linkages)),
        lambda q, v: q[:, -2],
        exact,
        sampling=sampling,
    )


@cache
def _bricard() -> tuple[ConstrainedSystem, np.ndarray, np.ndarray]:
    from biped.dynamics.mjcf import load

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "bricard.xml")
        path.write_text(overconstrained.bricard_mjcf(), encoding="utf-8")
        mechanism = load(path)
    return mechanism.system, mechanism.q, mechanism.v


def _bricard_energy(q: np.ndarray, v: np.ndarray) -> np.ndarray:
    system = _bricard()[0]
    return np.array([system.energy(0.0, *state) for state in zip(q, v, strict=True)])


def _squeezer() -> tuple[ConstrainedSystem, np.ndarray, np.ndarray]:
    plane = squeezer.squeezer().plane
    return plane.system, plane.q, plane.v


def _squeezer_angle(q: np.ndarray, v: np.ndarray) -> np.ndarray:
    s = squeezer.squeezer()
    return s.plane.angle(q, s.crank)[-1:]


PENDULUM, FOUR_BARS, CHAIN, SQUEEZER, BRICARD = (
    "pendulum",
    "two four-bars",
    "chain of 40 four-bars",
    "squeezer",
    "Bricard's six-bar",
)

PROBLEMS = (
    Problem(
        PENDULUM, lambda: (pendulum.pendulum(), *pendulum.CONSISTENT), lambda q, v: q, lambda: pendulum.exact(TIMES)
    ),
    chain(2, FOUR_BARS),
    chain(10),
    replace(chain(40), steps=(0.1, 0.05, 0.1 / 3, 0.025, 0.02, 0.01)),
    Problem(
        SQUEEZER,
        _squeezer,
        _squeezer_angle,
        lambda: np.array([squeezer.PUBLISHED["crank"]]),
        (3e-4, 1e-4, 5e-5, 2.5e-5),
        squeezer.DURATION,
        squeezer.DURATION / 10,
    ),
    Problem(BRICARD, _bricard, _bricard_energy, lambda: np.full(11, 2.5 * 9.81), (0.05, 0.02, 0.01), DURATION, 1.0),
)
"""All of them; Bricard's six-bar is compared by its energy [J], the squeezer by its crank's angle [rad]."""
