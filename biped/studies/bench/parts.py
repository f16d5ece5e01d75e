"""Where a control tick's time goes: each part repeated by itself over the states of one recorded run."""

import statistics
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import msgspec
import mujoco
import numpy as np

from biped.base.jit import long_kernel
from biped.control.planar.floating import floating_torques
from biped.control.planar.sensing import sense_links
from biped.control.planar.setup import controller_record
from biped.control.planar.tick import thesis_tick
from biped.engines.planar.mujoco import simulate
from biped.measure.metrics import measure
from biped.measure.trajectory import Trajectory
from biped.robot.planar.kinematics import mass_matrix
from biped.robot.run import Run
from biped.studies.bench.replay import bare, clock, replay_of, strict

REPEATS = 7


@long_kernel
def _trees(record, q, v, Q_d, torques):
    c = record[0]
    M = c["work"]["M"]
    for k in range(q.shape[0]):
        sense_links(c, q[k], v[k])
        mass_matrix(c["tree"], c["at"], M)
        if torques:
            for j in range(Q_d.shape[1]):
                c["tick"]["Q_d"][j] = Q_d[k, j]
            floating_torques(c, M, q[k])


@long_kernel
def _laws(record, q, v, log):
    for k in range(q.shape[0]):
        thesis_tick(record, q[k], v[k], log, k, 0.0)


class Inner:
    """The parts of a tick over all states of a run.

    Args:
        run: The run.
        trajectory: What it left behind.
    """

    def __init__(self, run: Run, trajectory: Trajectory):
        self._record = controller_record(run, run.tree)
        columns = (trajectory.q, trajectory.v, trajectory.Q_d)
        self._q, self._v, self._Q_d = (np.ascontiguousarray(column) for column in columns)
        self._log = np.array(trajectory.log)

    def tree(self) -> None:
        """Kinematics and mass matrix."""
        _trees(self._record, self._q, self._v, self._Q_d, False)

    def tree_and_torques(self) -> None:
        """These and the joint torques."""
        _trees(self._record, self._q, self._v, self._Q_d, True)

    def law(self) -> None:
        """The whole tick of the controller."""
        _laws(self._record, self._q, self._v, self._log)


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
    inner, again = Inner(run, trajectory), replay_of(run, trajectory)
    one_tick = replace(run, scenario=msgspec.structs.replace(run.scenario, duration=trajectory.tick))
    calls: dict[str, Callable[[], float]] = {
        "physics": lambda: bare(again),
        "steps": lambda: strict(again) or bare(again),
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
