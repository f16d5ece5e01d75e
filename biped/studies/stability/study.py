"""A scenario's gait as a limit cycle, measured in an engine at the scenario's time step and at half of it."""

from collections.abc import Callable, Sequence

import numpy as np

from biped.base.errors import InputError, RunError
from biped.ensemble.backend import Jobs
from biped.ensemble.campaign import simulate_planar
from biped.ensemble.executor import mapped
from biped.ensemble.plan import Plan
from biped.scenario.engines import HOME, MUJOCO
from biped.scenario.vary import stream
from biped.studies.planned import plan_of, title_of
from biped.studies.stability.basin import basin, floor, shrinking
from biped.studies.stability.cycle import Returns, fit_map
from biped.studies.stability.gait import Gait, KickedFit, MeasuredGait, Studied
from biped.studies.stability.orbit import Exponent, Orbit, exponent, find_orbit
from biped.studies.stability.section import Kicks, Mapped, PoincareSection, Steady, crossings

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
        basin=basin(gait, rng, on_cores) if slices else None,
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
    if scenario.robot is not None:
        raise InputError(
            "stability: expected a planar biped of seven links, with the thesis's law: its section is of their "
            f"coordinates; model '{scenario.model}' is a robot of any kind here", "model",
        )  # fmt: skip
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
