"""The foreign engine: MuJoCo's compliant contacts, one compiled control tick per control period."""

from __future__ import annotations

import mujoco
import numpy as np

from biped.control.controller import law_of
from biped.control.tick import GOING, log_forces
from biped.engines.common import ending, push_spans
from biped.model import compile_foreign, tree_at
from biped.plan import Run
from biped.trajectory import WIDTH, Trajectory


def simulate(run: Run) -> Trajectory:
    """Simulates a run to its end, a fall or a number that is not finite.

    Args:
        run: A concrete run.

    Returns:
        What it left behind.

    Raises:
        InputError: A push names a body the model lacks, or a user's law misbehaves.
    """
    s = run.scenario
    foreign = compile_foreign(run.model, s)
    model, data = foreign.model, mujoco.MjData(foreign.model)
    data.qpos[:], data.qvel[:] = run.q, run.v
    tick = 1.0 / s.simulation.control_rate
    count = round(s.duration * s.simulation.control_rate)
    log = np.zeros((count, WIDTH))
    law = law_of(run, tree_at(run.model), data.qpos, data.qvel, log)
    generalized = s.actuation.mode == "generalized"
    wanted, applied = (law.Q_d, data.qfrc_applied) if generalized else (law.u, data.ctrl)
    substeps = round(tick / s.simulation.timestep)
    place, points = data.geom_xpos, foreign.points
    step, next_tick = mujoco.mj_step, law.tick
    status, done = GOING, 0
    bodies = [model.body(i).name for i in range(1, model.nbody)]
    for first, last, forces in push_spans(s, bodies, count, tick):
        data.xfrc_applied[1:, [0, 2]] = forces
        for k in range(first, last):
            status = next_tick(k, k * tick)
            done = k + 1
            if status != GOING:
                break
            applied[:] = wanted
            step(model, data, substeps)
            log_forces(log, k, data.efc_force, place, points)
        if status != GOING:
            break
    end, cause = ending(status, log[:done])
    warnings = {
        mujoco.mjtWarning(i).name.removeprefix("mjWARN_").lower(): int(w.number)
        for i, w in enumerate(data.warning)
        if w.number
    }
    return Trajectory(
        log=log[:done],
        tick=tick,
        tree=foreign.tree,
        slope=s.ground.slope,
        generalized=generalized,
        pushes=tuple((p.at, p.at + p.duration, *p.force, p.body) for p in s.push),
        end=end,
        cause=cause,
        warnings=warnings,
    )

