"""Importance sampling: runs whose random force is shifted towards a fall, each with the weight that the shift gives it.

A rare fall takes a pattern of the force over a second or two. A share of the runs is plain; of the others each is
shifted along one of a few patterns, placed at some time. Run i is drawn from the mixture q and weighs w = φ/q, which is
known exactly; the mean of the weights of those that fell is unbiased whatever the patterns are, and no weight exceeds
one over the plain share (a defensive mixture: T. Hesterberg, Technometrics 37:185, 1995). Patterns are those of the
falls that are met, by weight: the cross-entropy method (R. Rubinstein, D. Kroese, 2004), as expectation and
maximisation of a mixture in which every pattern may stand at any time.

The runs that count are drawn in stages. The mixture of a stage is fixed before it, by all falls met so far: given what
was met, the mean weight of every stage is unbiased, and so is their mean with shares that are fixed beforehand. Later
stages have better patterns and larger shares, by the square root of their number (A. Owen, Y. Zhou, arXiv:1901.02976).
"""

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from biped.scenario.randomise import Move, Normals, Shift
from biped.studies.certify.running import Outcomes
from biped.studies.certify.splitting import EARLIEST

PLAIN = 0.1
"""Share of the runs that is not shifted."""
LENGTH, AFTER = 24, 8
"""Blocks of a pattern, and how many of its last may lie beyond the end of the run."""
WIDTHS = (5, 10)
"""Blocks of the pulses from which learning begins."""
STRENGTH = 3.0
"""Of these pulses."""
FACTORS = (1.0, 1.4, 2.0, 2.8, 4.0, 5.6)
"""Of the force, up to one under which enough runs fall, and back."""
WIDER = 1.3
"""Their spread, and the largest of any pattern."""
NARROWEST = 0.6
"""Smallest spread of a pattern: what few falls say is too sure of itself."""
STRONGEST = 5.0
"""Shift along a pattern at most."""
SEEN = 0.6
"""Share of a pattern, by its norm, that lies within the run at least."""
BATCH, FALLS = 100, 6
"""Runs of the first batches, and falls in one after which patterns are learned."""
ROUND, ROUNDS, ENOUGH = 200, 3, 30.0
"""Runs of a round of learning, rounds under a stronger force at most, and effective falls at which learning ends."""
LEAST_SHARE = 0.2
"""Of the runs, spread evenly over patterns and times: one that mattered little may matter under a weaker force."""
PRIOR = 5.0
"""Effective falls that the patterns and their times as they were before a round count as."""
EVEN = 0.3
"""Share of every pattern's runs that is spread evenly over all times."""
UNLIKELY = 0.1
"""Of a fall that no pattern explains: how much likelier than a plain run a pattern has to make it."""
PASSES = 6
"""Of expectation and maximisation in a round."""
FOLLOWS = 0.5
"""Power of the ratio of two strengths of the force by which patterns become longer where it becomes weaker."""
WEAKER = ((0.85, 1.0), (0.6, WIDER))
"""Share of a pattern's shift, and least spread, of the weaker patterns that each is accompanied by."""
KERNEL = np.array([1.0, 2.0, 3.0, 2.0, 1.0]) / 9.0
"""Over blocks, with which half of a pattern is smoothed."""


