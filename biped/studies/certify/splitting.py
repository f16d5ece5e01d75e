"""Multilevel splitting: the probability of a rare fall as a product of shares that are not rare.

Runs are points in the space of the standard normals they draw (`biped.scenario.randomise`). Of a sample, those whose
score reaches a level are resampled and moved such that their distribution, given that they reach it, stays what it is:
subset simulation (S.-K. Au, J. Beck, Probab. Eng. Mech. 16:263, 2001). Levels are found by a pilot and fixed before
the samples that count are drawn; the product of the shares is then unbiased for any score, one that jumps too (P. Del
Moral, Feynman-Kac Formulae, 2004; F. Cérou, A. Guyader, Stoch. Anal. Appl. 25:417, 2007, on why levels found on the
way are not). A fall is above every level: one that no level leads to counts as well.

Moves, each of which leaves that distribution as it is:
- *branch*: the run as it was until its score first reached the level, and another process from then on. Time and place
  of reaching it stay what they are, so that it is never refused: the mid-run cloning of J. Garvels' and F. Cérou's
  splitting, the state restored by repeating the run to the last bit;
- *whole*: all normals mixed a little, those that no time belongs to as well, refused where the level is missed
  (preconditioned Crank-Nicolson).

A share of the resampled runs stays as it is: it costs nothing, and as which places of a sample stay does not depend on
the sample, the product stays unbiased.

The best levels are those of the probability of a fall given the state (F. Cérou, A. Guyader, Stoch. Anal. Appl. 25:417,
2007). Where falls are rare there are none to learn from: the normals of the disturbance are multiplied until falls are
frequent, and a penalised logistic regression on the states of those runs says which states precede falls. Whatever it
says, the estimate stays unbiased: it is fixed before the samples that count.
"""

import math
from bisect import bisect_right
from collections.abc import Generator, Sequence
from typing import NamedTuple

import numpy as np

from biped.base.typed import LARGEST
from biped.scenario.randomise import Move, Normals
from biped.scenario.vary import stream
from biped.studies.certify.outcome import LEFT, LearnedScore, RunOutcome, design, time_left
from biped.studies.certify.running import Outcomes

SHARE = 0.3
"""Of a sample that reaches the next level, and of the runs at a level that are not moved."""
FEWER = 0.1
"""Share of a sample that falls from which its levels are enough if the score rises no further."""
USUAL = 0.9
"""Share of plain runs in which a precursor stays below its baseline."""
WHOLE = 0.2
"""Share of moves of all normals; the others are branches."""
EARLIEST = 1e-9
"""[s] that stands for the beginning: 0 moves what no time belongs to as well."""
BETAS = (0.4, 0.9)
"""Smallest and largest weight of fresh normals in a move that may be refused."""

Member = tuple[Normals, RunOutcome]
"""A run of a sample."""
Sampling = Generator[list[Normals], list[RunOutcome], "Sample"]
"""Asks for the outcomes of runs, and returns what it found."""


class Levels(NamedTuple):
    """Levels that a pilot found.

    Attributes:
        values: Of the score, rising; a fall is above them.
        baseline: Of every precursor.
    """

    values: tuple[float, ...]
    baseline: tuple[float, ...]


class Sample(NamedTuple):
    """A sample of runs from level to level.

    Attributes:
        shares: Of the runs that reached each level, and at last a fall.
        plain: Outcomes of the first runs, which nothing selected.
        fell: Runs that fell at the end, with their outcomes.
        accepted: Share of the moves that were not refused.
        runs: How many were made.
    """

    shares: tuple[float, ...]
    plain: tuple[RunOutcome, ...]
    fell: tuple[tuple[Normals, RunOutcome], ...]
    accepted: float
    runs: int

    @property
    def probability(self) -> float:
        """The unbiased estimate."""
        return math.prod(self.shares)


class Moving(NamedTuple):
    """How runs are moved.

    Attributes:
        times: [s] from which what is drawn for a time acts, rising; empty where nothing is, so that only whole moves
            are made.
    """

    times: tuple[float, ...]

    @property
    def repeats(self) -> int:
        """How often a run is moved at each level: no branch, and what is refused leaves two runs the same."""
        return 1 if self.times else 2


def moved_of(size: int) -> int:
    """How many runs of a sample are moved at a level."""
    return size - round(SHARE * size)


def cost_of(levels: Levels, size: int, moving: Moving) -> int:
    """Runs that a sample takes."""
    return size + moved_of(size) * moving.repeats * len(levels.values)


def baseline_of(plain: Sequence[RunOutcome]) -> tuple[float, ...]:
    """Values that precursors usually stay below; of one that is the same in every run, which says nothing, infinity."""
    precursors = 1 + max((which for outcome in plain for _, which, _ in outcome.rises), default=0)
    peaks = [[one.peak(number) for one in plain if math.isfinite(one.peak(number))] for number in range(precursors)]
    return tuple(float(np.quantile(each, USUAL)) if len(set(each)) > 1 else math.inf for each in peaks)


