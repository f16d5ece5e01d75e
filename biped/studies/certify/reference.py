"""Problems whose probability of a fall is known: what `biped certify` is validated on.

A linear inverted pendulum under random pushes has a closed form, a walk that every step regulates and a narrow passage
have one by quadrature.
Each is estimated again and again, and what is counted is how often the interval holds the known probability.
"""

import math
from collections.abc import Callable
from functools import lru_cache, partial
from typing import Any, NamedTuple

import numpy as np

from biped.base.statistics import trials_as_narrow, wilson
from biped.ensemble.backend import Jobs, Progress, silent
from biped.ensemble.executor import workers
from biped.scenario.randomise import Move, Normals
from biped.scenario.vary import stream
from biped.studies.certify.estimation import Accuracy, Found, estimated
from biped.studies.certify.outcome import RunOutcome
from biped.studies.certify.running import Outcomes
from biped.studies.certify.shifting import Process
from biped.studies.certify.splitting import Moving

OMEGA = math.sqrt(9.81 / 0.9)
"""[1/s] of a linear inverted pendulum of 0.9 m."""
PUSHES, APART = 24, 0.025
"""Pushes, and the time [s] between them."""
MOST = 10_000
"""Runs that an estimate may take."""


class Pendulum:
    """A linear inverted pendulum, pushed: it falls where its capture point ends beyond the foot.

    x + v/ω grows as exp(ω t); each push of normal impulse per mass [m/s] adds J/ω to it, so that it is normal. Its
    score is how far short of the foot it will end if no push follows, in standard deviations of what those that follow
    may add.

    Args:
        foot: How far forward the foot reaches, in standard deviations of the capture point after all pushes.
        impulse: [m/s] standard deviation of a push's impulse per mass.
    """

    times = tuple(APART * k for k in range(PUSHES))

    def __init__(self, foot: float, impulse: float = 0.02):
        ends = PUSHES * APART
        spread = math.sqrt(sum(math.exp(2.0 * OMEGA * (ends - time)) for time in self.times))
        self._impulse, self._foot, self._deviations = impulse, foot * impulse / OMEGA * spread, foot
        adds = np.array([impulse / OMEGA * math.exp(OMEGA * (ends - time)) for time in self.times])
        self._left = np.sqrt(np.maximum((adds**2)[::-1].cumsum()[::-1] - adds**2, 0.0))

    def __call__(self, run: Normals) -> RunOutcome:
        """The outcome of a run."""
        z = _drawn(run, self.times)
        place, rises = 0.0, []
        for k in range(PUSHES):
            place = (place + self._impulse * z[k] / OMEGA) * math.exp(OMEGA * APART)
            if k < PUSHES - 1:
                ends = place * math.exp(OMEGA * (PUSHES - 1 - k) * APART)
                rises.append((self.times[k] + 0.5 * APART, 0, (ends - self._foot) / self._left[k]))
        return RunOutcome(place > self._foot, PUSHES * APART, tuple(rises))

    def falls(self) -> float:
        """The probability of a fall."""
        from scipy.special import ndtr

        return float(ndtr(-self._deviations))


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
        for time, z in zip(self.times, _drawn(run, self.times), strict=True):
            b = self._a * b + z
            if abs(b) > self._bound:
                return RunOutcome(True, time, tuple(rises))
            rises.append((time, 0 if b > 0.0 else 1, abs(b)))
        return RunOutcome(False, self.times[-1], tuple(rises))

    def falls(self, nodes: int = 400) -> float:
        """The probability of a fall, by Gauss-Legendre quadrature of the Chapman-Kolmogorov equation."""
        x, w = np.polynomial.legendre.leggauss(nodes)
        x, w = self._bound * x, self._bound * w

        def normal(z: np.ndarray) -> np.ndarray:
            return np.exp(-0.5 * z * z) / math.sqrt(2.0 * math.pi)

        onward = normal(x[None, :] - self._a * x[:, None]) * w[None, :]
        density = normal(x)
        for _ in self.times[1:]:
            density = (density * w) @ (onward / w[None, :])
        return 1.0 - float(density @ w)


class NarrowPlace:
    """Falls in a narrow place, as a walker falls that is pushed too much to pass over its foot and too little to step.

    With z the normals of 4 s in 0.1 s each, it falls where a sine over 1.2 s of them is between `low` and `low` + 0.4,
    both moved by half of a third pattern; and, which is all that it does under a strong force, where the sum of another
    1.2 s is beyond `far`. The three patterns are orthogonal.

    Args:
        low: Where the place begins [standard deviations].
        far: Of the other way to fall.
    """

    times = tuple(0.1 * k for k in range(40))

    def __init__(self, low: float, far: float = 4.8):
        hesitates, over, moves = np.zeros((3, len(self.times)))
        hesitates[11:23] = -np.sin(np.pi * (np.arange(12) + 0.5) / 12.0)
        over[18:30] = 1.0
        moves[5:25] = np.cos(np.arange(20))
        self._patterns = np.linalg.qr(np.stack([hesitates, over, moves], axis=1))[0].T
        self._patterns *= np.sign(self._patterns @ np.stack([hesitates, over, moves], axis=1)).diagonal()[:, None]
        self._low, self._high, self._far = low, low + 0.4, far

    def __call__(self, run: Normals) -> RunOutcome:
        """The outcome of a run."""
        along, over, moved = self._patterns @ _drawn(run, self.times)
        narrow = self._low < along - 0.5 * moved < self._high
        return RunOutcome(bool(narrow or over > self._far), self.times[-1], ())

    def falls(self, nodes: int = 80) -> float:
        """The probability of a fall, by Gauss-Hermite quadrature over the pattern that moves the place."""
        from scipy.special import ndtr

        x, w = np.polynomial.hermite_e.hermegauss(nodes)
        narrow = float((w / w.sum()) @ (ndtr(self._high + 0.5 * x) - ndtr(self._low + 0.5 * x)))
        return 1.0 - (1.0 - narrow) * float(ndtr(self._far))


