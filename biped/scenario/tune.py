"""The table [tune] of a scenario file: what a search varies, under which conditions, and what it wants."""

from typing import Annotated, Any, Literal

from msgspec import Meta, field

from biped.scenario.section import Count, NonNegative, Positive, Real, Section

Share = Annotated[float, Meta(gt=0, le=1)]


class Range(Section, frozen=True):
    """Within what a search may change a number.

    Attributes:
        min: Smallest value.
        max: Largest value.
        scale: Whether steps are differences (`linear`) or ratios (`log`).
    """

    min: Real
    max: Real
    scale: Literal["linear", "log"] = "linear"


class Weights(Section, frozen=True):
    """Weights of the terms that the search's objective adds up, per run.

    Attributes:
        falls: Cost of a run that misses its goal: all of it at the start, half of it just before the end.
        progress: Share of that half which is earned by distance, not time: a stander is no better than a fall.
        excess: Times the relative excess of metrics over `limits`, of runs that reach their goal.
        speed: Times the squared relative error of the speed, where a condition names one.
        cost_of_transport: Times the net cost of transport.
        closeness: Times the mean square distance from the gait the search starts at, in units of its steps.
    """

    falls: NonNegative = 1.0
    progress: Annotated[float, Meta(ge=0, le=1)] = 0.0
    excess: NonNegative = 1.0
    speed: NonNegative = 1.0
    cost_of_transport: NonNegative = 0.0
    closeness: NonNegative = 0.0


class Condition(Section, frozen=True):
    """One kind of run that a gait is tuned for.

    Attributes:
        set: What it changes: part of a scenario, e.g. `set = { ground.slope = 5.0 }`.
        runs: Runs of each gait in each generation.
        weight: Of its mean cost among the conditions.
        speed: [m/s] wanted.
        growth: Most by which neighbours should part in a return of the stride: ln of the factor. Each walk, of a
            planar biped of seven links, costs five returns of two neighbours more; what is beyond counts as an excess
            over a limit of one.
        goal: What the gait should do in its window: walk, stand or sit.
    """

    set: dict[str, Any] = field(default_factory=dict)
    runs: Count = 4
    weight: Positive = 1.0
    speed: Positive | None = None
    growth: Real | None = None
    goal: Literal["walked", "stood", "sat"] = "walked"


class Stage(Section, frozen=True):
    """A part of a search; the next one starts at the best gait that it found.

    Attributes:
        generations: Of this stage; default: those of [tune].
        conditions: Names of the conditions that count; default: all.
        hold: Gains and the values that they keep in it, e.g. `hold = { theta_b = 80.0 }`.
        set: Part of a scenario that all of its conditions have.
        spread: First standard deviation; default: that of [tune].
        limits: Instead of those of [tune].
        enough: Instead of that of [tune].
    """

    generations: Count | None = None
    conditions: tuple[str, ...] | None = None
    hold: dict[str, Real] = field(default_factory=dict)
    set: dict[str, Any] = field(default_factory=dict)
    spread: Positive | None = None
    limits: dict[str, Positive] | None = None
    enough: Share | None = None


class Tune(Section, frozen=True):
    """A search for gains, `biped tune`; it starts at the scenario's own gait.

    Attributes:
        gains: Names of the gains that vary; default: all. Gains that are zero stay zero.
        factor: By how much a gain may be multiplied or divided.
        angle: Degrees by which an angle may change.
        keys: Other numeric scenario keys that vary, dotted.
        conditions: What the gait is tuned for, by name.
        weights: The objective.
        limits: Metrics and the most that they should be, e.g. `{ torso_lean = 10.0, torque_rate = 2.0 }`.
        pace: [m/s] that a run which misses its goal must keep to earn all that `weights.progress` gives; default: that
            of the slowest walk.
        duration: [s] of runs while searching; re-checks take the scenario's own.
        generations: Generations of CMA-ES.
        population: Gaits per generation.
        spread: First standard deviation of steps: ratios of gains, 20 degrees, ranges of keys.
        covariance: What CMA-ES learns of how steps go together; `diagonal` learns faster.
        first: Fraction of its runs that each gait gets before the worse ones are given up.
        keep: Fraction of gaits that get all their runs.
        recheck: Generations between re-checks of the mean on fresh seeds.
        checks: Runs of each condition in a re-check.
        finalists: Best re-checked gaits among which the last comparison, on fresh seeds, decides.
        enough: Share of runs of every condition in a re-check that reach their goal with which a stage ends before its
            generations do; default: never.
        unseen: Runs of each condition on seeds no decision was made on.
        stages: Parts of the search, one after the other; default: one, with everything above.
    """

    gains: tuple[str, ...] | None = None
    factor: Annotated[float, Meta(gt=1, le=1e6)] = 5.0
    angle: Positive = 20.0
    keys: dict[str, Range] = field(default_factory=dict)
    conditions: dict[str, Condition] = field(default_factory=dict)
    weights: Weights = Weights()
    limits: dict[str, Positive] = field(default_factory=dict)
    pace: Positive | None = None
    duration: Positive | None = None
    generations: Count = 40
    population: Annotated[int, Meta(ge=4, le=100_000)] = 16
    spread: Positive = 0.1
    covariance: Literal["diagonal", "full"] = "diagonal"
    first: Annotated[float, Meta(gt=0, le=1)] = 0.34
    keep: Annotated[float, Meta(gt=0, le=1)] = 0.6
    recheck: Count = 5
    checks: Count = 8
    finalists: Count = 3
    enough: Share | None = None
    unseen: Count = 20
    stages: tuple[Stage, ...] = ()
