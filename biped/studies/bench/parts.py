"""Where a control tick's time goes: each part repeated by itself over the states of one recorded run.

Bare steps are called from Python, with MuJoCo's clock on: what anybody pays who writes the loop by hand. The strict
comparison is with the same steps in compiled code, the clock off.
"""

import statistics
import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple

import msgspec
import mujoco
import numpy as np

from biped.engines.loop import push_spans
from biped.engines.native import native as native_of
from biped.engines.native import without_clock
from biped.engines.planar.mujoco import simulate
from biped.engines.planar.plant import turned
from biped.measure.metrics import measure
from biped.measure.trajectory import Trajectory
from biped.robot.run import Run

REPEATS = 7


def clock(work: Callable[[], Any]) -> float:
    """CPU seconds of a call."""
    start = time.process_time()
    work()
    return time.process_time() - start


class _Again(NamedTuple):
    """A run to be stepped once more, without its controller.

    Attributes:
        model: Of the run.
        data: At the run's start.
        taken: What MuJoCo takes forces from.
        given: (n, 6 or 9) those of the run, tick by tick.
        spans: First tick, last tick + 1, forces on bodies; see `push_spans`.
        substeps: Steps in a tick.
    """

    model: mujoco.MjModel
    data: mujoco.MjData
    taken: np.ndarray
    given: np.ndarray
    spans: list[tuple[int, int, np.ndarray]]
    substeps: int

    def push(self, forces: np.ndarray) -> None:
        """Pushes the bodies [N]."""
        self.data.xfrc_applied[1:, [0, 2]] = forces


def _again(run: Run, trajectory: Trajectory) -> _Again:
    s = run.scenario
    model = run.planar_model().model
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:] = run.q, run.v
    taken = data.qfrc_applied if trajectory.generalized else data.ctrl
    given = np.ascontiguousarray(trajectory.Q_d if trajectory.generalized else trajectory.u)
    bodies = [model.body(i).name for i in range(1, model.nbody)]
    spans = push_spans(s, bodies, partial(turned, s.ground.slope), len(trajectory), trajectory.tick)
    return _Again(model, data, taken, given, spans, round(trajectory.tick / s.simulation.timestep))


def replay(run: Run, trajectory: Trajectory, step: bool = True) -> None:
    """Replays the recorded forces and pushes through bare MuJoCo; without `step`, only hands the forces over."""
    again = _again(run, trajectory)
    mj_step, model, data, taken, given, substeps = mujoco.mj_step, *again[:4], again.substeps
    for first, last, forces in again.spans:
        again.push(forces)
        if not step:
            for k in range(first, last):
                taken[:] = given[k]
        elif substeps == 1:
            for k in range(first, last):
                taken[:] = given[k]
                mj_step(model, data)
        else:
            for k in range(first, last):
                taken[:] = given[k]
                mj_step(model, data, substeps)


def bare(run: Run, trajectory: Trajectory) -> float:
    """CPU seconds of bare `mj_step` along the run: the same model, torques and contacts, and nothing else."""
    return clock(lambda: replay(run, trajectory)) - clock(lambda: replay(run, trajectory, False))


def strict(run: Run, trajectory: Trajectory) -> float | None:
    """CPU seconds of the same steps in one compiled loop, MuJoCo's clock off; None where that is not possible."""
    foreign = run.planar_model()
    native = native_of(foreign.model, foreign.order)
    if native is None:
        return None
    from biped.studies.bench.inner import steps

    again = _again(run, trajectory)
    addresses = native.step, again.model._address, again.data._address

    def compiled() -> None:
        for first, last, forces in again.spans:
            again.push(forces)
            steps(*addresses, again.taken, again.given[first:last], again.substeps)

    with without_clock():
        return clock(compiled)


