"""Tables of a scenario file about what runs are for: [expect]ations, a [standard] test, a search to [tune]."""

import math
import re
from collections.abc import Callable, Mapping
from typing import Annotated, Any, Literal

from msgspec import Meta, field

from biped.base.errors import InputError, echo
from biped.base.typed import LARGEST, Count, Name, NonNegative, Positive, Real, Section
from biped.scenario.gains import LackedGains
from biped.scenario.metrics import METRICS, Metric

_SHARE = re.compile(r"(\d+(?:\.\d+)?) ?%")


class Bound(Section, frozen=True):
    """The expected value of a metric, its mean over the runs that walked; `falls`, `walked`, `stood`, `sat` count runs.

    A count is a whole number of runs, or a share of them such as `"97 %"`, which holds for any number of runs: it is
    met when Wilson's 95 % interval of the runs' rate lies within it, missed when the interval lies outside it, and
    undecided otherwise. `"100 %"` and `"0 %"` mean all of these runs and none of them.

    Attributes:
        min: Smallest value.
        max: Largest value.
    """

    min: float | str | None = None
    max: float | str | None = None


def share_of(bound: float | str) -> float | None:
    """The share 0 … 1 that a bound asks for; None where it is a number."""
    found = _SHARE.fullmatch(bound) if isinstance(bound, str) else None
    return None if found is None else float(found[1]) / 100.0


def check_bounds(expect: Mapping[str, Bound], fail: Callable[[str, str], InputError]) -> None:
    """Refuses bounds that no metric can have.

    Args:
        expect: Bounds by the name of a metric.
        fail: Makes an error of a dotted key and what is wrong with it.

    Raises:
        InputError: A bound is no number or share, or they contradict each other.
    """
    for name, bound in expect.items():
        given = {which: value for which in ("min", "max") if (value := getattr(bound, which)) is not None}
        if not given:
            raise fail(f"expect.{name}", "expected min, max or both")
        for which, value in given.items():
            _check(METRICS[name], value, lambda what, at=f"expect.{name}.{which}": fail(at, what))
        if len(given) < 2:
            continue
        shares = [share_of(value) for value in given.values()]
        if (shares[0] is None) != (shares[1] is None):
            raise fail(f"expect.{name}", "expected min and max both as numbers or both as shares")
        low, high = (value if share is None else share for value, share in zip(given.values(), shares, strict=True))
        if low > high:
            raise fail(f"expect.{name}", f"expected min <= max, got {bound.min} > {bound.max}")


def _check(metric: Metric, value: float | str, fail: Callable[[str], InputError]) -> None:
    share = share_of(value)
    if metric.kind != "count":
        if isinstance(value, str):
            more = "; only counts of runs may be shares" if share is not None else ""
            raise fail(f"expected a number, got {echo(value)}{more}")
        return
    if share is not None:
        if share > 1.0:
            raise fail(f"expected a share of the runs, 0 % … 100 %, got {echo(value)}")
        return
    if isinstance(value, str) or value < 0.0 or not math.isfinite(value) or value != int(value):
        raise fail(f'expected a whole number of runs, or a share of them such as "97 %", got {echo(value)}')


class Standard(Section, frozen=True):
    """A standard test: the scenario's ensemble as it is, or at values of a key from the easiest to where it fails.

    Attributes:
        title: Of its row.
        order: Of rows: small ones come first.
        goal: What a run has to do.
        key: Dotted key that is searched, instead of any [sweep]; default: none.
        first: Its easiest value, where the search begins.
        step: From value to value until one fails; negative: downwards.
        last: Where the search ends if none fails.
        resolution: To which the largest value that holds is found between the last that holds and the first that fails;
            steps are a whole number of them.
        of: What values are multiples of: 1 (`si`), the robot's `weight` m g [N], or its `leg` length [m].
        legs: Other keys, and how many leg lengths they are set to.
        weights: Other keys, and how many weights m g they are set to.
        times: What the value is multiplied by in the table, e.g. by a duration for an impulse.
        unit: Of that product.
        shows: Metrics, at the largest value that holds.
        family: Whether it is for gaits alone that have `[[speeds]]`, whose range bounds the search.
        gaits: Which gaits it is for; default: all.
        gaits_only: Whether it is for gaits alone: a policy or a law of one's own has no gait that takes over, say.
        space: Whether it is for gaits of bipeds that move in space ([frontal] and [axial]); or of those in the plane.
        sideways: Whether it pushes or tilts to the side: no robot that moves in the plane is put to it.
    """

    title: Name
    order: Real = 0.0
    goal: Literal["walked", "stood"] = "walked"
    key: Name | None = None
    first: Real = 0.0
    step: Real = 1.0
    last: Real = 1.0
    resolution: Positive = 1.0
    of: Literal["si", "weight", "leg"] = "si"
    legs: dict[str, Annotated[float, Meta(gt=0, le=LARGEST)]] = field(default_factory=dict)
    weights: dict[str, Real] = field(default_factory=dict)
    times: Real = 1.0
    unit: Name = ""
    shows: tuple[Name, ...] = ()
    family: bool = False
    gaits: tuple[Name, ...] = ()
    gaits_only: bool = False
    space: bool = False
    sideways: bool = False


