"""Where the time of a control tick and of a tick of the home engine goes: parts repeated over the states of one run."""

import statistics
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

import msgspec
import mujoco
import numpy as np

from biped.base.jit import long_kernel
from biped.control.planar.floating import floating_torques
from biped.control.planar.sensing import sense_links
from biped.control.planar.setup import controller_record
from biped.control.planar.tick import thesis_tick
from biped.engines import home
from biped.engines.home import rigid_record
from biped.engines.planar.mujoco import simulate
from biped.engines.rigid.motion import evaluate, evaluate_again, land, mass_and_bias, place
from biped.engines.rigid.respond import respond, solve_motion
from biped.measure.metrics import measure
from biped.measure.trajectory import Trajectory
from biped.robot.planar.kinematics import mass_matrix
from biped.robot.planar.topology import N_CONSTRAINTS, N_POINTS
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


HOME_REPEATS = 9
STRIDE = 17
"""Ticks between two states."""
NEW = 4
"""Evaluations of a step of Runge and Kutta; that of its start is the last one's of the step before, with new forces."""


PARTS = ("touch", "places", "masses", "responses", "solutions", "evaluations", "new_forces")


@long_kernel
def _repeat(records, part):
    """One of `PARTS`, by its number, at every state; one loop, as each would be compiled with all that it calls."""
    for k in range(records.size):
        w = records[k]
        q, v = w["state"]["q0"], w["state"]["v0"]
        if part <= 1:
            place(w, q, v)
        elif part == 2:
            mass_and_bias(w)
        elif part == 3:
            respond(w, q, v)
        elif part == 4:
            solve_motion(w, w["rows"]["count"])
        elif part == 5:
            evaluate(w, q, v)
        else:
            evaluate_again(w, q, v)
        if part == 0:
            for i in range(N_CONSTRAINTS):
                if w["contact"]["active"][i]:
                    land(w, i, q)


def _touch(records: np.ndarray) -> None:
    """Makes what is marked as active touch where it is, and evaluates."""
    for name in ("touch", "evaluations"):
        _repeat(records, PARTS.index(name))


def rigid_parts(run: Run, repeats: int = HOME_REPEATS) -> dict[str, float]:
    """µs per control tick of a run in the home engine by part, the least of several repeats.

    Args:
        run: A run with the thesis's law and one step a tick.
        repeats: How many.

    Returns:
        `closed_loop`, of which `law`, `new_forces` (the evaluation that a tick begins with), and `evaluations`, four of
        them; what is left are events, the step's sums, set-up and the log: `rest`. Of one evaluation `places`,
        `masses` (and bias forces), `rows` (M and the constraints factored) and `solutions`.
    """
    trajectory = home.simulate(run)
    records, law = _states(run, trajectory), Inner(run, trajectory)
    calls: dict[str, Callable[[], Any]] = {
        "closed_loop": lambda: home.simulate(run),
        "law": law.law,
        **{name: partial(_repeat, records, k) for k, name in enumerate(PARTS) if k > 0},
    }
    least = dict.fromkeys(calls, np.inf)
    for repeat in range(repeats + 1):
        for name, call in calls.items():
            _touch(records)
            took = clock(call)
            if repeat > 0:  # the first compiles
                least[name] = min(least[name], took)
    whole = {name: 1e6 * least[name] / len(trajectory) for name in ("closed_loop", "law")}
    one = {name: 1e6 * took / len(records) for name, took in least.items() if name not in whole}
    responses = one.pop("responses")
    evaluations = NEW * one["evaluations"]
    rest = whole["closed_loop"] - whole["law"] - one["new_forces"] - evaluations
    return {
        **whole,
        "new_forces": one["new_forces"],
        "evaluations": evaluations,
        "rest": rest,
        "places": one["places"],
        "masses": one["masses"],
        "rows": responses - one["solutions"],
        "solutions": one["solutions"],
    }


def _states(run: Run, t: Trajectory) -> np.ndarray:
    """Records of states along a run, with the forces and contacts that it had there."""
    at = np.arange(1, len(t), STRIDE)
    records = np.repeat(rigid_record(run.home_tree, run.scenario.ground.slope), len(at))
    records["state"]["q0"], records["state"]["v0"] = t.q[at], t.v[at]
    records["acting"]["Q"] = t.applied[at]
    records["contact"]["active"][:, :N_POINTS] = t.force[at, :, 2] > 0.0
    records["contact"]["active"][:, N_POINTS:] = t.stop[at] != 0.0
    return records
