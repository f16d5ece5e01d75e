"""Costs of the closed loop in scenes of every kind and of any robot, as ratios to bare `mj_step` of the same run.

Least times of many interleaved repeats: what else runs on the machine can only add to a time.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from biped.control.law import Setup
from biped.control.observation import Observation
from biped.control.planar.controller import python_needed
from biped.engines import mujoco
from biped.engines.loop import by_kind
from biped.engines.mujoco import simulate
from biped.engines.native import reason
from biped.ensemble.plan import Plan
from biped.measure.metrics import measure
from biped.robot.run import Factory, Run
from biped.scenario.keys import COMPILED, ENGINE, PINOCCHIO
from biped.scenario.reading import read_scenario
from biped.studies.bench.replay import clock, replay_of, replayed, strict

REPEATS, ROBOTS_REPEATS = 15, 5
SCENES: dict[str, tuple[str, ...]] = {
    "level_normal": ("level_normal",),
    "level_fast": ("level_fast",),
    "robust/own": ("robust/own",),
    "push": ("push_forward",),
    "slope 2°": ("level_normal", "ground.slope=2.0"),
    "sensor noise and delay": (
        "robust/own", "sensors.angle_noise=1e-5", "sensors.rate_noise=1e-4", "sensors.delay=0.001",
    ),
    "actuator lag": ("level_normal", "actuation.lag=0.001"),
    "wrong masses": ("level_normal", "truth.mass=[1.01, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0]"),
    "backstep": ("robust/steep",),
    "changes": ("robust/walk_to_stand",),
    "bounded torques": ("level_normal", "actuation.limit='bounded'"),
    "ground that only pushes": ("calm/own",),
    "Q_d itself": ("level_normal_generalized",),
    "RK4": ("level_normal", "simulation.integrator='RK4'"),
    "physics at 0.5 ms": ("level_normal", "simulation.timestep=0.0005"),
    "pyramidal cones": ("level_normal", "simulation.cone='pyramidal'"),
}  # fmt: skip
"""Scenario and changes."""


ROBOTS: dict[str, tuple[str, ...]] = {
    "walk in space": ("spatial/level",),
    "walk in space, Q_d itself": ("spatial/generalized", "duration=10.0", "window.end=10.0"),
    "human, thesis's law in Python": ("any/walk",),
    "walker2d stands": ("any/walker2d",),
    "humanoid stands": ("any/humanoid",),
    "h1 stands": ("any/h1",),
    "h1 stands, 500 Hz": ("any/h1", "simulation.control_rate=500"),
}
"""Scenario and changes."""
OWN = "any/cells/level"
"""The scenario in which any robot walks by itself."""
MECHANICS: dict[str, tuple[str, ...]] = {
    f"{name}, {by}": (scenario, f"control.mechanics={by}", *changes)
    for name, scenario, whom, *changes in (
        ("human", "level_normal", (COMPILED, PINOCCHIO)),
        ("human, ground that only pushes", "calm/own", (COMPILED, PINOCCHIO)),
        ("human in space", "spatial/level", (COMPILED, ENGINE, PINOCCHIO)),
        ("h1", OWN, (COMPILED, ENGINE, PINOCCHIO), "controller=any/apollo"),
    )
    for by in whom
}
"""Likewise: walks by who computes the law's mechanics."""
CONSTANT = "h1, a law that returns a constant"


class Constant:
    """A law that asks for nothing and returns zeros: what the loop itself costs."""

    def __init__(self, setup: Setup):
        self._torques = np.zeros(setup.model.nu)

    def torques(self, sensed: Observation) -> np.ndarray:
        """(nu,) zeros."""
        return self._torques


class SceneCost(NamedTuple):
    """A scene's price.

    Attributes:
        loop: How its ticks are looped over: compiled, or in Python and why.
        end: How its run ended.
        ticks: Of its run.
        physics: µs a tick of bare `mj_step` called from Python, MuJoCo's clock on.
        steps: µs a tick of the same steps in compiled code, the clock off; physics where that is not possible.
        closed_loop: µs a tick of the whole run, set-up included.
        metrics: µs a tick of its numbers.
        with_metrics: (closed loop + metrics) / physics.
        strict: (closed loop + metrics) / steps.
    """

    loop: str
    end: str
    ticks: int
    physics: float
    steps: float
    closed_loop: float
    metrics: float
    with_metrics: float
    strict: float