Share = Annotated[float, Meta(gt=0, le=1)]


class Range(Section, frozen=True):
    """Within what a search may change a number.

    Attributes:
        min: Smallest value.
        max: Largest value.
        scale: Whether steps are differences (`linear`) or ratios (`log`).
        start: The value at which the search begins if the scenario's own lies outside; default: that is refused.
    """

    min: Real
    max: Real
    scale: Literal["linear", "log"] = "linear"
    start: Real | None = None


class Weights(Section, frozen=True):
    """Weights of the terms that the search's objective adds up, per run.

    Attributes:
        falls: Cost of a run that misses its goal: all of it at the start, half of it just before the end.
        progress: Share of that half which is earned by distance, not time: a stander is no better than a fall.
        stillness: The same of one that should stand, by how little it strays and steps in the window.
        excess: Times the relative excess of metrics over `limits` and what they lack of `floors`, of runs that reach
            their goal.
        speed: Times the squared relative error of the speed, where a condition names one.
        cost_of_transport: Times the net cost of transport.
        closeness: Times the mean square distance from the gait the search starts at, in units of its steps.
    """

    falls: NonNegative = 1.0
    progress: Annotated[float, Meta(ge=0, le=1)] = 0.0
    stillness: Annotated[float, Meta(ge=0, le=1)] = 0.0
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
        limits: Instead of those of [tune] or its stage: none, e.g., of runs that are pushed.
        floors: Likewise.
        goal: What the gait should do in its window: walk, stand or sit.
    """

    set: dict[str, Any] = field(default_factory=dict)
    runs: Count = 4
    weight: Positive = 1.0
    speed: Positive | None = None
    growth: Real | None = None
    limits: dict[str, Positive] | None = None
    floors: dict[str, Positive] | None = None
    goal: Literal["walked", "stood", "sat"] = "walked"


class Stage(Section, frozen=True):
    """A part of a search; the next one starts at the best gait that it found.

    Attributes:
        generations: Of this stage; default: those of [tune].
        conditions: Names of the conditions that count; default: all.
        hold: Gains and the values that they keep in it, e.g. `hold = { theta_b = 80.0 }`.
        add: Gains that a gait may lack and that one without them has from here on, e.g. `add.theta_k`.
        keys: Scenario keys that vary in it besides those of [tune].
        set: Part of a scenario that all of its conditions have.
        spread: First standard deviation; default: that of [tune].
        weights: Instead of those of [tune].
        limits: Likewise.
        floors: Likewise.
        checks: Instead of those of [tune].
        enough: Likewise.
    """

    generations: Count | None = None
    conditions: tuple[str, ...] | None = None
    hold: dict[str, Real] = field(default_factory=dict)
    add: LackedGains = LackedGains()
    keys: dict[str, Range] = field(default_factory=dict)
    set: dict[str, Any] = field(default_factory=dict)
    spread: Positive | None = None
    weights: Weights | None = None
    limits: dict[str, Positive] | None = None
    floors: dict[str, Positive] | None = None
    checks: Count | None = None
    enough: Share | None = None


class Beginning(Section, frozen=True):
    """One of several places where a search may begin.

    Attributes:
        controller: The gait, with the settings that it comes with; instead of the scenario's own.
        posture: That runs start from; default: what the scenario or the gait says.
    """

    controller: Name
    posture: Name | None = None


class Tune(Section, frozen=True):
    """A search for gains, `biped tune`; it starts at the scenario's own gait.

    Attributes:
        gains: Names of the gains that vary; default: all. Gains that are zero stay zero.
        change: Number of the change whose gains vary, from 0; default: the gains that the run begins with do.
        factor: By how much a gain may be multiplied or divided.
        angle: Degrees by which an angle may change.
        keys: Other numeric scenario keys that vary, dotted.
        conditions: What the gait is tuned for, by name.
        weights: The objective.
        limits: Metrics and the most that they should be, e.g. `{ torso_lean = 10.0, torque_rate = 2.0 }`.
        floors: Metrics and the least that they should be, e.g. `{ stance_knee = 8.0 }`.
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
        begin: Places where it may begin: the first stage is tried from each, and the search goes on from where a
            re-check was best; default: it begins at the scenario's own gait.
        tries: Generations of each of these.
        postures: Names of postures from which the gait that was found is tried in the end, on fresh seeds; the best is
            its start from then on. Default: that of the search alone.
    """

    gains: tuple[str, ...] | None = None
    change: Annotated[int, Meta(ge=0)] | None = None
    factor: Annotated[float, Meta(gt=1, le=1e6)] = 5.0
    angle: Positive = 20.0
    keys: dict[str, Range] = field(default_factory=dict)
    conditions: dict[str, Condition] = field(default_factory=dict)
    weights: Weights = Weights()
    limits: dict[str, Positive] = field(default_factory=dict)
    floors: dict[str, Positive] = field(default_factory=dict)
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
    begin: tuple[Beginning, ...] = ()
    tries: Count = 8
    postures: tuple[str, ...] = ()
