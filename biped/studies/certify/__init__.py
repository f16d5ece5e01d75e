"""`biped certify`: how likely a scenario's fall is, by counting, shifting or splitting."""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from biped.base.errors import InputError
from biped.base.files import label, nearest
from biped.base.writing import dumps
from biped.ensemble.backend import Jobs, Progress, Told, silent, unheard
from biped.ensemble.executor import workers
from biped.ensemble.guard import OF_RUNS
from biped.ensemble.plan import Plan
from biped.robot.ground import GRAVITY
from biped.scenario.randomise import Normals
from biped.scenario.vary import piece_normals, piece_times
from biped.studies.certify import estimation
from biped.studies.certify.estimation import Accuracy, Found, Probability, counted, estimated
from biped.studies.certify.outcome import LEARNED, SCORES
from biped.studies.certify.running import MakingOutcomes, journalled
from biped.studies.certify.shifting import Process
from biped.studies.certify.splitting import Member, Moving
from biped.studies.folders import folder_for
from biped.studies.run import plan_of, title_of


class Certified(NamedTuple):
    """How likely a fall is.

    Attributes:
        scenario: Its name.
        folder: Where it is written.
        duration: [s] of a run.
        method: Of `biped.studies.certify.estimation.METHODS`.
        score: What levels are of.
        probability: Of a fall within the duration.
        reached: Whether the interval is as narrow as asked for.
        runs: How many were made, all told.
        plain: How many of them nothing selected.
        falls: How many of those fell.
        steps: Mean number of foot strikes of a plain run.
        seconds: [s] mean time of a plain run.
        levels: Of the score; a fall is above them.
        shares: Of the runs that reached each level, and at last a fall: means of all samples.
        estimates: Of the samples.
        other: Plain runs that neither fell nor were completed.
        fell: Some runs that fell, with their outcomes.
        doubt: What speaks against the result, if anything.
        patterns: Of the force, which shifted runs were given: how far, how much they scatter, and their share.
        effective: How many falls of one weight would say as much as those of the shifted runs.
    """

    scenario: str
    folder: Path
    duration: float
    method: str
    score: str
    probability: Probability
    reached: bool
    runs: int
    plain: int
    falls: int
    steps: float
    seconds: float
    levels: tuple[float, ...]
    shares: tuple[float, ...]
    estimates: tuple[float, ...]
    other: int
    fell: tuple[Member, ...]
    doubt: str
    patterns: tuple[dict[str, float], ...]
    effective: float

    def per(self, steps: float) -> Probability:
        """The probability of a fall within so many steps, each as dangerous as any other."""
        times = steps / self.steps if self.steps > 0.0 else math.nan
        return Probability(*(-math.expm1(times * math.log1p(-min(one, 1.0 - 1e-16))) for one in self.probability))

    @property
    def steps_to_fall(self) -> Probability:
        """Mean number of steps to a fall, each as dangerous as any other (metastable walking, Byl & Tedrake 2009)."""
        value, low, high = (
            self.steps / -math.log1p(-one) if 0.0 < one < 1.0 else math.inf if one == 0.0 else self.steps
            for one in self.probability
        )
        return Probability(value, high, low)

    def as_dict(self) -> dict[str, Any]:
        """Plain data, as `--json` prints it and certify.json holds it."""
        return {
            "scenario": self.scenario, "folder": label(self.folder), "duration": self.duration, "method": self.method,
            "score": self.score, "probability": self.probability.value,
            "interval": [self.probability.low, self.probability.high], "reached": self.reached, "runs": self.runs,
            "plain": {"runs": self.plain, "falls": self.falls, "interval": list(counted(self.falls, self.plain)[1:]),
                      "steps": self.steps, "seconds": self.seconds, "other": self.other},
            "per_100_steps": list(self.per(100.0)), "steps_to_fall": list(self.steps_to_fall),
            "levels": list(self.levels), "shares": list(self.shares), "estimates": list(self.estimates),
            "doubt": self.doubt,
            "patterns": list(self.patterns), "effective": self.effective,
        }  # fmt: skip


def certify(
    name: str, changes: Sequence[str], jobs: Jobs, out: Path | None, accuracy: Accuracy = Accuracy(),  # noqa: B008
    progress: Progress = silent, tell: Told = unheard,
) -> Certified:  # fmt: skip
    """How likely a fall of a scenario's run is; goes on where an interrupted command in `out` stopped.

    Args:
        name: Name or path of the scenario.
        changes: `--set` changes.
        jobs: Number of processes, or a cluster.
        out: Results folder; default: a new one below runs/.
        accuracy: When to stop.
        progress: Told of every finished run.
        tell: Told what of an interrupted command could not be used.

    Raises:
        InputError: The scenario has nothing random, or has a sweep, or nothing fell in plain runs and in no level.
    """
    plan = plan_of(name, changes)
    _check(plan, accuracy)
    title = title_of(name)
    with folder_for(out, title, plan, foreign=OF_RUNS) as folder, \
            workers(MakingOutcomes(plan), jobs) as carried_out:  # fmt: skip
        settings = {"size": accuracy.size, "score": accuracy.score, "method": accuracy.method}
        outcomes, closing = journalled(folder, carried_out, settings, accuracy.most, progress, title, tell,
                                       None if accuracy.score == LEARNED else accuracy.score)  # fmt: skip
        with closing:
            moving = Moving(tuple(piece_times(plan.scenario).tolist()))
            found = estimated(plan.scenario.seed, outcomes, moving, accuracy, process_of(plan))
        if found.levels is not None and isinstance(outcomes.score, str):
            accuracy = accuracy._replace(score=outcomes.score)  # nothing could be learned
        certified = _certified(title, folder.path, plan.scenario.duration, accuracy, outcomes.runs, found)
        folder.save_text("certify.json", dumps(certified.as_dict(), indent=1))
    return certified


