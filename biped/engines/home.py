"""The home engine: the thesis's own equations. Rigid unilateral contacts, plastic impacts, no slip.

Of a scenario's physics it uses the slope, tiles and steps, the pushes, the truth about the biped and
`simulation.timestep`; friction, contact time and solver settings belong to MuJoCo's compliant contacts and have no
meaning here.
"""

from dataclasses import replace

import numpy as np

from biped.base.jit import COMPILED, begun
from biped.control.planar.loop import Control
from biped.engines.loop import drive
from biped.engines.planar.plant import Advance, Physics, PlanarPlant
from biped.engines.rigid.events import advance, touch_down
from biped.engines.rigid.record import rigid_record
from biped.engines.rigid.walk import log_impulses, log_work, walk_rigid
from biped.measure.trajectory import Trajectory
from biped.robot.planar.topology import BASE
from biped.robot.run import Run


def simulate(run: Run) -> Trajectory:
    """Simulates a run to its end, a fall or a number that is not finite.

    Args:
        run: A concrete run.

    Returns:
        What it left behind; forces are means over each tick, impacts included.

    Raises:
        InputError: A push names a body the model lacks, or a user's law misbehaves.
    """
    return simulate_with_ledger(run)[0]


def simulate_with_ledger(run: Run) -> tuple[Trajectory, np.ndarray]:
    """As `simulate`, and the record (1,) that the engine kept: its ledger of work, impact losses and events."""
    s = run.scenario
    tick = 1.0 / s.simulation.control_rate
    steps = round(tick / s.simulation.timestep)
    q, v = np.array(run.q), np.array(run.v)
    rigid = rigid_record(run.home_tree, s.ground.slope, run.profile)
    w = rigid[0]
    touch_down(rigid, q, v)
    before = float(w["ledger"]["work"] - w["ledger"]["loss"])
    account = np.zeros(run.ticks if steps > 1 else 0)  # a tick of one step is accounted for by its row

    def push(forces: np.ndarray) -> None:
        w["acting"]["push"], w["acting"]["pushed"] = forces, forces.any()

    def step(k: int, log: np.ndarray) -> None:
        advance(rigid, q, v, tick / steps, steps)
        log_impulses(rigid, log, k, tick)
        log_work(rigid, account, k)

    def walk(control: Control, fall: np.ndarray, log: np.ndarray) -> Advance:
        return begun(walk_rigid, rigid, control, fall, q, v, applied, tick / steps, steps, log, account)

    applied = w["acting"]["Q"] if s.actuation.mode == "generalized" else w["acting"]["Q"][BASE:]

    def warnings() -> dict[str, int]:
        capped = int(w["ledger"]["capped"])
        return {"chattering_steps": capped} if capped else {}

    physics = Physics(run.true_tree, q, v, applied, run.robot.bodies, push, step, walk if COMPILED else None, warnings)
    trajectory = drive(PlanarPlant(run, physics), distrust=False)
    if len(account):
        trajectory = replace(trajectory, account=np.diff(account[: len(trajectory)], prepend=before))
    return trajectory, rigid
