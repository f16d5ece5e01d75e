"""Runs stepped once more without their law, on the same compiled model: the bare `mj_step` that costs are ratios to.

What a run was commanded and pushed with is replayed tick by tick, so that the steps meet the same contacts. Called from
Python, MuJoCo's clock on, they are what anybody pays who writes the loop by hand. The strict comparison is with the
same steps in compiled code, the clock off.
"""

import time
from collections.abc import Callable
from functools import partial
from itertools import pairwise
from typing import Any, NamedTuple

import mujoco
import numpy as np

from biped.base.address import call
from biped.base.jit import long_kernel
from biped.engines.loop import by_kind, push_spans
from biped.engines.mujoco import simulate
from biped.engines.native import halves, without_clock
from biped.engines.planar.plant import turned
from biped.measure.trajectory import Trajectory
from biped.robot.run import Run


def clock(work: Callable[[], Any]) -> float:
    """CPU seconds of a call."""
    start = time.process_time()
    work()
    return time.process_time() - start


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


def replay_of(run: Run, trajectory: Trajectory) -> Replay:
    """A run without its law: seven links logged what they were commanded, others are watched once more."""
    return by_kind(run, partial(_logged, trajectory=trajectory), partial(_watched, trajectory=trajectory))


def _logged(run: Run, trajectory: Trajectory) -> Replay:
    s, model = run.scenario, run.planar_model().model
    commanded = np.ascontiguousarray(trajectory.Q_d if trajectory.generalized else trajectory.u)
    bodies, spans = [model.body(i).name for i in range(1, model.nbody)], []
    for first, last, forces in push_spans(s, bodies, partial(turned, s.ground.slope), len(trajectory), trajectory.tick):
        pushed = np.zeros((model.nbody, 6))
        pushed[1:, [0, 2]] = forces
        spans.append((first, last, pushed))
    return Replay(model, run, commanded, trajectory.generalized, spans, _substeps(run, trajectory))


def _watched(run: Run, trajectory: Trajectory) -> Replay:
    models, commands, pushes = [], [], []

    def watch(model: mujoco.MjModel, data: mujoco.MjData, _: np.ndarray) -> None:
        if not models:
            models.append(model)
        commands.append(np.concatenate([data.ctrl, data.qfrc_applied]))
        pushes.append(data.xfrc_applied.copy())

    simulate(run, watch)
    model, generalized = models[0], trajectory.generalized
    commanded = np.array(commands)[:, model.nu :] if generalized else np.array(commands)[:, : model.nu]
    pushed = np.array(pushes)
    cuts = [0, *(np.flatnonzero((np.diff(pushed, axis=0) != 0.0).any(axis=(1, 2))) + 1), len(pushed)]
    spans = [(int(first), int(last), pushed[first]) for first, last in pairwise(cuts)]
    return Replay(model, run, np.ascontiguousarray(commanded), generalized, spans, _substeps(run, trajectory))


def _substeps(run: Run, trajectory: Trajectory) -> int:
    return round(trajectory.tick / run.scenario.simulation.timestep)


def replayed(replay: Replay, step: bool = True) -> mujoco.MjData:
    """Steps a run from Python without its law; without `step`, only hands over what it commanded."""
    data, mj_step, model, substeps = replay.data(), mujoco.mj_step, replay.model, replay.substeps
    taken, commanded = replay.taken(data), replay.commanded
    for first, last, pushed in replay.spans:
        data.xfrc_applied[:] = pushed
        if not step:
            for k in range(first, last):
                taken[:] = commanded[k]
        elif substeps == 1:
            for k in range(first, last):
                taken[:] = commanded[k]
                mj_step(model, data)
        else:
            for k in range(first, last):
                taken[:] = commanded[k]
                mj_step(model, data, substeps)
    return data


def bare(replay: Replay) -> float:
    """CPU seconds of bare `mj_step` along a run: the same model, commands and contacts, and nothing else."""
    return clock(lambda: replayed(replay)) - clock(lambda: replayed(replay, False))


def strict(replay: Replay) -> float | None:
    """CPU seconds of the same steps in one compiled loop, MuJoCo's clock off; None where that is not possible."""
    if (native := halves(replay.model)) is None:
        return None
    data = replay.data()
    taken, addresses = replay.taken(data), (native.step, replay.model._address, data._address)

    def compiled() -> None:
        for first, last, pushed in replay.spans:
            data.xfrc_applied[:] = pushed
            steps(*addresses, taken, replay.commanded[first:last], replay.substeps)

    with without_clock():
        return clock(compiled)


@long_kernel
def steps(step, model, data, taken, given, substeps):
    """Bare steps under given forces (n, 6 or 9), each for `substeps`; addresses as in `biped.engines.planar.mujoco`."""
    for k in range(given.shape[0]):
        for j in range(taken.size):
            taken[j] = given[k, j]
        for _ in range(substeps):
            call(step, model, data)