class Process(NamedTuple):
    """The normals that may be shifted.

    Attributes:
        times: [s] from which each row of them acts.
        each: Rows in a block.
        acts: Directions that matter.
        drawn: The normals of a run, (n,) or (n, directions).
    """

    times: tuple[float, ...]
    each: int
    acts: tuple[int, ...]
    drawn: Callable[[Normals], np.ndarray]

    @property
    def sizes(self) -> np.ndarray:
        """(blocks,) rows of each block."""
        return np.bincount(np.arange(len(self.times)) // self.each)

    def blocks(self, run: Normals) -> np.ndarray:
        """(blocks, directions) of a run: sums of its normals in each block, standard normal again."""
        z = self.drawn(run).reshape(len(self.times), -1)[:, self.acts]
        return np.add.reduceat(z, np.arange(0, len(z), self.each), axis=0) / np.sqrt(self.sizes)[:, None]

    def blocks_of(self, runs: Sequence[Normals]) -> np.ndarray:
        """(n, blocks, directions) of several runs."""
        return np.array([self.blocks(run) for run in runs]).reshape(len(runs), len(self.sizes), len(self.acts))


class Pattern(NamedTuple):
    """A course of the force that leads to a fall.

    Attributes:
        direction: (LENGTH, directions) of unit norm.
        by: Shift along it.
        spread: Standard deviation along it.
        shares: Of the shifted runs, by the block that it ends before.
    """

    direction: np.ndarray
    by: float
    spread: float
    shares: np.ndarray


class Mixture:
    """From which runs are drawn: plain ones, and patterns at times.

    Args:
        patterns: Whose shares add up to anything.
        process: The normals.
    """

    def __init__(self, patterns: Sequence[Pattern], process: Process):
        self.patterns, self._process = tuple(patterns), process
        self._placed = np.concatenate([placed(one.direction, len(process.sizes)) for one in patterns])
        seen = np.sqrt((self._placed**2).sum(axis=(1, 2)))
        ends = len(self._placed) // len(patterns)
        self._by = np.repeat([one.by for one in patterns], ends) * seen
        self._spread = np.repeat([one.spread for one in patterns], ends)
        self._shares = np.concatenate([one.shares for one in patterns]) * (seen >= SEEN)
        self._shares /= self._shares.sum()
        self._placed /= np.maximum(seen, EARLIEST)[:, None, None]

    def odds(self, blocks: np.ndarray) -> np.ndarray:
        """(n, components) logarithm of how much likelier each component makes runs than plain draws do, by shares.

        Args:
            blocks: (n, blocks, directions) of the runs.
        """
        along = np.tensordot(blocks, self._placed, ((1, 2), (1, 2)))
        odds = 0.5 * along**2 - 0.5 * ((along - self._by) / self._spread) ** 2 - np.log(self._spread)
        return odds + np.log(np.maximum(self._shares, 1e-300))

    def weights(self, blocks: np.ndarray) -> np.ndarray:
        """(n,) how much likelier runs are among plain draws than in the mixture."""
        return 1.0 / (PLAIN + (1.0 - PLAIN) * np.exp(np.minimum(self.odds(blocks), 600.0)).sum(axis=1))

    def draw(self, rng: np.random.Generator, count: int) -> list[Normals]:
        """Runs, as evenly over components as their shares allow."""
        ends = np.cumsum([PLAIN, *((1.0 - PLAIN) * self._shares)])
        numbers = np.searchsorted(ends, (rng.random() + np.arange(count)) / count, side="right")
        return [self._run(int(rng.integers(2**62)), min(int(number), len(ends) - 1)) for number in numbers]

    def summary(self) -> tuple[dict[str, float], ...]:
        """Of every pattern its shift, its spread, and its share of the shifted runs."""
        total = sum(float(one.shares.sum()) for one in self.patterns)
        return tuple(
            {"by": one.by, "spread": one.spread, "share": float(one.shares.sum()) / total} for one in self.patterns
        )

    def _run(self, seed: int, number: int) -> Normals:
        if number == 0:
            return Normals(seed)
        process, placed = self._process, self._placed[number - 1]
        rows = np.flatnonzero(placed.any(axis=1))
        first, last = int(rows[0]), int(rows[-1]) + 1
        pattern = np.zeros((last - first, max(process.acts) + 1))
        pattern[:, process.acts] = placed[first:last] / np.sqrt(process.sizes[first:last, None])
        shift = Shift(pattern=tuple(map(tuple, pattern.tolist())), each=process.each,
                      by=float(self._by[number - 1]), spread=float(self._spread[number - 1]))  # fmt: skip
        after = float(process.times[first * process.each])
        return Normals(seed).moved(Move(beta=0.0, keep=1.0, after=after, shift=shift))


def placed(direction: np.ndarray, blocks: int) -> np.ndarray:
    """(ends, blocks, directions) a pattern that ends before each block, from the first to some beyond the last."""
    out = np.zeros((blocks + AFTER, blocks, direction.shape[1]))
    for row in range(len(out)):
        first = row + 1 - LENGTH
        low, high = max(0, first), min(blocks, row + 1)
        out[row, low:high] = direction[low - first : high - first]
    return out


class Weighted(NamedTuple):
    """The mean of weights, those of runs that stood being zero.

    Attributes:
        mean: The estimate.
        effective: Falls of one weight that would say as much.
        runs: How many there were.
        largest: What the largest weight adds to the mean.
    """

    mean: float
    effective: float
    runs: int
    largest: float

    @property
    def error(self) -> float:
        """Relative standard error of the mean."""
        return math.sqrt(max(1.0 / self.effective - 1.0 / self.runs, 0.0)) if self.effective else math.inf


def weighted(weights: np.ndarray, runs: int) -> Weighted:
    """The estimate from the weights of the runs that fell, of so many."""
    total, squares = float(weights.sum()), float((weights**2).sum())
    effective = total * total / squares if squares > 0.0 else 0.0
    return Weighted(total / runs, effective, runs, float(weights.max(initial=0.0)) / runs)


class Learner:
    """Finds patterns: under a stronger force first, under which falls are not rare, and then under weaker ones.

    Falls that another law is compared by count where that law stands.

    Args:
        process: The normals.
        outcomes: Of runs.
        rng: Of everything random in it.
    """

    def __init__(self, process: Process, outcomes: Outcomes, rng: np.random.Generator):
        self._process, self._outcomes, self._rng = process, outcomes, rng
        self._patterns = self._pulses()
        self._drawn: list[tuple[Mixture, int]] = []
        self._fell: list[np.ndarray] = []

    def learn(self, most: int) -> Mixture | None:
        """The mixture that falls are likely in; None where no shifted run fell, or runs ran out.

        Args:
            most: Runs at most.
        """
        end, number = self._outcomes.runs + most, 0
        for number in range(len(FACTORS)):
            if self._outcomes.runs + BATCH + (number + 1) * ROUND > end:
                return None
            self._drawn, self._fell = [], []
            self._meet(BATCH, FACTORS[number])
            if len(self._fell) >= FALLS:
                break
        while self._fell:
            self._improve()
            rounds, effective = len(self._drawn), self._pooled()[1].effective
            left = (end - self._outcomes.runs) // ROUND
            if number == 0 and (effective >= ENOUGH or left < 1):
                return self.mixture()
            if number > 0 and (rounds >= ROUNDS or effective >= 0.5 * ENOUGH or left <= number + 1):
                longer = (FACTORS[number] / FACTORS[number - 1]) ** FOLLOWS
                self._patterns = [one._replace(by=min(longer * one.by, STRONGEST)) for one in self._patterns]
                self._drawn, self._fell, number = [], [], number - 1
            self._meet(ROUND, FACTORS[number])
            while not self._fell and self._outcomes.runs + ROUND <= end:
                self._meet(ROUND, FACTORS[number])
        return None

    def sharpest(self) -> Mixture:
        """The patterns alone, of whose runs most fall."""
        return Mixture(self._patterns, self._process)

    def mixture(self) -> Mixture:
        """Every pattern with weaker ones beside it, from which runs that count may be drawn.

        A mixture that is narrower than the falls are would give a few of them large weights.
        """
        weaker = [
            one._replace(by=share * one.by, spread=max(least, one.spread))
            for share, least in WEAKER
            for one in self._patterns
        ]
        return Mixture([*self._patterns, *weaker], self._process)

    def go_on(self, mixture: Mixture, runs: Sequence[Normals], fell: Sequence[Normals]) -> None:
        """Learns from runs that were made elsewhere.

        Args:
            mixture: What they were drawn from.
            runs: All of them, under the scenario's own force.
            fell: Those that fell.
        """
        self._drawn.append((mixture, len(runs)))
        self._fell += list(self._process.blocks_of(fell))
        if self._fell:
            self._improve()

    def _pulses(self) -> list[Pattern]:
        shares, out = np.ones(len(self._process.sizes) + AFTER), []
        for way in range(len(self._process.acts)):
            for width in WIDTHS:
                pulse = np.zeros((LENGTH, len(self._process.acts)))
                pulse[LENGTH - 2 - width : LENGTH - 2, way] = 1.0 / math.sqrt(width)
                out += [Pattern(sign * pulse, STRENGTH, WIDER, shares) for sign in (1.0, -1.0)]
        return out

    def _meet(self, count: int, factor: float) -> None:
        mixture = self.sharpest()
        runs = mixture.draw(self._rng, count)
        stronger = Move(beta=0.0, keep=factor, after=EARLIEST)
        met = self._outcomes(runs if factor == 1.0 else [run.moved(stronger) for run in runs])
        self._drawn.append((mixture, count))
        self._fell += [self._process.blocks(run) for run, one in zip(runs, met, strict=True) if one.fell and one.stands]

    def _pooled(self) -> tuple[np.ndarray, Weighted]:
        """Weights of the falls that were met, by all that was drawn from under this force, and what they say."""
        fell, runs = np.array(self._fell), sum(count for _, count in self._drawn)
        weights = 1.0 / sum((count / runs / one.weights(fell) for one, count in self._drawn), np.zeros(len(fell)))
        return weights, weighted(weights, runs)

    def _improve(self) -> None:
        """Patterns as the falls under this force have them, beside what they were: expectation and maximisation."""
        fell, (weights, says) = np.array(self._fell), self._pooled()
        weights = np.minimum(weights, weights.mean() * math.sqrt(len(weights)))  # E. Ionides, 2008
        weights *= weighted(weights, says.runs).effective / weights.sum()
        blocks = fell.shape[1]
        pad = np.full((len(fell), LENGTH - 1 + blocks + AFTER, fell.shape[2]), np.nan)
        pad[:, LENGTH - 1 : LENGTH - 1 + blocks] = fell
        windows = np.stack([pad[:, row : row + LENGTH] for row in range(blocks + AFTER)], axis=1)
        known, windows = np.isfinite(windows).astype(float), np.nan_to_num(windows)
        total = sum(one.shares.sum() for one in self._patterns)
        before = [one._replace(shares=PRIOR / total * one.shares) for one in self._patterns]
        after = before
        for _ in range(PASSES):
            wide = [one._replace(spread=max(one.spread, 0.8)) for one in after]
            odds = Mixture(wide, self._process).odds(fell)
            most = odds.max(axis=1, keepdims=True)
            belongs = np.exp(odds - most)
            belongs /= belongs.sum(axis=1, keepdims=True) + UNLIKELY * np.exp(np.minimum(-most, 50.0))
            belongs = (belongs * weights[:, None]).reshape(len(fell), len(after), -1)
            after = [_pattern(one, belongs[:, i], windows, known) for i, one in enumerate(before)]
        least = LEAST_SHARE * sum(one.shares.sum() for one in after) / (len(after) * len(after[0].shares))
        self._patterns = [one._replace(shares=np.maximum(one.shares, least)) for one in after]


def _pattern(before: Pattern, belongs: np.ndarray, windows: np.ndarray, known: np.ndarray) -> Pattern:
    """A pattern by the falls that belong to it, smoothed.

    Args:
        before: As it was, with shares that add up to the falls that they count as.
        belongs: (n, ends) how much of each fall belongs to it at each time.
        windows: (n, ends, LENGTH, directions) blocks of the falls.
        known: Of which 1 are within the run, and others 0.
    """
    sums = np.tensordot(belongs, windows, 2) + PRIOR * before.by * before.direction
    mean = sums / (np.tensordot(belongs, known, 2) + PRIOR)
    smooth = np.stack([np.convolve(one, KERNEL, mode="same") for one in mean.T], axis=1)
    mean = 0.5 * (mean + smooth)
    by = float(np.linalg.norm(mean))
    direction = mean / max(by, EARLIEST)
    seen = np.sqrt(np.tensordot(known, direction**2, 2))
    away = np.tensordot(windows, direction, 2) / np.maximum(seen, 0.3) - by * seen
    count = belongs.sum()
    spread = math.sqrt(((belongs * away**2).sum() + PRIOR * before.spread**2) / (count + PRIOR))
    near = np.exp(-0.5 * (np.arange(-6, 7) / 1.5) ** 2)
    shares = np.convolve(belongs.sum(axis=0), near / near.sum(), mode="same")
    shares = (1.0 - EVEN) * shares + EVEN * count / len(shares) + before.shares
    return Pattern(direction, min(by, STRONGEST), min(max(spread, NARROWEST), WIDER), shares)


class Stages:
    """Weights of the runs that count, stage by stage.

    Args:
        process: The normals.
    """

    def __init__(self, process: Process):
        self._process = process
        self._weights: list[tuple[int, np.ndarray]] = []

    def add(self, mixture: Mixture, runs: int, fell: Sequence[Normals]) -> Weighted:
        """The estimate of all stages together, after one more of so many runs, of which some fell."""
        self._weights.append((runs, mixture.weights(self._process.blocks_of(fell))))
        total = sum(count for count, _ in self._weights)
        shares = np.array([count * math.sqrt(number) for number, (count, _) in enumerate(self._weights, 1)])
        shares *= total / shares.sum()
        each = [share / count * weights for share, (count, weights) in zip(shares, self._weights, strict=True)]
        return weighted(np.concatenate(each), total)