def pilot(
    seed: int, first: Sequence[Member], moving: Moving, most: int
) -> Generator[list[Normals], list[RunOutcome], Levels | None]:
    """Finds levels from a plain sample onwards, each reached by a share of the runs that reached the one before.

    Args:
        seed: Of everything random in it.
        first: Plain runs.
        moving: How runs are moved.
        most: Runs at most.

    Returns:
        The levels; None where the score stopped rising before runs fell, or runs ran out.
    """
    rng, baseline = stream(seed, "certify.pilot"), baseline_of([outcome for _, outcome in first])
    values: list[float] = []
    sample = list(first)
    while True:
        scores = np.array([outcome.score(baseline) for _, outcome in sample])
        if np.isinf(scores[scores > 0.0]).sum() >= SHARE * len(scores):
            return Levels(tuple(values), baseline)
        level = float(np.sort(scores)[-max(2, math.ceil(SHARE * len(scores)))])
        if values and level <= values[-1]:
            level = min((score for score in scores if score > values[-1]), default=math.inf)
        if values and not math.isfinite(level) and np.isinf(scores[scores > 0.0]).sum() >= FEWER * len(scores):
            return Levels(tuple(values), baseline)
        if (len(values) + 1) * moving.repeats * moved_of(len(first)) > most or not math.isfinite(level):
            return None
        values.append(level)
        kept = [one for one, score in zip(sample, scores, strict=True) if score >= level]
        sample, _ = yield from _moved(rng, kept, len(first), level, baseline, moving)


def sampled(seed: int, number: int, size: int, levels: Levels, moving: Moving) -> Sampling:
    """A sample through all levels, independent of every other.

    Args:
        seed: Of everything random in it.
        number: Of the sample.
        size: Runs at each level.
        levels: Fixed before.
        moving: How runs are moved.
    """
    rng = stream(seed, f"certify.{number}")
    runs = [Normals(int(rng.integers(2**62))) for _ in range(size)]
    plain = yield runs
    sample, shares = list(zip(runs, plain, strict=True)), []
    accepted = moves = 0
    for level in levels.values:
        kept = [(run, outcome) for run, outcome in sample if outcome.score(levels.baseline) >= level]
        shares.append(len(kept) / size)
        if not kept:
            return Sample((*shares, 0.0), tuple(plain), (), accepted / max(moves, 1), size + moves)
        sample, count = yield from _moved(rng, kept, size, level, levels.baseline, moving)
        accepted, moves = accepted + count, moves + moving.repeats * moved_of(size)
    fell = tuple((run, outcome) for run, outcome in sample if outcome.fell)
    return Sample((*shares, len(fell) / size), tuple(plain), fell, accepted / max(moves, 1), size + moves)


def _resampled(rng: np.random.Generator, kept: list[Member], size: int) -> list[Member]:
    """As many as asked for of those that are kept, each as often as any other but for one: systematic resampling."""
    order = rng.permutation(len(kept))
    places = (rng.random() + np.arange(size)) * len(kept) / size
    return [kept[order[int(place) % len(kept)]] for place in places]


def _moved(
    rng: np.random.Generator, kept: list[Member], size: int, level: float, baseline: Sequence[float], moving: Moving
) -> Generator[list[Normals], list[RunOutcome], tuple[list[Member], int]]:
    """A sample of runs that reach the level, all but some of them moved; and how many moves were not refused."""
    count, accepted = moved_of(size), 0
    still, sample = _resampled(rng, kept, size - count), _resampled(rng, kept, count)
    for _ in range(moving.repeats):
        sample, good = yield from _moved_once(rng, sample, level, baseline, moving)
        accepted += good
    return still + sample, accepted


def _moved_once(
    rng: np.random.Generator, sample: list[Member], level: float, baseline: Sequence[float], moving: Moving
) -> Generator[list[Normals], list[RunOutcome], tuple[list[Member], int]]:
    times = [outcome.reached(level, baseline) for _, outcome in sample]
    proposed = [_proposed(rng, run, time, moving) for (run, _), time in zip(sample, times, strict=True)]
    outcomes = yield [run for run, _ in proposed]
    out, accepted = [], 0
    for old, time, (run, branched), outcome in zip(sample, times, proposed, outcomes, strict=True):
        # A contact is known a few ticks later: a branch that changes when the level was reached is no branch.
        good = outcome.score(baseline) >= level and (not branched or outcome.reached(level, baseline) == time)
        accepted += good
        out.append((run, outcome) if good else old)
    return out, accepted


