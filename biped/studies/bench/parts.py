"""Where a control tick's time goes: each part repeated by itself over the states of one recorded run."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from typing import Any

import msgspec
import mujoco
import numpy as np
import pinocchio

from biped.base.jit import bound
from biped.control.law import WORLD
from biped.control.setup import controller_record
from biped.control.tick import log_tick, sense, thesis_tick
from biped.engines.forces import log_forces
from biped.engines.mujoco import simulate
from biped.measure.metrics import measure
from biped.measure.trajectory import Trajectory
from biped.robot.description import robot_at
from biped.robot.model import believed_model, compile_foreign, tree_at
from biped.robot.run import Run

REPEATS = 7


def clock(work: Callable[[], Any]) -> float:
    """CPU seconds of a call."""
    start = time.process_time()
    work()
    return time.process_time() - start


def replay(run: Run, trajectory: Trajectory, step: bool = True) -> None:
    """Replays the recorded torques or generalized forces through bare MuJoCo; without `step`, only hands them over."""
    model = compile_foreign(run.model, run.scenario).model
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:] = run.q, run.v
    generalized, mj_step = trajectory.generalized, mujoco.mj_step
    taken = data.qfrc_applied if generalized else data.ctrl
    given = np.ascontiguousarray(trajectory.Q_d if generalized else trajectory.u)
    if step:
        for k in range(len(given)):
            taken[:] = given[k]
            mj_step(model, data)
    else:
        for k in range(len(given)):
            taken[:] = given[k]


def bare(run: Run, trajectory: Trajectory) -> float:
    """CPU seconds of bare `mj_step` along the run: the same model, torques and contacts, and nothing else."""
    return clock(lambda: replay(run, trajectory)) - clock(lambda: replay(run, trajectory, False))


class _Parts:
    """The parts of a tick over the states of a run, each a call without arguments."""

    def __init__(self, run: Run, trajectory: Trajectory):
        self.states = list(zip(np.array(trajectory.q), np.array(trajectory.v), strict=True))
        self.record = controller_record(run, tree_at(run.model))
        self.model = believed_model(run.model, run.scenario.ground.slope)
        self.data = self.model.createData()
        foreign = compile_foreign(run.model, run.scenario)
        order, physics = foreign.order, mujoco.MjData(foreign.model)
        self.where = order.points, robot_at(run.model).contact.radius, order.contacts, order.stops
        physics.qpos[:] = run.q
        mujoco.mj_forward(foreign.model, physics)
        self.log = np.array(trajectory.log)
        self.physics = physics

    def nothing(self) -> None:
        for _k, (_q, _v) in enumerate(self.states):
            pass

    def pinocchio(self) -> None:
        crba, model, data = pinocchio.crba, self.model, self.data
        for q, _ in self.states:
            crba(model, data, q, WORLD)

    def sensing(self) -> None:
        q, v = self.states[0]
        kernel, record, J = bound(sense, self.record, self.data.J, q, v, False), self.record, self.data.J
        for q, v in self.states:
            kernel(record, J, q, v, False)

    def log_row(self) -> None:
        q, v = self.states[0]
        kernel, record, log = bound(log_tick, self.record, q, v, self.log, 0, 0.0), self.record, self.log
        for k, (q, v) in enumerate(self.states):
            kernel(record, q, v, log, k, 0.0)

    def pinocchio_and_law(self) -> None:
        """Together, for every state needs the matrices of its own."""
        crba, model, data, record, log = pinocchio.crba, self.model, self.data, self.record, self.log
        M, J = data.M, data.J
        q, v = self.states[0]
        kernel = bound(thesis_tick, record, M, J, q, v, log, 0, 0.0)
        for k, (q, v) in enumerate(self.states):
            crba(model, data, q, WORLD)
            kernel(record, M, J, q, v, log, k, 0.0)

    def forces(self) -> None:
        physics, where, log, place = self.physics, self.where, self.log, self.physics.geom_xpos
        kernel = bound(log_forces, log, 0, physics.efc_force, place, *where, 0.0)
        for k, _ in enumerate(self.states):
            kernel(log, k, physics.efc_force, place, *where, 0.0)


def tick_parts(run: Run, trajectory: Trajectory) -> dict[str, float]:
    """µs per control tick of a run by part; medians of several repeats, in one process.

    A part that is a compiled call of its own here includes what calling it costs, about 0.2 µs; in a run sensing and
    logging are called from the law, so `law` is what is left of the fused tick without such calls.

    Args:
        run: A run in MuJoCo with the thesis's law.
        trajectory: What it left behind.

    Returns:
        physics, pinocchio, law (sensing and its row of the log included), of which sensing, forces (read and logged),
        set_up (spread over the run), loop (all that is left: Python's loop and handing over) and their sum closed_loop;
        metrics; and the ratios of the closed loop, without and with metrics, to physics.
    """
    parts = _Parts(run, trajectory)
    calls = (parts.nothing, parts.pinocchio, parts.sensing, parts.log_row, parts.pinocchio_and_law, parts.forces)
    found: dict[str, list[float]] = {call.__name__: [] for call in calls}
    found |= {"physics": [], "set_up": [], "closed_loop": [], "metrics": []}
    one_tick = run._replace(scenario=msgspec.structs.replace(run.scenario, duration=trajectory.tick))
    for _ in range(REPEATS):
        for call in calls:
            found[call.__name__].append(clock(call))
        found["physics"].append(bare(run, trajectory))
        found["set_up"].append(clock(lambda: simulate(one_tick)))
        found["closed_loop"].append(clock(lambda: simulate(run)))
        found["metrics"].append(clock(lambda: measure(trajectory, run.scenario.interval)))
    t = {name: statistics.median(values) / len(trajectory) * 1e6 for name, values in found.items()}
    nothing = t.pop("nothing")
    out = {
        "physics": t["physics"],
        "pinocchio": t["pinocchio"] - nothing,
        "law": t["pinocchio_and_law"] - t["pinocchio"],
        "forces": t["forces"] - nothing,
        "set_up": t["set_up"],
    }
    out["loop"] = t["closed_loop"] - sum(out.values())
    out |= {"closed_loop": t["closed_loop"], "metrics": t["metrics"]}
    runs = list(zip(found["closed_loop"], found["metrics"], found["physics"], strict=True))
    # Each repeat is divided by its own bare steps: what slows the machine down for a second slows both.
    out["ratio_loop"] = statistics.median(loop / step for loop, _, step in runs)
    out["ratio_with_metrics"] = statistics.median((loop + metrics) / step for loop, metrics, step in runs)
    return out | {"of the law: sensing": t["sensing"] - nothing, "of the law: log": t["log_row"] - nothing}


def contact_costs(run: Run, trajectory: Trajectory) -> dict[int, float]:
    """µs of one bare `mj_step` by the number of points on the ground, from the run's own states.

    Args:
        run: A run in MuJoCo.
        trajectory: What it left behind.
    """
    model = compile_foreign(run.model, run.scenario).model
    data = mujoco.MjData(model)
    touching = (trajectory.force[..., 1] > 0.0).sum(axis=1)
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
