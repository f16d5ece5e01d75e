"""A scenario's gait as a limit cycle, measured in an engine at the scenario's time step and at half of it."""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from biped.base.errors import InputError, RunError
from biped.ensemble.backend import Jobs
from biped.ensemble.campaign import simulate_planar
from biped.ensemble.executor import mapped
from biped.ensemble.plan import Plan
from biped.robot.robot import seven_links
from biped.scenario.engines import HOME, MUJOCO
from biped.scenario.vary import stream
from biped.studies.run import plan_of, title_of
from biped.studies.stability.basin import Basin, Shrinking, basin_slice, floor, shrinking
from biped.studies.stability.cycle import Fit, Returns, fit_map, pairs
from biped.studies.stability.orbit import Exponent, Orbit, exponent, find_orbit
from biped.studies.stability.section import Kicks, Mapped, PoincareSection, Steady, crossings


class KickedFit(NamedTuple):
    """The linear map fitted to returns of kicked walks.

    Attributes:
        fit: The map.
        kick: Standard deviation of the kicks in every direction, natural units.
        fell: Kicked walks that fell, of `walks`.
        walks: Kicked walks.
    """

    fit: Fit
    kick: float
    fell: int
    walks: int

    @property
    def stable(self) -> bool:
        """Whether the whole interval of the largest multiplier is below one."""
        return self.fit.interval[1] < 1.0

    def as_dict(self) -> dict[str, Any]:
        """Numbers by name."""
        return {
            "kick": self.kick,
            "fell": self.fell,
            "walks": self.walks,
            "radius": self.fit.radius,
            "interval": list(self.fit.interval),
            "explained": self.fit.explained,
            "multipliers": pairs(self.fit.multipliers),
            "stable": self.stable,
        }


class MeasuredGait(NamedTuple):
    """A gait in one place.

    Attributes:
        section: Where strides are cut, in words.
        walks: Steady walks.
        fell: How many of them fell.
        strides: Strides they took.
        period: [s] mean of a stride.
        period_std: [s].
        spread: Root of the summed variances of the section states, natural units.
        kind: What the gait is to small disturbances, in words.
        exponent: Lyapunov exponent; None if the return map cannot be repeated.
        orbit: The nearest periodic orbit; None if none was looked at.
        sizes: What becomes of kicks of every size.
        floor: Size above which kicks have shrunk, 0 if all have; None if none has.
        kicked: The linear map of finite kicks.
        basin: A slice of the basin of attraction, if it was cut.
    """

    section: str
    walks: int
    fell: int
    strides: int
    period: float
    period_std: float
    spread: float
    kind: str
    exponent: Exponent | None
    orbit: Orbit | None
    sizes: list[Shrinking]
    floor: float | None
    kicked: KickedFit
    basin: Basin | None

    def as_dict(self) -> dict[str, Any]:
        """Numbers by name."""
        out = self._asdict() | {
            "exponent": None if self.exponent is None else self.exponent._asdict(),
            "orbit": None if self.orbit is None else _orbit_dict(self.orbit),
            "sizes": [row._asdict() for row in self.sizes],
            "fit": self.kicked.as_dict(),
        }
        del out["kicked"], out["basin"]
        return out if self.basin is None else out | {"basin": self.basin.as_dict()}


class Gait(NamedTuple):
    """A gait in an engine at a time step.

    Attributes:
        engine: The engine.
        timestep: [s].
        measured: What was measured; None if there is no steady gait.
        failed: Why there is none.
    """

    engine: str
    timestep: float
    measured: MeasuredGait | None
    failed: str = ""

    @property
    def place(self) -> str:
        """Where it was measured, in words."""
        return f"{self.engine}, {1e3 * self.timestep:g} ms"

    def as_dict(self) -> dict[str, Any]:
        """Numbers by name, or `failed`."""
        found = {"failed": self.failed} if self.measured is None else self.measured.as_dict()
        return {"engine": self.engine, "timestep": self.timestep, **found}


class Studied(NamedTuple):
    """A scenario's gait in every place.

    Attributes:
        scenario: Its name.
        gaits: One of each place.
    """

    scenario: str
    gaits: list[Gait]

    @property
    def stable(self) -> bool:
        """Whether kicks die out on average in every place."""
        return all(gait.measured is not None and gait.measured.kicked.stable for gait in self.gaits)

    def as_dict(self) -> dict[str, Any]:
        """Plain data, as `--json` prints it."""
        return {"scenario": self.scenario, "gaits": [gait.as_dict() for gait in self.gaits], "stable": self.stable}


def _orbit_dict(orbit: Orbit) -> dict[str, Any]:
    cycle = orbit.cycle
    return {
        "returns": orbit.returns,
        "moved": orbit.moved,
        "residual": None if cycle is None else cycle.residual,
        "multipliers": None if cycle is None else pairs(cycle.multipliers),
        "error": None if cycle is None else cycle.error.tolist(),
    }


SETTLING = 4
"""Strides that a walk is given to forget its start."""

STEADY = ("start.jitter=0.002", "randomise.runs=6", "duration=24.0", "window.start=8.0", "window.end=24.0")
"""The walks that steady states are taken from."""

KICK = 0.01
"""Standard deviation of the kicks of the fit, in every direction that a disturbance can have, natural units."""

KICKED = 100
"""Kicked walks, each followed for three returns."""


