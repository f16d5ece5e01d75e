"""Pendulums and a regulated walk whose probability of a fall is known, as makers of outcomes."""

from __future__ import annotations

import math

import numpy as np
from scipy.stats import norm

from biped.scenario.normals import Normals
from biped.scenario.vary import stream
from biped.studies.certify.precursors import RunOutcome
from biped.studies.certify.splitting import Moving
from biped.studies.certify.study import Accuracy, Found, Outcomes, estimated

OMEGA = math.sqrt(9.81 / 0.9)
"""[1/s] of a linear inverted pendulum of 0.9 m."""
PUSHES, APART = 12, 0.05
"""Pushes, and the time [s] between them."""
TIMES = tuple(APART * k for k in range(PUSHES))


def capture_deviation(impulse: float) -> float:
    """[m] standard deviation of the capture point of the pendulum after all pushes.

    x + v/ω grows as exp(ω t); each push of normal impulse per mass [m/s] adds J/ω to it.
    """
    ends = PUSHES * APART
    return impulse / OMEGA * math.sqrt(sum(math.exp(2.0 * OMEGA * (ends - time)) for time in TIMES))


def pendulum_falls(impulse: float, foot: float) -> float:
    """Probability that the pendulum's capture point ends further forward than the foot reaches: a fall."""
    return float(norm.sf(foot / capture_deviation(impulse)))


class Pendulum:
    """A linear inverted pendulum, pushed: it falls where its capture point ends beyond the foot.

    Args:
        impulse: [m/s] standard deviation of a push's impulse per mass.
        foot: [m] how far forward the foot reaches.
    """

    times = TIMES

    def __init__(self, impulse: float, foot: float):
        self._impulse, self._foot = impulse, foot

    def __call__(self, run: Normals) -> RunOutcome:
        """The outcome of a run."""
        z = _drawn(run, np.array(TIMES))
        place, rises = 0.0, []
        for k in range(PUSHES):
            place = (place + self._impulse * z[k] / OMEGA) * math.exp(OMEGA * APART)
            rises.append((TIMES[k] + 0.5 * APART, 0, place * math.exp(-OMEGA * TIMES[k])))
        return RunOutcome(place > self._foot, PUSHES * APART, tuple(rises))


class Regulated:
    """A walk that is brought back by every step, b' = a b + z, and falls when it leaves ±bound.

    Args:
        bound: Beyond which it falls.
        steps: Number of steps.
        a: What is left of a deviation after a step.
    """

    def __init__(self, bound: float, steps: int = 20, a: float = 0.8):
        self._bound, self._a = bound, a
        self.times = tuple(float(k) for k in range(steps))

    def __call__(self, run: Normals) -> RunOutcome:
        """The outcome of a run."""
        b, rises = 0.0, []
        for time, z in zip(self.times, _drawn(run, np.array(self.times)), strict=True):
            b = self._a * b + z
            if abs(b) > self._bound:
                return RunOutcome(True, time, tuple(rises))
            rises.append((time, 0 if b > 0.0 else 1, abs(b)))
        return RunOutcome(False, self.times[-1], tuple(rises))

    def falls(self, nodes: int = 400) -> float:
        """The probability of a fall, by Gauss-Legendre quadrature of the Chapman-Kolmogorov equation."""
        x, w = np.polynomial.legendre.leggauss(nodes)
        x, w = self._bound * x, self._bound * w
        onward = norm.pdf(x[None, :] - self._a * x[:, None]) * w[None, :]
        density = norm.pdf(x)
        for _ in self.times[1:]:
            density = (density * w) @ (onward / w[None, :])
        return 1.0 - float(density @ w)


class Jumping(Regulated):
    """The same walk with a score that jumps: no more than whether a deviation was above a third of the bound."""

    def __call__(self, run: Normals) -> RunOutcome:
        """The outcome of a run."""
        out = super().__call__(run)
        third = self._bound / 3.0
        return out._replace(rises=tuple((time, 0, float(value > third)) for time, _, value in out.rises))


def _drawn(run: Normals, times: np.ndarray) -> np.ndarray:
    return stream(run, "pushes").standard_normal(len(times), times)


def estimate(problem, seed: int, **accuracy) -> Found:
    """What `biped certify` finds of a problem."""
    outcomes = Outcomes(lambda runs: map(problem, runs), {}, lambda _, outcome: outcome, lambda: None)
    return estimated(seed, outcomes, Moving(problem.times), Accuracy(**accuracy))
