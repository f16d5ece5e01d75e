"""The probability of a fall from outcomes of runs, with its interval: by counting, by splitting or by shifting."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from biped.base.statistics import wilson
from biped.scenario.vary import stream
from biped.studies.certify import splitting
from biped.studies.certify.outcome import LEARNED, LEFT, RunOutcome
from biped.studies.certify.running import Outcomes
from biped.studies.certify.shifting import Learner, Mixture, Process, Stages, Weighted

LEAST_SAMPLES = 5
"""Independent estimates from which an interval is made."""


class Probability(NamedTuple):
    """A probability.

    Attributes:
        value: The estimate.
        low: Lower bound of its 95 % interval.
        high: Upper bound.
    """

    value: float
    low: float
    high: float

    @property
    def relative(self) -> float:
        """Half the interval over the estimate; infinite where nothing fell."""
        return 0.5 * (self.high - self.low) / self.value if self.value > 0.0 else math.inf


def counted(falls: int, runs: int) -> Probability:
    """The probability that falls among plain runs show, with Wilson's interval."""
    return Probability(falls / runs if runs else 0.0, *wilson(falls, runs))


def combined(estimates: Sequence[float], least: float = 0.0) -> Probability:
    """The mean of independent unbiased estimates, with Student's interval of its logarithm.

    Estimates by splitting scatter by factors and not by differences, and none is below zero. The standard error of
    the logarithm of their mean is that of the mean over the mean (the delta method), or that of lognormal numbers (D.
    Cox's; G. Zhou, S. Gao, Stat. Med. 16:783, 1997), whichever is larger: the largest of many such estimates, which
    decides their mean, is often not among the few that there are. Few estimates that agree by chance scatter too
    little, and those that do are mostly low: the scatter is not taken for less than is known of it.

    Args:
        estimates: One of each sample.
        least: Relative standard deviation that an estimate has at least.
    """
    n = len(estimates)
    mean = math.fsum(estimates) / n
    if mean == 0.0 or n < 2:
        return Probability(mean, 0.0, 1.0)
    from scipy.special import stdtrit

    scatter = max(math.sqrt(math.fsum((one - mean) ** 2 for one in estimates) / (n - 1)) / mean, least)
    lowest = min(one for one in estimates if one > 0.0)
    logs = [math.log(one if one > 0.0 else 0.5 * lowest) for one in estimates]
    middle = math.fsum(logs) / n
    variance = max(math.fsum((one - middle) ** 2 for one in logs) / (n - 1), math.log1p(least * least))
    error = max(scatter / math.sqrt(n), math.sqrt(variance / n + variance * variance / (2.0 * (n - 1))))
    factor = math.exp(min(float(stdtrit(n - 1, 0.975)) * error, 700.0))
    return Probability(mean, mean / factor, min(1.0, mean * factor))


def plain_is_cheaper(falls: int, runs: int, share: float) -> bool:
    """Whether counting plain runs is cheaper than splitting, judged by a first few.

    For the same scatter, counting takes (1 − p)/p runs where splitting through m = ln p / ln q levels of a share q
    takes about 2 m² (1 − q)/q: m levels of m scatters, and twice for runs that resemble the ones they were moved from.
    """
    p = (falls + 0.5) / (runs + 1.0)
    levels = math.log(p) / math.log(share)
    return (1.0 - p) / p <= 2.0 * levels**2 * (1.0 - share) / share


COUNTING, SPLITTING, SHIFTING = "counting", "splitting", "shifting"
METHODS = (COUNTING, SPLITTING, SHIFTING)
FIRST = 200
"""Plain runs that decide between counting and the other methods."""
EACH = 500
"""Shifted runs before the first two looks at their interval, between which there are half as many again later."""
LEARNING, LEARNING_RUNS = 0.3, 3000
"""Share of the runs, and runs, that finding patterns takes at most."""
CERTAIN = 30.0
"""Effective falls from which an interval of shifted runs may be narrow enough."""
WAVE = 5
"""Samples that are drawn side by side at most."""
PILOTS = 3
"""In all but the last of which the score is learned once more."""
LEAST_SIZE = 20
"""Runs at each level of a sample at least."""
LEAST_FALLS = 10
"""Falls from which a count ends."""
OTHERWISE = "margin"
"""The score where none can be learned: nothing that is drawn has a time, or nothing falls."""


class Accuracy(NamedTuple):
    """When to stop.

    Attributes:
        relative: Half the 95 % interval over the probability.
        most: Runs at most.
        size: Runs at each level of a sample.
        score: Of `SCORES`, or `LEARNED`.
        method: Of `METHODS`; None: counting where that is cheap, else shifting, or splitting without a force.
    """

    relative: float = 0.3
    most: int = 100_000
    size: int = 100
    score: str = LEARNED
    method: str | None = None


