"""Where a tick of the home engine goes: its parts repeated by themselves over states of one run."""

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from biped.base.jit import long_kernel
from biped.engines.home import simulate
from biped.engines.rigid.motion import evaluate, evaluate_again, land
from biped.engines.rigid.record import rigid_record
from biped.engines.rigid.respond import respond, solve_motion
from biped.engines.rigid.tree import mass_and_bias, place
from biped.measure.trajectory import Trajectory
from biped.robot.planar.topology import N_CONSTRAINTS, N_POINTS
from biped.robot.run import Run
from biped.studies.bench.parts import Inner
from biped.studies.bench.replay import clock

REPEATS = 9
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


def rigid_parts(run: Run, repeats: int = REPEATS) -> dict[str, float]:
    """µs per control tick of a run in the home engine by part, the least of several repeats.

    Args:
        run: A run with the thesis's law and one step a tick.
        repeats: How many.

    Returns:
        `closed_loop`, of which `law`, `new_forces` (the evaluation that a tick begins with), and `evaluations`, four of
        them; what is left are events, the step's sums, set-up and the log: `rest`. Of one evaluation `places`,
        `masses` (and bias forces), `rows` (M and the constraints factored) and `solutions`.
    """
    trajectory = simulate(run)
    records, law = _states(run, trajectory), Inner(run, trajectory)
    calls: dict[str, Callable[[], Any]] = {
        "closed_loop": lambda: simulate(run),
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
