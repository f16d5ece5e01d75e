"""The home engine: the thesis's own equations. Rigid unilateral contacts, plastic impacts, no slip.

Of a scenario's physics it uses the slope, the pushes and `simulation.timestep`; friction, contact time and the solver
settings belong to MuJoCo's compliant contacts and have no meaning here.
"""

from __future__ import annotations

import numpy as np

from biped.control.controller import law_of
from biped.control.tick import GOING
from biped.engines.common import ending, push_spans
from biped.geometry import LINKS
from biped.model import tree_at
from biped.plan import Run
from biped.rigid.events import advance, touch_down
from biped.rigid.record import rigid_record
from biped.trajectory import FORCE, STOP, WIDTH, Trajectory


def simulate(run: Run) -> Trajectory:
    """Simulates a run to its end, a fall or a number that is not finite.

    Args:
        run: A concrete run.

    Returns:
        What it left behind; forces are means over each tick, impacts included.

    Raises:
        InputError: A push names a body the model lacks, or a user's law misbehaves.
    """
    trajectory, _ = simulate_with_ledger(run)
    return trajectory


def simulate_with_ledger(run: Run) -> tuple[Trajectory, np.ndarray]:
    """As `simulate`, and the engine's record with its ledger of work, impact losses and events."""
    s = run.scenario
    tick = 1.0 / s.simulation.control_rate
    count = round(s.duration * s.simulation.control_rate)
    steps = round(tick / s.simulation.timestep)
    log = np.zeros((count, WIDTH))
    tree = tree_at(run.model)
    q, v = np.array(run.q), np.array(run.v)
    law = law_of(run, tree, q, v, log)
    rigid = rigid_record(run.model, s.ground.slope)
    w = rigid[0]
    generalized = s.actuation.mode == "generalized"
    wanted, applied = (law.Q_d, w["Q"]) if generalized else (law.u, w["Q"][3:])
    impulse = w["impulse"]
    touch_down(rigid, q, v)
    status, done = GOING, 0
    for first, last, forces in push_spans(s, LINKS, count, tick):
        w["push"], w["pushed"] = forces, forces.any()
        for k in range(first, last):
            status = law.tick(k, k * tick)
            done = k + 1
            if status != GOING:
                break
            applied[:] = wanted
            advance(rigid, q, v, tick / steps, steps)
            # Rows come normal first; the log wants (forward, normal). A stop's torque bends the knee: negative.
            log[k, FORCE : FORCE + 8 : 2] = impulse[1:8:2] / tick
            log[k, FORCE + 1 : FORCE + 8 : 2] = impulse[0:8:2] / tick
            log[k, STOP : STOP + 2] = impulse[8:] / -tick
        if status != GOING:
            break
    end, cause = ending(status, log[:done])
    capped = int(w["capped"])
    trajectory = Trajectory(
        log=log[:done],
        tick=tick,
        tree=tree,
        slope=s.ground.slope,
        generalized=generalized,
        pushes=tuple((p.at, p.at + p.duration, *p.force, p.body) for p in s.push),
        end=end,
        cause=cause,
        warnings={"chattering_steps": capped} if capped else {},
    )
    return trajectory, rigid