class Found(NamedTuple):
    """An estimate, and what it was made from.

    Attributes:
        probability: The estimate.
        reached: Whether its interval is as narrow as asked for.
        plain: Outcomes of runs that nothing selected.
        samples: Through all levels; none of a count.
        levels: Of the samples.
        fell: Runs that fell.
        doubt: What speaks against it.
        method: Of `METHODS`.
        mixture: What shifted runs were drawn from.
        effective: How many falls of one weight would say as much as those of the shifted runs.
    """

    probability: Probability
    reached: bool
    plain: Sequence[RunOutcome]
    samples: Sequence[splitting.Sample]
    levels: splitting.Levels | None
    fell: Sequence[splitting.Member]
    doubt: str
    method: str
    mixture: Mixture | None = None
    effective: float = 0.0


def estimated(
    seed: int, outcomes: Outcomes, moving: splitting.Moving, accuracy: Accuracy, process: Process | None = None
) -> Found:
    """Estimates the probability of a fall.

    Args:
        seed: Of everything random in it.
        outcomes: Of runs.
        moving: How runs are moved.
        accuracy: When to stop.
        process: What may be shifted; default: nothing.
    """
    rng = stream(seed, "certify.plain")
    first = outcomes.plain(rng, min(FIRST, accuracy.most))
    falls = sum(outcome.fell for _, outcome in first)
    method = accuracy.method
    if method is None:
        cheap = plain_is_cheaper(falls, len(first), splitting.SHARE)
        method = COUNTING if cheap else SPLITTING if process is None else SHIFTING
    if method == COUNTING:
        return _counting(rng, outcomes, first, accuracy, "")
    if method == SHIFTING:
        learns = outcomes.learns
        found = _shifting(seed, outcomes, first, process, accuracy)
        if found is not None:
            return found
        if accuracy.method is not None:
            why = "nothing that is drawn has a time" if process is None else "no shifted run fell, or --most is too few"
            return _counting(stream(seed, "certify.count"), outcomes, first, accuracy, f"{why}: runs were counted")
        outcomes.learns = learns
    levels = levels_of(seed, outcomes, first, moving, accuracy)
    size = 0 if levels is None else _size(levels, moving, accuracy, accuracy.most - outcomes.runs)
    if levels is None or size < LEAST_SIZE:
        score = outcomes.score if isinstance(outcomes.score, str) else LEARNED
        doubt = f"the score '{score}' stopped rising before runs fell, or --most is too few: runs were counted"
        return _counting(rng, outcomes, first, accuracy, doubt)
    return _splitting(seed, outcomes, levels, moving, accuracy._replace(size=size))


def _size(levels: splitting.Levels, moving: splitting.Moving, accuracy: Accuracy, left: int) -> int:
    """Runs at each level of a sample, fewer than asked for where an interval would take more runs than are left."""
    size = accuracy.size
    while size >= LEAST_SIZE and LEAST_SAMPLES * splitting.cost_of(levels, size, moving) > left:
        size -= 1
    return size


def levels_of(
    seed: int, outcomes: Outcomes, first: Sequence[splitting.Member], moving: splitting.Moving, accuracy: Accuracy
) -> splitting.Levels | None:
    """The levels that a pilot finds, of a score that is learned before where there is none.

    Args:
        seed: Of everything random in it.
        outcomes: Of runs; their score is what was learned from then on.
        first: Plain runs.
        moving: How runs are moved.
        accuracy: When to stop.

    Returns:
        The levels; None where the score stopped rising before runs fell, or runs ran out.
    """
    if outcomes.score is not None:
        return _piloted(seed, outcomes, first[: accuracy.size], moving, accuracy)
    if accuracy.most - outcomes.runs < splitting.AT_MOST + accuracy.size:
        outcomes.score, outcomes.learns = OTHERWISE, False
        return None
    score = splitting.learned(seed, outcomes, sum(outcome.fell for _, outcome in first)) if moving.times else None
    outcomes.score, outcomes.learns = score or OTHERWISE, score is not None
    for number in range(PILOTS):
        outcomes.learns = score is not None and number < PILOTS - 1
        first = outcomes.plain(stream(seed, f"certify.first.{number}"), accuracy.size)
        levels = _piloted(seed + number, outcomes, first, moving, accuracy)
        if not outcomes.learns or accuracy.most - outcomes.runs < accuracy.size:
            break
        # Walks that a pilot brought close to a fall say what the score has wrong: it is learned once more, with them.
        outcomes.score = splitting.fitted(np.array(outcomes.states), LEFT)
    outcomes.learns = False
    outcomes.states.clear()
    return levels


def _piloted(
    seed: int, outcomes: Outcomes, first: Sequence[splitting.Member], moving: splitting.Moving, accuracy: Accuracy
) -> splitting.Levels | None:
    (levels,) = outcomes.finish([splitting.pilot(seed, first, moving, accuracy.most - outcomes.runs)])
    return levels


