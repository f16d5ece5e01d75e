"""An ensemble: what is drawn for each run, and what is made of them."""

from typing import Annotated, Literal

from msgspec import Meta, field

from biped.scenario.normals import Move
from biped.scenario.section import Count, NonNegative, Real, Section


class Distribution(Section, frozen=True):
    """Where a number is drawn from: exactly one of these.

    A key that holds several numbers gets each drawn by itself.

    Attributes:
        normal: Mean and standard deviation.
        uniform: Lower and upper bound.
        choice: Values, each as likely.
        grid: Values that runs take in turn.
    """

    normal: tuple[Real, NonNegative] | None = None
    uniform: tuple[Real, Real] | None = None
    choice: tuple[bool | float | str, ...] | None = None
    grid: tuple[bool | float | str, ...] | None = None


class Randomise(Section, frozen=True):
    """An ensemble.

    Attributes:
        runs: Number of runs (at each point of a sweep), each with its own seed.
        controller_mass_matrix: Relative standard deviation, elementwise, of the controller's M.
        controller_constraints: The same of its A.
        controller_errors: Whether these two are drawn once for a `run`, or anew at every `tick`.
        masses: Share by which the mass of each body may differ from the file's, either way: a factor of it is drawn for
            every run and body, and moments of inertia follow; of a robot of any kind.
        draw: Dotted scenario key, e.g. "ground.friction" or "push.0.at", to its distribution.
        moves: How the normals that runs draw are moved, as `biped find` writes it for a run that fell; default: not at
            all.
    """

    runs: Count = 1
    controller_mass_matrix: Annotated[float, Meta(ge=0, le=1000)] = 0.0
    controller_constraints: Annotated[float, Meta(ge=0, le=1000)] = 0.0
    controller_errors: Literal["run", "tick"] = "run"
    masses: Annotated[float, Meta(ge=0, lt=1)] = 0.0
    draw: dict[str, Distribution] = field(default_factory=dict)
    moves: Annotated[tuple[Move, ...], Meta(max_length=10_000)] | None = None


class FailureKeys(Section, frozen=True):
    """Recording of the last seconds of runs that fell or are doubtful.

    Attributes:
        keep: Most runs kept at each point of a sweep, where a campaign is large (above 10,000 runs), in shards or on a
            cluster; of others all are.
    """

    keep: Annotated[int, Meta(ge=0, le=1_000_000)] = 3


class Threshold(Section, frozen=True):
    """When a sweep's threshold holds.

    Attributes:
        rate: Fraction of the runs that must have walked at every value up to it; or stood or sat, if that is expected.
    """

    rate: Annotated[float, Meta(gt=0, le=1)] = 0.95