def tick_parts(run: Run, trajectory: Trajectory) -> dict[str, float]:
    """µs per control tick of a run by part; medians of several repeats, in one process.

    Args:
        run: A run in MuJoCo with the thesis's law, one step a tick.
        trajectory: What it left behind.

    Returns:
        `physics`, bare steps called from Python as anybody would; of the closed loop `steps`, the same in compiled code
        and without MuJoCo's clock, `tree` (kinematics and mass matrix), `torques`, `decisions` (sensing, leg states,
        Q_d and the row of the log), `set_up` (spread over the run), `loop` (all that is left: handing over, reading and
        logging forces; Python's loop where it is not compiled), and their sum `closed_loop`; `metrics`; the ratios of
        the closed loop, without and with metrics, to physics, and with metrics to the compiled steps (`strict`).
    """
    from biped.studies.bench.inner import Inner

    inner = Inner(run, trajectory)
    one_tick = replace(run, scenario=msgspec.structs.replace(run.scenario, duration=trajectory.tick))
    calls: dict[str, Callable[[], float]] = {
        "physics": lambda: bare(run, trajectory),
        "steps": lambda: strict(run, trajectory) or bare(run, trajectory),
        "tree": lambda: clock(inner.tree),
        "tree_and_torques": lambda: clock(inner.tree_and_torques),
        "law": lambda: clock(inner.law),
        "set_up": lambda: clock(lambda: simulate(one_tick)),
        "closed_loop": lambda: clock(lambda: simulate(run)),
        "metrics": lambda: clock(lambda: measure(trajectory, run.scenario.interval)),
    }
    for call in calls.values():  # compiles
        call()
    found: dict[str, list[float]] = {name: [] for name in calls}
    for _ in range(REPEATS):
        for name, call in calls.items():
            found[name].append(call())
    return shares(found, len(trajectory))


def shares(found: dict[str, list[float]], ticks: int) -> dict[str, float]:
    """Computes what `tick_parts` returns from times [s] of the whole run by call, repeat by repeat."""
    t = {name: statistics.median(values) / ticks * 1e6 for name, values in found.items()}
    out = {
        "physics": t["physics"],
        "steps": t["steps"],
        "tree": t["tree"],
        "torques": t["tree_and_torques"] - t["tree"],
        "decisions": t["law"] - t["tree_and_torques"],
        "set_up": t["set_up"],
    }
    out["loop"] = t["closed_loop"] - sum(out.values()) + out["physics"]
    out |= {"closed_loop": t["closed_loop"], "metrics": t["metrics"]}
    # Each repeat is divided by its own bare steps: what slows the machine down for a second slows both.
    runs = list(zip(*(found[name] for name in ("closed_loop", "metrics", "physics", "steps")), strict=True))
    out["ratio_loop"] = statistics.median(loop / bare for loop, _, bare, _ in runs)
    out["ratio_with_metrics"] = statistics.median((loop + metrics) / bare for loop, metrics, bare, _ in runs)
    out["ratio_strict"] = statistics.median((loop + metrics) / steps for loop, metrics, _, steps in runs)
    return out


def contact_costs(run: Run, trajectory: Trajectory) -> dict[int, float]:
    """µs of one bare `mj_step` by the number of points on the ground, from the run's own states.

    Args:
        run: A run in MuJoCo.
        trajectory: What it left behind.
    """
    model = run.planar_model().model
    data = mujoco.MjData(model)
    touching = (trajectory.force[..., 2] > 0.0).sum(axis=1)
    out = {}
    for count in np.unique(touching):
        rows = np.flatnonzero(touching == count)[:1000]
        if len(rows) < 30:
            continue
        states = list(zip(trajectory.q[rows], trajectory.v[rows], trajectory.u[rows], strict=True))

        def walk(step: Callable[..., None], states: list[Any] = states) -> None:
            for data.qpos[:], data.qvel[:], data.ctrl[:] in states:
                step(model, data)

        times = [clock(lambda: walk(mujoco.mj_step)) - clock(lambda: walk(lambda *_: None)) for _ in range(REPEATS)]
        out[int(count)] = statistics.median(times) / len(rows) * 1e6
    return out
