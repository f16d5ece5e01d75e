"""A score learned from runs under stronger disturbances: how likely a walk in this state is to fall soon.

The best levels are those of the probability of a fall given the state (F. Cérou, A. Guyader, Stoch. Anal. Appl. 25:417,
2007). Where falls are rare there are none to learn from: the normals of the disturbance are multiplied until falls are
frequent, and a penalised logistic regression on the states of those runs says which states precede falls. Whatever it
says, the estimate stays unbiased: it is fixed before the samples that count.
"""

import numpy as np

from biped.scenario.normals import Move, Normals
from biped.scenario.vary import stream
from biped.studies.certify.outcome import LEFT, LearnedScore, design, time_left
from biped.studies.certify.running import Outcomes
from biped.studies.certify.splitting import EARLIEST

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