def steady_strides(plan: Plan, mapped: Mapped) -> Steady:
    """The strides of a plan's walks after their first few.

    Raises:
        RunError: The scenario does not walk long enough.
    """
    first = plan.run(0)
    section = PoincareSection(first, first.true_tree)

    def walk(index: int) -> tuple[np.ndarray, np.ndarray] | None:
        t = simulate_planar(plan.run(index))
        found = crossings(t, section.height)
        return None if t.end != "completed" else (section.states(found)[SETTLING:], np.diff(found.time)[SETTLING:])

    walks = [one for one in mapped(walk, range(len(plan))) if one is not None]
    fell = len(plan) - len(walks)
    if sum(len(periods) for _, periods in walks) < 5:
        raise RunError(
            f"no steady gait: {fell} of {len(plan)} walks of {plan.scenario.duration:g} s fell, and fewer than five "
            f"strides came after the first {SETTLING} of the others"
        )
    states, periods = (np.concatenate(part) for part in zip(*walks, strict=True))
    return Steady(section, states, periods, fell, len(plan))


def kicked_returns(gait: Steady, rng: np.random.Generator, mapped: Mapped) -> tuple[Returns, int]:
    """Returns of kicked walks, the first from the kicked state itself, and how many of the walks fell.

    Raises:
        RunError: Too few walks return.
    """
    starts = [
        Kicks(gait.section, gait.states[i]).random(KICK, rng) for i in rng.integers(len(gait.states), size=KICKED)
    ]

    def walk(z: np.ndarray) -> tuple[np.ndarray, bool]:
        t, later = gait.section.walk(z, 3.3 * gait.stride)
        return np.vstack([z[None], later]), t.end != "completed"

    walks = mapped(walk, starts)
    fell = sum(ended for _, ended in walks)
    returns = Returns(
        np.vstack([z[:-1] for z, _ in walks]),
        np.vstack([z[1:] for z, _ in walks]),
        np.concatenate([np.full(len(z) - 1, i) for i, (z, _) in enumerate(walks)]),
    )
    if len(returns.walk) < 4 * gait.states.shape[1]:
        raise RunError(f"kicks of {KICK:g} leave {len(returns.walk)} returns, {fell} of {KICKED} walks fell: no fit")
    return returns, fell


def word_for(orbit: Orbit | None, small: Exponent | None) -> str:
    """Words for how the gait answers small disturbances."""
    if small is None:
        return "falls when its return map is repeated"
    if small.value - small.half_width > 0.0:
        return "chaotic"
    if small.value + small.half_width >= 0.0:
        return "undecided"
    if orbit is None or orbit.returns is None:
        return "neighbours approach, no cycle of up to 16 returns"
    return "stable limit cycle" if orbit.returns == 1 else f"stable cycle of {orbit.returns} returns"


def measure(plan: Plan, jobs: Jobs, slices: bool) -> MeasuredGait:
    """Measures a gait in one engine at one step.

    Args:
        plan: Its steady walks.
        jobs: Number of processes, or a cluster.
        slices: Whether to cut the basin of attraction too.

    Raises:
        RunError: There is no steady gait.
    """

    def on_cores(function: Callable, items: Sequence) -> list:
        return mapped(function, items, jobs)

    gait = steady_strides(plan, on_cores)
    rng = stream(plan.scenario.seed, "stability")
    small = exponent(gait, rng, on_cores)
    try:
        orbit = find_orbit(gait.section, gait.states[-1], gait.stride)
    except RunError:
        orbit = None
    rows = shrinking(gait, rng, on_cores)
    returns, fell = kicked_returns(gait, rng, on_cores)
    return MeasuredGait(
        section=f"right heel {1e3 * gait.section.height:g} mm above the ground, coming down",
        walks=gait.walks,
        fell=gait.fell,
        strides=len(gait.periods),
        period=gait.stride,
        period_std=float(gait.periods.std()),
        spread=float(np.sqrt(gait.states.var(axis=0).sum())),
        kind=word_for(orbit, small),
        exponent=small,
        orbit=orbit,
        sizes=rows,
        floor=floor(rows),
        kicked=KickedFit(fit_map(returns, rng), KICK, fell, KICKED),
        basin=basin_slice(gait, rng, on_cores) if slices else None,
    )


def study(
    name: str, changes: Sequence[str], engines: Sequence[str] = (MUJOCO, HOME), jobs: Jobs = 1, slices: bool = False
) -> Studied:
    """Measures a gait in engines, at the scenario's time step and at half of it; the control rate is part of the gait.

    Args:
        name: Name or path of a scenario.
        changes: `--set` changes.
        engines: Names of engines.
        jobs: Number of processes, or a cluster.
        slices: Whether to cut the basin of attraction too, at the scenario's time step.

    Raises:
        InputError: The scenario cannot be used; its ground is not level.
        RunError: It has no steady gait to speak of anywhere.
    """
    run = plan_of(name, changes).run(0)
    scenario = run.scenario
    seven_links(run.robot)  # the section is of their coordinates
    if not run.profile.level:
        raise InputError(
            "ground: expected neither tiles nor steps: strides return to one another on level ground and slopes alone",
            "ground",
        )
    step = scenario.simulation.timestep
    gaits = []
    for engine in engines:
        for factor in (1.0, 0.5):
            timestep = factor * step
            plan = plan_of(name, [*changes, *STEADY, f"engine={engine}", f"simulation.timestep={timestep}"])
            try:
                gaits.append(Gait(engine, timestep, measure(plan, jobs, slices and factor == 1.0)))
            except RunError as error:
                # A gait may walk here and fall there: that is a result, unless there is nothing else to tell.
                gaits.append(Gait(engine, timestep, None, str(error)))
    if all(gait.measured is None for gait in gaits):
        raise RunError("; ".join(f"{gait.place}: {gait.failed}" for gait in gaits))
    return Studied(title_of(name), gaits)