def _counting(rng: np.random.Generator, outcomes: Outcomes, first: Sequence[splitting.Member], accuracy: Accuracy,
              doubt: str) -> Found:  # fmt: skip
    """Counts plain runs until the interval is narrow, looking whenever there are half as many again."""
    outcomes.score, outcomes.learns = OTHERWISE, False  # nothing is learned from a count
    sample = list(first)
    while True:
        falls = sum(outcome.fell for _, outcome in sample)
        found = counted(falls, len(sample))
        reached = falls >= LEAST_FALLS and found.relative <= accuracy.relative
        left = accuracy.most - outcomes.runs
        if reached or left <= 0:
            fell = [one for one in sample if one[1].fell]
            return Found(found, reached, [outcome for _, outcome in sample], (), None, fell, doubt, COUNTING)
        sample += outcomes.plain(rng, min(left, max(FIRST, len(sample) // 2)))


def _splitting(
    seed: int, outcomes: Outcomes, levels: splitting.Levels, moving: splitting.Moving, accuracy: Accuracy
) -> Found:
    samples: list[splitting.Sample] = []
    cost = splitting.cost_of(levels, accuracy.size, moving)
    while True:
        number = len(samples)
        wave = range(number, number + min(WAVE, (accuracy.most - outcomes.runs) // cost))
        samples += outcomes.finish([splitting.sampled(seed, i, accuracy.size, levels, moving) for i in wave])
        found = combined([sample.probability for sample in samples], splitting.least_scatter(samples, accuracy.size))
        reached = len(samples) >= 2 * LEAST_SAMPLES and found.relative <= accuracy.relative
        if reached or outcomes.runs + cost > accuracy.most:
            break
    plain = [outcome for sample in samples for outcome in sample.plain]
    fell = [one for sample in samples for one in sample.fell]
    return Found(found, reached, plain, samples, levels, fell, _disagreement(found, plain, "levels"), SPLITTING)


def of_weights(says: Weighted) -> Probability:
    """The mean of weights, with Student's interval of its logarithm, by as many falls as the weights are worth.

    Large weights are rare, and an estimate without one is low and seems sure. The upper end is therefore that of the
    same runs with one more fall of the largest weight.
    """
    if says.effective <= 1.0:
        return Probability(says.mean, 0.0, 1.0)
    from scipy.special import stdtrit

    factor = math.exp(min(float(stdtrit(says.effective - 1.0, 0.975)) * says.error, 700.0))
    return Probability(says.mean, says.mean / factor, min(1.0, (says.mean + says.largest) * factor))


def _shifting(
    seed: int, outcomes: Outcomes, first: Sequence[splitting.Member], process: Process | None, accuracy: Accuracy
) -> Found | None:
    """The estimate by shifted runs; None where nothing can be shifted, or no pattern was found."""
    if process is None:
        return None
    rng = stream(seed, "certify.shift")
    outcomes.learns = False
    learner = Learner(process, outcomes, rng)
    mixture = learner.learn(min(LEARNING_RUNS, int(LEARNING * (accuracy.most - outcomes.runs))))
    if mixture is None or accuracy.most - outcomes.runs < EACH:
        return None
    plain, fell, runs, stages = [outcome for _, outcome in first], [], 0, Stages(process)
    while True:
        drawn = mixture.draw(rng, min(max(EACH, runs // 2), accuracy.most - outcomes.runs))
        met = list(zip(drawn, outcomes(drawn), strict=True))
        runs += len(met)
        plain += [outcome for run, outcome in met if not run.moves]
        falls = [one for one in met if one[1].fell]
        fell += falls
        says = stages.add(mixture, len(met), [run for run, _ in falls])
        found = of_weights(says)
        reached = says.effective >= CERTAIN and found.relative <= accuracy.relative
        if reached or outcomes.runs >= accuracy.most:
            break
        learner.go_on(mixture, drawn, [run for run, _ in falls])
        mixture = learner.mixture()
    doubt = _disagreement(found, plain, "shifted ones")
    if not doubt and says.effective < CERTAIN:
        doubt = f"the weights of the {len(fell)} shifted runs that fell are worth {says.effective:.1f} falls: too few"
    return Found(found, reached, plain, (), None, fell, doubt, SHIFTING, mixture, says.effective)


def _disagreement(found: Probability, plain: Sequence[RunOutcome], others: str) -> str:
    """Whether plain runs, in which no level leads anywhere, say something else."""
    falls = sum(outcome.fell for outcome in plain)
    low, high = counted(falls, len(plain))[1:]
    if low > found.high:
        return f"{falls} of the {len(plain)} plain runs fell, more than the {others} say: some falls come without them"
    if high < found.low:
        return f"{falls} of the {len(plain)} plain runs fell, fewer than the {others} say"
    return ""