def loop_of(run: Run) -> str:
    """How a run's ticks are looped over: compiled, or in Python and, of seven links, why."""
    return by_kind(run, _planar_loop, mujoco.loop_of)


def _planar_loop(run: Run) -> str:
    foreign = run.planar_model()
    why = python_needed(run, run.tree) or reason(foreign.model, foreign.order)
    return f"in Python: {why}" if why else "compiled"


def scene_cost(run: Run, repeats: int = REPEATS) -> SceneCost:
    """Measures the cost of a run in MuJoCo.

    Args:
        run: The run.
        repeats: Of which the least times count.
    """
    trajectory = simulate(run)
    again = replay_of(run, trajectory)
    return least_cost(loop_of(run), trajectory.end, len(trajectory), {
        "steps_and_hand": lambda: clock(lambda: replayed(again)),
        "hand": lambda: clock(lambda: replayed(again, False)),
        "steps": lambda: strict(again),
        "closed_loop": lambda: clock(lambda: simulate(run)),
        "metrics": lambda: clock(partial(measure, trajectory, run.scenario.interval)),
    }, repeats)  # fmt: skip


def least_cost(
    loop: str, end: str, ticks: int, calls: Mapping[str, Callable[[], float | None]], repeats: int
) -> SceneCost:
    """Measures the cost of a run by the least times of its interleaved parts.

    Args:
        loop: How its ticks are looped over.
        end: How it ends.
        ticks: How many it has.
        calls: The parts; each gives its CPU seconds, None where it is not possible: `steps_and_hand`, `hand`, `steps`
            in compiled code, `closed_loop`, `metrics`.
        repeats: Of which the least times count.
    """
    least = dict.fromkeys(calls, float("inf"))
    for repeat in range(repeats + 1):
        for name, call in calls.items():
            took = call()
            if took is not None and repeat > 0:  # the first compiles
                least[name] = min(least[name], took)
    per_tick = 1e6 / ticks
    physics = (least["steps_and_hand"] - least["hand"]) * per_tick
    steps, closed, metrics = (least[name] * per_tick for name in ("steps", "closed_loop", "metrics"))
    steps = min(steps, physics)
    return SceneCost(
        loop, end, ticks, physics, steps, closed, metrics, (closed + metrics) / physics, (closed + metrics) / steps
    )


def scene_costs(repeats: int = REPEATS) -> dict[str, dict[str, Any]]:
    """Costs of each of `SCENES`, by name."""
    return costs_of(SCENES, scene_cost, repeats)


def robot_costs(repeats: int = ROBOTS_REPEATS) -> dict[str, dict[str, Any]]:
    """Costs of each of `ROBOTS`, and of a law that returns a constant, by name."""
    constant = Factory(Constant, f"{__name__}:{Constant.__name__}", __file__)
    return costs_of(ROBOTS, scene_cost, repeats) | costs_of(
        {CONSTANT: ROBOTS["h1 stands"]}, lambda run, n: scene_cost(replace(run, law=constant), n), repeats
    )


def mechanics_costs(changes: Sequence[str] = (), repeats: int = ROBOTS_REPEATS) -> dict[str, dict[str, Any]]:
    """Costs of each of `MECHANICS`, by name; or of `OWN` with changes, by who computes the mechanics."""
    own = {by: (OWN, f"control.mechanics={by}", *changes) for by in (COMPILED, ENGINE, PINOCCHIO)}
    return costs_of(own if changes else MECHANICS, scene_cost, repeats)


def costs_of(
    scenes: Mapping[str, tuple[str, ...]], cost: Callable[[Run, int], SceneCost], repeats: int
) -> dict[str, dict[str, Any]]:
    """Costs of scenes, each a scenario with changes, by a measure of one run."""
    out = {}
    for name, (scenario, *changes) in scenes.items():
        run = Plan(read_scenario(scenario, list(changes))).run(0)
        out[name] = cost(run, repeats)._asdict()
    return out