PROBLEMS: dict[str, Callable[[], Any]] = {
    "pushed pendulum, 1e-2": partial(Pendulum, 2.3263),
    "pushed pendulum, 1e-3": partial(Pendulum, 3.0902),
    "pushed pendulum, 1e-4": partial(Pendulum, 3.7190),
    "pushed pendulum, 1e-5": partial(Pendulum, 4.2649),
    "regulated walk, 1e-3": partial(Regulated, 6.55),
    "regulated walk, 1e-5": partial(Regulated, 8.25),
    "narrow passage, 3e-4": partial(NarrowPlace, 3.7),
    "narrow passage, 2e-5": partial(NarrowPlace, 4.5),
}
"""Problems whose probability is known, by name."""


class Validation(NamedTuple):
    """How often intervals hold a known probability.

    Attributes:
        name: Of `PROBLEMS`.
        known: The probability.
        repeats: Estimates, each with seeds of its own.
        held: How many intervals hold it.
        below: How many lie below it.
        interval: 95 % interval of the share that holds it.
        mean: Of all estimates.
        runs: Median number of runs of an estimate.
        factor: Median factor from an estimate to the end of its interval.
        saving: Median ratio of the plain runs that an interval as narrow takes to the runs that were made.
    """

    name: str
    known: float
    repeats: int
    held: int
    below: int
    interval: tuple[float, float]
    mean: float
    runs: float
    factor: float
    saving: float


def estimate(problem: Any, seed: int, accuracy: Accuracy) -> tuple[Found, int]:
    """The estimate of a problem as the command makes it, and its runs.

    Args:
        problem: Makes the outcome of a run; `times` are those of its normals.
        seed: Of everything random in it.
        accuracy: When to stop; the score is the problem's own.
    """

    def carried_out(requests: Any) -> Any:
        return (problem(request.run) for request in requests)

    outcomes = Outcomes(carried_out, {}, lambda _, outcome: outcome, lambda: None, "known")
    process = Process(problem.times, 1, (0,), partial(normals_of, times=problem.times)) if problem.times else None
    return estimated(seed, outcomes, Moving(problem.times), accuracy, process), outcomes.runs


def validate(repeats: int, jobs: Jobs, method: str | None = None, progress: Progress = silent) -> list[Validation]:
    """Estimates every problem many times.

    Args:
        repeats: Estimates of each.
        jobs: Number of processes, or a cluster.
        method: Of `biped.studies.certify.estimation.METHODS`; default: counting or splitting.
        progress: Told of every finished estimate.
    """
    found = []
    for name, make in PROBLEMS.items():
        with workers(partial(_repeat, name, method), jobs) as carried_out, progress(name, repeats, 0) as advance:
            rows = []
            for row in carried_out(range(repeats)):
                rows.append(row)
                advance()
        found.append(_summary(name, make().falls(), np.array(rows)))
    return found


def _repeat(name: str, method: str | None, seed: int) -> tuple[float, float, float, int]:
    found, runs = estimate(PROBLEMS[name](), seed, Accuracy(most=MOST, method=method))
    value, low, high = found.probability
    return value, low, high, runs


def _summary(name: str, known: float, rows: np.ndarray) -> Validation:
    value, low, high, runs = rows.T
    held = int(((low <= known) & (known <= high)).sum())
    factor = high / np.maximum(value, 1e-300)
    plain = np.array([trials_as_narrow(known, *ends) for ends in zip(low, high, strict=True)])
    return Validation(
        name, known, len(rows), held, int((high < known).sum()), wilson(held, len(rows)), float(value.mean()),
        float(np.median(runs)), float(np.median(factor)), float(np.median(plain / runs)),
    )  # fmt: skip


def normals_of(run: Normals, times: tuple[float, ...]) -> np.ndarray:
    """The normals of a run, as its stream draws them; those of the run that it was moved from are not drawn again."""
    return _normals(int(run), run.moves, times)


def _drawn(run: Normals, times: tuple[float, ...]) -> np.ndarray:
    z = normals_of(run, times)
    run.squares += float(np.sum(np.square(z)))
    return z


@lru_cache(maxsize=20_000)
def _normals(seed: int, moves: tuple[Move, ...], times: tuple[float, ...]) -> np.ndarray:
    fresh = stream(moves[-1].seed if moves else seed, "pushes").standard_normal(len(times))
    return moves[-1](_normals(seed, moves[:-1], times), fresh, np.array(times)) if moves else fresh
