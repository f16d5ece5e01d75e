"""Costs of the closed loop of any robot, as ratios to bare `mj_step` of the same run.

Bare steps replay what a run was commanded and pushed with, on the same compiled model, and so meet the same contacts.
Least times of interleaved repeats, as in `biped.studies.bench.scenes`.
"""

from dataclasses import replace
from functools import partial
from itertools import pairwise
from typing import Any, NamedTuple

import mujoco
import numpy as np

from biped.control.law import Setup
from biped.control.observation import Observation
from biped.engines.mujoco import loop_of, simulate
from biped.engines.native import halves, without_clock
from biped.measure.metrics import assess
from biped.robot.law_factory import Factory
from biped.robot.run import Run
from biped.studies.bench.inner import steps
from biped.studies.bench.parts import clock
from biped.studies.bench.scenes import SceneCost, costs_of, least_cost

REPEATS = 5
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
CONSTANT = "h1, a law that returns a constant"


class Constant:
    """A law that asks for nothing and returns zeros: what the loop itself costs."""

    def __init__(self, setup: Setup):
        self._torques = np.zeros(setup.model.nu)

    def torques(self, sensed: Observation) -> np.ndarray:
        """(nu,) zeros."""
        return self._torques


class Replay(NamedTuple):
    """A run to be stepped once more, without its law.

    Attributes:
        model: Of the run.
        run: It.
        commanded: (n, nu or nv) what the law commanded, tick by tick.
        generalized: Whether that were forces on all coordinates instead of actuators' commands.
        spans: First tick, last tick + 1, and forces (nbody, 6) on bodies, of the pushes.
        substeps: Steps in a tick.
    """

    model: mujoco.MjModel
    run: Run
    commanded: np.ndarray
    generalized: bool
    spans: list[tuple[int, int, np.ndarray]]
    substeps: int

    def data(self) -> mujoco.MjData:
        """The run's start."""
        data = mujoco.MjData(self.model)
        data.qpos[:], data.qvel[:] = self.run.q, self.run.v
        return data

    def taken(self, data: mujoco.MjData) -> np.ndarray:
        """The array from which MuJoCo takes the commands."""
        return data.qfrc_applied if self.generalized else data.ctrl


def replay_of(run: Run) -> Replay:
    """Carries a run out, and keeps what its law commanded."""
    models, commands, pushes = [], [], []

    def watch(model: mujoco.MjModel, data: mujoco.MjData, _: np.ndarray) -> None:
        if not models:
            models.append(model)
        commands.append(np.concatenate([data.ctrl, data.qfrc_applied]))
        pushes.append(data.xfrc_applied.copy())

    trajectory = simulate(run, watch)
    model, generalized = models[0], trajectory.generalized
    commanded = np.array(commands)[:, model.nu :] if generalized else np.array(commands)[:, : model.nu]
    pushed = np.array(pushes)
    cuts = [0, *(np.flatnonzero((np.diff(pushed, axis=0) != 0.0).any(axis=(1, 2))) + 1), len(pushed)]
    spans = [(int(first), int(last), pushed[first]) for first, last in pairwise(cuts)]
    substeps = round(trajectory.tick / run.scenario.simulation.timestep)
    return Replay(model, run, np.ascontiguousarray(commanded), generalized, spans, substeps)


def replayed(replay: Replay, step: bool = True) -> mujoco.MjData:
    """Steps a run from Python without its law; without `step`, only hands over what it commanded."""
    data, mj_step, model, substeps = replay.data(), mujoco.mj_step, replay.model, replay.substeps
    taken, commanded = replay.taken(data), replay.commanded
    for first, last, pushed in replay.spans:
        data.xfrc_applied[:] = pushed
        for k in range(first, last):
            taken[:] = commanded[k]
            if step:
                mj_step(model, data, substeps)
    return data


def _strict(replay: Replay) -> float | None:
    """CPU seconds of the same steps in one compiled loop, MuJoCo's clock off; None where that is not possible."""
    if (native := halves(replay.model)) is None:
        return None
    data = replay.data()
    taken = replay.taken(data)

    def compiled() -> None:
        for first, last, pushed in replay.spans:
            data.xfrc_applied[:] = pushed
            given = replay.commanded[first:last]
            steps(native.step, replay.model._address, data._address, taken, given, replay.substeps)

    with without_clock():
        return clock(compiled)


def general_cost(run: Run, repeats: int = REPEATS) -> SceneCost:
    """Measures the cost of a run of any robot.

    Args:
        run: The run.
        repeats: Of which the least times count.
    """
    replay, trajectory = replay_of(run), simulate(run)
    return least_cost(loop_of(run), trajectory.end, len(trajectory), {
        "steps_and_hand": lambda: clock(lambda: replayed(replay)),
        "hand": lambda: clock(lambda: replayed(replay, False)),
        "steps": lambda: _strict(replay),
        "closed_loop": lambda: clock(lambda: simulate(run)),
        "metrics": lambda: clock(partial(assess, trajectory, run.scenario.interval)),
    }, repeats)  # fmt: skip


def general_costs(repeats: int = REPEATS) -> dict[str, dict[str, Any]]:
    """Costs of each of `ROBOTS`, and of a law that returns a constant, by name."""
    constant = Factory(Constant, f"{__name__}:{Constant.__name__}", __file__)
    return costs_of(ROBOTS, general_cost, repeats) | costs_of(
        {CONSTANT: ROBOTS["h1 stands"]}, lambda run, n: general_cost(replace(run, law=constant), n), repeats
    )