def _proposed(rng: np.random.Generator, run: Normals, reached: float, moving: Moving) -> tuple[Normals, bool]:
    """A run moved, and whether by a branch."""
    seed, times = int(rng.integers(2**62)), moving.times
    if not times or float(rng.random()) < WHOLE:
        return run.moved(Move(seed=seed, beta=float(rng.uniform(*BETAS)))), False
    # What acts at that time is part of how the level was reached: the next piece is the first that may differ.
    number = bisect_right(times, reached + EARLIEST)
    return run.moved(Move(seed=seed, after=times[number] if number < len(times) else LARGEST)), True


def least_scatter(samples: Sequence[Sample], size: int) -> float:
    """Relative standard deviation that a sample's estimate would have if all runs at all levels were independent."""
    shares = [[sample.shares[i] for sample in samples if len(sample.shares) > i] for i in range(len(samples[0].shares))]
    means = [sum(each) / len(each) for each in shares if sum(each) > 0.0]
    return math.sqrt(sum((1.0 - share) / share / size for share in means))


FACTORS = (1.25, 1.5, 2.0, 3.0, 4.0, 6.0)
"""Of the normals of the disturbance, from the weakest on."""
OFTEN = 0.05
"""Share of a batch that falls if a factor is large enough: of much stronger disturbances, walks fall in other ways."""
BATCH, FALLS = 40, 30
"""Runs at a time until so many fell."""
AT_MOST = 560
"""Runs that learning takes at most."""
LEAST = 8
"""Falls that a score is learned from."""
PENALTY = 10.0
"""Of the squares of the weights."""
GOLDEN = 0.618034
"""Whose multiples' fractions are spread evenly."""
ROWS = 20_000
"""States at most, those that precede falls aside."""


def learned(seed: int, outcomes: Outcomes, falls: int, column: int | None = LEFT) -> LearnedScore | None:
    """Learns a score; None where too few runs fell, however strong the disturbance was.

    Args:
        seed: Of everything random in it.
        outcomes: Of runs, whose states are recorded.
        falls: Runs that fell among those whose states were recorded before.
        column: As of `fitted`.
    """
    rng = stream(seed, "certify.learn")

    def fallen(count: int, factor: float) -> int:
        move = Move(beta=0.0, keep=factor, after=EARLIEST)  # what no time belongs to stays as likely as it is
        runs = outcomes([Normals(int(rng.integers(2**62))).moved(move) for _ in range(count)])
        return sum(one.fell for one in runs)

    number = 0
    for _ in range(AT_MOST // BATCH):
        fell = fallen(BATCH, FACTORS[number])
        falls += fell
        if falls >= FALLS:
            break
        if fell < OFTEN * BATCH:  # falls of one batch may be chance: every batch says whether it is strong enough
            number = min(number + 1, len(FACTORS) - 1)
    return fitted(np.array(outcomes.states), column) if falls >= LEAST else None


def fitted(rows: np.ndarray, column: int | None = None) -> LearnedScore:
    """The logistic regression, quadratic in the state.

    Args:
        rows: (n, k + 1) states, and of each how long it takes until the fall [horizons].
        column: Of the state that says how much time is left. What would have been if less had been left is known as
            well, and learned from: every state is taken once more, with a share of its time.
    """
    follows = rows[:, -1] < 1.0
    if column is not None:
        less, share = rows.copy(), np.arange(1, len(rows) + 1) * GOLDEN % 1.0
        time = share * np.exp(rows[:, column])
        less[:, column] = time_left(time)
        rows, follows = np.concatenate([rows, less]), np.concatenate([follows, rows[:, -1] < time])
    each = max(1, (~follows).sum() // ROWS)
    chosen = follows | (np.cumsum(~follows) % each == 0)
    states, labels = rows[chosen, :-1], follows[chosen].astype(float)
    counts = np.where(labels > 0.5, 1.0, float(each))
    mean, deviation = states.mean(axis=0), states.std(axis=0)
    deviation[deviation < 1e-9] = np.inf
    x = design(states, mean, deviation)
    penalty = np.full(x.shape[1], PENALTY)
    penalty[0] = 1e-6
    weights = np.zeros(x.shape[1])
    for _ in range(50):  # Newton's method, in steps that cannot leap
        p = 1.0 / (1.0 + np.exp(-np.clip(x @ weights, -30.0, 30.0)))
        slope = x.T @ (counts * (p - labels)) + penalty * weights
        step = np.linalg.solve((x.T * (counts * p * (1.0 - p))) @ x + np.diag(penalty), slope)
        size = float(np.abs(step).max())
        weights -= step * min(1.0, 2.0 / size)
        if size < 1e-6:
            break
    few = (tuple(float(f"{one:.6g}") for one in numbers) for numbers in (mean, deviation, weights))
    return LearnedScore(*few)
