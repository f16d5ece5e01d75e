"""The home engine: the thesis's own equations. Rigid unilateral contacts, plastic impacts, friction without limit.

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
from biped.engines.rigid.events import advance, log_impulses, log_work, touch_down, walk_rigid
from biped.measure.trajectory import Trajectory
from biped.numerics.lanes import FEW, LANES
from biped.robot.ground import GROUND, LEVEL, Profile, gravity, set_ground
from biped.robot.planar.kinematics import PLACES, TREE
from biped.robot.planar.topology import BASE, N_CONSTRAINTS, N_LINKS, N_POINTS, N_ROWS, NQ, NU
from biped.robot.planar.tree import Tree
from biped.robot.run import Run

STAGES = 5
"""Evaluations of a Runge-Kutta step: four stages, and its end, which is the next one's start."""

_ACTING = np.dtype([("Q", "f8", NQ), ("pushed", "u1"), ("push", "f8", (N_LINKS, 2))], align=True)
"""Loads during a tick: generalized forces, and forces at the links' centres of mass [N]."""

_CONTACT = np.dtype(
    [
        ("active", "u1", N_CONSTRAINTS), ("held", "u1", N_CONSTRAINTS), ("slides", "u1", N_POINTS),
        ("anchor", "f8", N_POINTS), ("landed", "f8", N_POINTS), ("cos", "f8", N_POINTS), ("sin", "f8", N_POINTS),
        ("other", "f8", NQ),
    ],
    align=True,
)  # fmt: skip
"""Which constraints act, which may not let go before the step's end, which points slide along the ground, and where [m]
points landed; on ground that is not level also the height there, the direction of the ground below each point, and room
for a row."""

_STATE = np.dtype(
    [("q0", "f8", NQ), ("v0", "f8", NQ), ("q1", "f8", NQ), ("v1", "f8", NQ),
     ("known", "u1")],
    align=True,
)  # fmt: skip
"""The state at the start of a step and at its tentative end; whether the latest evaluation was at the start."""

_SYSTEM = np.dtype(
    [
        ("M", "f8", (NQ, NQ)), ("R", "f8", (NQ, NQ)), ("h", "f8", NQ), ("force", "f8", NQ),
        ("A", "f8", (N_ROWS, NQ)), ("C", "f8", (N_ROWS, NQ)), ("b_v", "f8", N_ROWS),
        ("row", "i8", N_ROWS), ("signed", "u1", N_ROWS),
        ("gap", "f8", N_CONSTRAINTS), ("gap_rate", "f8", N_CONSTRAINTS),
    ],
    align=True,
)  # fmt: skip
"""The equations of motion at the configuration last evaluated: M = RᵀR, forces, A with what its rows are, gaps."""

_MOTION = np.dtype(
    [("q_dot", "f8", NQ), ("v_dot", "f8", NQ), ("lam", "f8", N_ROWS), ("shift", "f8", NQ), ("power", "f8")], align=True
)
"""Result of one evaluation; multipliers by row [N, N m]."""

_STAGES = np.dtype(
    [
        ("q_dot", "f8", (STAGES, NQ)), ("v_dot", "f8", (STAGES, NQ)), ("lam", "f8", (STAGES, N_ROWS)),
        ("power", "f8", STAGES),
        ("shift", "f8", NQ), ("gap", "f8", N_CONSTRAINTS), ("gap_rate", "f8", N_CONSTRAINTS),  # at the step's start
    ],
    align=True,
)  # fmt: skip
"""Results of the evaluations of a step."""

_BRACKET = np.dtype(
    [
        ("gap", "f8", (2, N_CONSTRAINTS)), ("gap_rate", "f8", (2, N_CONSTRAINTS)), ("lam", "f8", (2, N_CONSTRAINTS)),
        ("beyond", "u1", N_CONSTRAINTS), ("resting", "u1", N_CONSTRAINTS),
    ],
    align=True,
)  # fmt: skip
"""The search for an event: both ends of the bracket, who is beyond it, who has only hopped."""

_LEDGER = np.dtype(
    [
        ("impulse", "f8", N_ROWS), ("work", "f8"), ("loss", "f8"), ("least_loss", "f8"),
        ("impacts", "i8"), ("releases", "i8"), ("capped", "i8"),
    ],
    align=True,
)  # fmt: skip
"""The tick's impulses of the constraints [N s, N m s], and the run's work and losses [J] and events."""

_WORK = np.dtype(
    [
        ("F", "f8", (N_ROWS, NQ)), ("tau", "f8", N_ROWS), ("pivot", "i8", N_ROWS), ("L", "f8", (N_ROWS, N_ROWS)),
        ("tau2", "f8", N_ROWS), ("d", "f8", N_ROWS), ("z", "f8", N_ROWS), ("y", "f8", NQ), ("f", "f8", NQ),
        ("x", "f8", NQ), ("r", "f8", NQ),
        ("solved", "f8", N_ROWS), ("multiplier", "f8", N_ROWS), ("passive", "u1", N_ROWS), ("chosen", "i8", N_ROWS),
    ],
    align=True,
)  # fmt: skip
"""Work space of the factorisations."""

_ROWS = np.dtype(
    [
        ("independent", "u1"), ("count", "i8"),  # of the latest evaluation
        ("A", "f8", (NQ, LANES)), ("C", "f8", (NQ, LANES)), ("b_v", "f8", (1, LANES)), ("kept", "f8", (1, LANES)),
        ("spring", "f8", NU), ("L", "f8", (NQ, NQ)),  # M = LᵀL, with nothing added to it
        ("V", "f8", (NQ, NQ)), ("tau", "f8", NQ), ("pivot", "i8", NQ),
        ("speed", "f8", (1, LANES)), ("d", "f8", (LANES, FEW)), ("X", "f8", (NQ, FEW)),
    ],
    align=True,
)  # fmt: skip
"""Rows of A in lanes, factored (`biped.engines.rigid.respond`)."""

RIGID = np.dtype(
    [
        ("tree", TREE), ("gravity", "f8", 2), ("at", PLACES), ("acting", _ACTING), ("contact", _CONTACT),
        ("state", _STATE), ("system", _SYSTEM), ("motion", _MOTION), ("stages", _STAGES), ("bracket", _BRACKET),
        ("ledger", _LEDGER), ("work", _WORK), ("rows", _ROWS), ("ground", GROUND),
    ],
    align=True,
)  # fmt: skip


def rigid_record(tree: Tree, slope: float, ground: Profile = LEVEL) -> np.ndarray:
    """The record (1,) of the biped that walks on a slope [degrees].

    Args:
        tree: Its lengths and masses.
        slope: Degrees, uphill positive.
        ground: Heights along the slope.
    """
    out = np.zeros(1, RIGID)
    w = out[0]
    for name, value in tree._asdict().items():
        w["tree"][name] = value
    w["gravity"] = gravity(slope)
    w["ledger"]["least_loss"] = np.inf
    set_ground(w["ground"], ground)
    return out


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
