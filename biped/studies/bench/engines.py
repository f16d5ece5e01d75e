"""Costs of a step in Drake as ratios to MuJoCo's, at the same states of a walk, in one process.

Both steps are called from Python and take the same generalized forces. MuJoCo's is warm-started as in the run.
"""

from __future__ import annotations

from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path
from time import perf_counter
from typing import Any, NamedTuple

import mujoco
import numpy as np

from biped.base.errors import InputError
from biped.engines.drake import NEEDS
from biped.engines.mujoco import simulate
from biped.ensemble.plan import Plan
from biped.robot.run import Run
from biped.scenario.reading import read_scenario

REPEATS = 15
ROBOTS = {"seven links": ("upright/own", False), "in space": ("spatial/own", True)}
"""Scenarios by what walks in them, and whether their engine sums work."""
SECONDS, STRIDE = 2.0, 3
"""[s] of a walk, and ticks between two states."""


class StepCost(NamedTuple):
    """Costs of a step at the states of a walk.

    Attributes:
        states: How many.
        mujoco: µs of `mj_step`.
        update: µs of Drake's own update, its state and forces set.
        step: µs of the engine's step: the update, contact forces and stops read, the work summed.
        memory: [MB] that the process grew by when Drake was imported and the plant built; nan where it is not known.
            Of the first robot alone: the import is part of it.
    """

    states: int
    mujoco: float
    update: float
    step: float
    memory: float

    def as_dict(self) -> dict[str, Any]:
        """Plain data, with the ratios to `mj_step`."""
        return self._asdict() | {"update_ratio": self.update / self.mujoco, "step_ratio": self.step / self.mujoco}


def step_costs(repeats: int = REPEATS, seconds: float = SECONDS) -> dict[str, StepCost]:
    """Measures each of `ROBOTS`; of each state the least time of interleaved repeats, which other work disturbs least.

    Args:
        repeats: Of each state.
        seconds: [s] of each walk.

    Raises:
        InputError: Drake is not installed.
    """
    if find_spec("pydrake") is None:
        raise InputError(NEEDS, "engine")
    changes = [f"duration={seconds}", f"window={{start=0.1, end={seconds}}}"]
    return {kind: step_cost(Plan(read_scenario(name, changes)).run(0), repeats, ledger)
            for kind, (name, ledger) in ROBOTS.items()}  # fmt: skip


def step_cost(run: Run, repeats: int = REPEATS, ledger: bool = True) -> StepCost:
    """Measures the steps of a walk on level ground; see `step_costs`."""
    states: list[tuple[np.ndarray, ...]] = []
    models: list[mujoco.MjModel] = []

    def watch(model: mujoco.MjModel, data: mujoco.MjData, _: np.ndarray) -> None:
        models[:] = [model]
        forces = data.qfrc_actuator + data.qfrc_applied
        states.append((data.qpos.copy(), data.qvel.copy(), forces, data.qacc_warmstart.copy()))

    simulate(run, watch)
    states, model = states[::STRIDE], models[0]
    data, before = mujoco.MjData(model), resident()
    from biped.engines.sap.stepper import Stepper

    stepper = Stepper(model, run.robot, True, run.scenario.model, ledger)
    stepper.step()
    memory = resident() - before
    context, plant, coordinates = stepper.context, stepper.plant, stepper.coordinates

    def foreign(q: np.ndarray, v: np.ndarray, forces: np.ndarray, warm: np.ndarray) -> Callable[[], object]:
        data.qpos[:], data.qvel[:], data.qfrc_applied[:], data.qacc_warmstart[:] = q, v, forces, warm
        return lambda: mujoco.mj_step(model, data)

    def update(q: np.ndarray, v: np.ndarray, forces: np.ndarray, _: np.ndarray) -> Callable[[], object]:
        context.SetDiscreteState(coordinates.state(q, v))
        stepper.act(coordinates.forces(forces))
        return lambda: plant.EvalUniquePeriodicDiscreteUpdate(context)

    def engine(q: np.ndarray, v: np.ndarray, forces: np.ndarray, _: np.ndarray) -> Callable[[], object]:
        stepper.q[:], stepper.v[:], stepper.applied[:] = q, v, forces
        return stepper.step

    least = np.full((3, len(states)), np.inf)
    for _ in range(repeats):
        for row, begin in zip(least, (foreign, update, engine), strict=True):
            for i, state in enumerate(states):
                call = begin(*state)
                start = perf_counter()
                call()
                row[i] = min(row[i], perf_counter() - start)
    mujoco_step, drake_update, drake_step = (1e6 * least.mean(axis=1)).tolist()
    return StepCost(len(states), mujoco_step, drake_update, drake_step, memory)


def resident() -> float:
    """[MB] of memory that the process holds; nan where the system does not say."""
    try:
        pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    except OSError:
        return float("nan")
    import resource

    return pages * resource.getpagesize() / 1e6