def _certified(title: str, path: Path, duration: float, accuracy: Accuracy, runs: int, found: Found) -> Certified:
    shares = [sample.shares for sample in found.samples]
    length = max(map(len, shares), default=0)
    means = tuple(
        float(np.mean([one[i] for one in shares if len(one) > i])) for i in range(length)
    )  # fmt: skip
    plain = found.plain
    return Certified(
        title, path, duration, found.method, accuracy.score,
        found.probability,
        found.reached, runs, len(plain), sum(outcome.fell for outcome in plain),
        float(np.mean([outcome.steps for outcome in plain])), float(np.mean([outcome.end for outcome in plain])),
        found.levels.values if found.levels else (), means, tuple(sample.probability for sample in found.samples),
        sum(bool(outcome.other) for outcome in plain), tuple(found.fell), found.doubt,
        () if found.mixture is None else found.mixture.summary(), found.effective,
    )  # fmt: skip


BLOCK = 1.0 / 3.0
"""[√(l/g)] in which a pattern of the force does not change: 0.1 s of a walker with legs of 0.9 m."""
TIMING = ("disturbance.at", "disturbance.correlation", "duration", "simulation")
"""Keys by which a run's force would be made of other normals."""


def process_of(plan: Plan) -> Process | None:
    """The normals of the random force, which may be shifted; None without one."""
    s, times = plan.scenario, piece_times(plan.scenario)
    if s.disturbance is None or any(key.startswith(TIMING) for key in s.randomise.draw):
        return None
    block = BLOCK * math.sqrt(plan.robot.leg / GRAVITY)
    each = max(1, round(block / (times[1] - times[0]))) if len(times) > 1 else 1
    acts = tuple(way for way, strength in enumerate(s.disturbance.force) if strength)

    def drawn(run: Normals) -> np.ndarray:
        return piece_normals(s, Normals(int(run), run.moves))

    return Process(tuple(times.tolist()), each, acts, drawn) if acts else None


def _check(plan: Plan, accuracy: Accuracy) -> None:
    scores = [LEARNED, *SCORES]
    if accuracy.score not in scores:
        raise InputError(f"--score {accuracy.score}: unknown score; {nearest(accuracy.score, scores)}")
    if not 0.0 < accuracy.relative < 10.0:
        raise InputError(
            f"--relative {accuracy.relative:g}: expected half the interval over the probability, such as 0.3"
        )
    if accuracy.size < estimation.LEAST_SIZE:
        raise InputError(f"--size {accuracy.size}: expected at least {estimation.LEAST_SIZE} runs at each level")
    least = estimation.FIRST + 2 * estimation.LEAST_SAMPLES * accuracy.size
    if accuracy.most < estimation.FIRST:
        raise InputError(f"--most {accuracy.most}: too few runs to say anything; expected at least {estimation.FIRST} "
                         f"to count, and some {4 * least} to split")  # fmt: skip
    check_random(plan)


def check_random(plan: Plan) -> None:
    """Makes sure that a scenario has something random, and that all of it is drawn.

    Raises:
        InputError: It has not.
    """
    s = plan.scenario
    if s.sweep:
        raise InputError("sweep: expected none: one question is asked, not one at every point", "sweep")
    for key, draw in s.randomise.draw.items():
        if draw.grid is not None:
            raise InputError(f'randomise.draw."{key}": expected choice, which is random, instead of grid', "randomise")
    random = s.randomise
    sensed = s.sensors.angle_noise or s.sensors.rate_noise or s.sensors.height_noise or s.sensors.zero_error
    drawn = random.draw or random.masses or random.controller_mass_matrix or random.controller_constraints
    reality = s.truth.unmodelled.torque or s.truth.unmodelled.patchy
    if not (drawn or reality or s.start.jitter or s.disturbance or s.ground.tiles.height or sensed or s.sensors.gyro):
        raise InputError(
            "nothing random in this scenario: every run is the same; expected [disturbance], [randomise.draw], "
            "start.jitter, ground.tiles, truth.unmodelled or noise of sensors, e.g. "
            "--set 'disturbance={force=[40.0,0.0]}'"
        )
