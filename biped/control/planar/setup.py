"""A run's controller record: all that the compiled tick reads and remembers, written before the first tick.

One record of parts instead of thirty arguments: a compiled function pays for every array it is handed, and a run's
controller is one thing that can be copied, saved and compared. A part has one job: `c["gait"]["k"]` are springs,
`c["work"]["L"]` is nobody's but the solver's.

Errors of M and A are drawn anew at every tick where they are asked for (Fig 3.14 does not say how often). The generator
is the combined one of L'Ecuyer (Communications of the ACM 31, 1988): its products fit into 64 bits with a sign, so that
compiled code and plain Python find the same numbers. Normals are Box and Muller's (1958).
"""

import math
from typing import Any

import numpy as np

from biped.base.jit import kernel
from biped.control.blending import Changes, blend, changes_in, fraction, most_in_a_tick, step_type
from biped.control.observer import observer_type, set_observer
from biped.control.pace import PARTS, parts
from biped.control.planar.allocation import EXACT, FOREIGN
from biped.control.planar.prediction import predicts
from biped.control.planar.pushing import pushing_torques
from biped.control.planar.sensing import sense_links
from biped.control.step_back import BACKSTEP, set_backstep
from biped.measure.trajectory import Trajectory
from biped.numerics.factor import BLOCK
from biped.numerics.lanes import LANES
from biped.robot.ground import GROUND, gravity, set_ground
from biped.robot.leg_states import STATES
from biped.robot.planar.kinematics import PLACES, TREE, mass_matrix
from biped.robot.planar.topology import BASE, FOOT, LEGS, N_CONSTRAINTS, N_POINTS, N_ROWS, NQ, NU, SEGMENTS, STOP_ROW
from biped.robot.planar.tree import Tree
from biped.robot.run import Run
from biped.scenario.gains import STRAIGHT, Gains
from biped.scenario.keys import Scenario, Sensors
from biped.scenario.vary import stream

GAIT = np.dtype(
    [
        ("k_d1", "f8"), ("b_d1", "f8"), ("theta_b", "f8"),
        ("k", "f8", (STATES, SEGMENTS)), ("b", "f8", (STATES, SEGMENTS)),  # hip, knee, ankle
        ("theta_l", "f8", STATES), ("theta_k", "f8", STATES), ("theta_a", "f8", STATES),
        ("pace", "f8", PARTS),
    ],
    align=True,
)  # fmt: skip
"""The gait [rad, N m/rad, N m s/rad] by leg state; its pace as in `biped.control.pace`."""

_BELIEF = np.dtype(
    [
        ("gravity", "f8", 2),  # m/s²
        ("tilt", "f8"),  # rad, added to the slope frame's angles to get the angles that Q_d uses
        ("perturbed", "u1"), ("mass_factor", "f8", (NQ, NQ)), ("row_factor", "f8", (N_ROWS, NQ)),
        ("redrawn", "u1"), ("mass_error", "f8"), ("row_error", "f8"), ("generator", "i8", 2),
    ],
    align=True,
)  # fmt: skip
"""The controller's belief beyond the tree: gravity, and the errors of its M and A; if redrawn, anew at every tick."""

_SENSING = np.dtype(
    [
        ("contact_height", "f8"), ("knee_angle", "f8"),  # m, rad: when a point or knee is a candidate for A
        ("hold", "i8", 4),  # ticks before a change is believed: heel on, heel off, toe on, toe off
        ("extended", "f8"), ("ahead", "f8"), ("late_stance", "f8"), ("passing", "f8"),  # rad, of the leg states
    ],
    align=True,
)  # fmt: skip
"""When a point touches, and what the leg states follow from."""

_SWITCHES = np.dtype(
    [("on", "u1"), ("touching", "u1", N_POINTS), ("believed", "u1"), ("under", "f8", N_POINTS)], align=True
)
"""Foot switches, where they and not heights decide what touches (`biped.control.planar.estimator`); where the state is
predicted, the heights [m] that the ground under the points must then have had (`biped.control.planar.prediction`)."""

_ACTUATION = np.dtype(
    [
        ("generalized", "u1"), ("release", "u1"), ("release_force", "f8"), ("single_tangential", "u1"),
        ("tolerance", "f8"), ("limit", "f8", NU), ("bounded", "u1"), ("u_0", "f8", NU), ("use_u_0", "u1"),
    ],
    align=True,
)  # fmt: skip
"""How Q_d becomes torques [N, N m]."""

_MEMORY = np.dtype(
    [
        ("believed", "u1", N_POINTS), ("waiting", "i8", N_POINTS), ("phase", "i8", LEGS), ("back", "u1"),
        ("side", "i8", NU),  # limits that torques were last at, where the bounded problem begins
        ("given_up", "i8"),
    ],
    align=True,
)  # fmt: skip
"""Memory from tick to tick: contacts, ticks that a change has lasted, leg states, whether it is falling back, and the
number of ticks by now whose problem was given up."""

_TICK = np.dtype(
    [
        ("height", "f8", N_POINTS), ("h", "f8", NQ), ("given", "u1"), ("Q_d", "f8", NQ),
        ("active", "u1", N_CONSTRAINTS),
        # given: h is somebody else's, and not computed here
        ("rows", "i8"), ("rank", "i8"),  # of A after the release test, and of C
        ("u", "f8", NU), ("over", "u1"),  # over: a torque limit was exceeded and the bounded solution is wanted
        ("given_up", "u1"),  # a problem was not solved, since the latest tick ended
    ],
    align=True,
)  # fmt: skip
"""Results of this tick."""

_WORK = np.dtype(
    [
        ("M", "f8", (NQ, NQ)), ("R", "f8", (NQ, NQ)), ("a", "f8", NQ), ("A", "f8", (N_ROWS, NQ)),
        ("b_v", "f8", N_ROWS), ("row", "i8", N_ROWS),
        ("C", "f8", (N_ROWS, NQ)), ("tau", "f8", N_ROWS), ("pivot", "i8", N_ROWS), ("L", "f8", (N_ROWS, N_ROWS)),
        ("tau2", "f8", N_ROWS), ("d", "f8", N_ROWS), ("z", "f8", N_ROWS), ("force", "f8", N_ROWS),
        # The reduced problem has factors of its own: the bounded form asks for C's once more.
        ("tau_B", "f8", N_ROWS), ("pivot_B", "i8", N_ROWS),
        ("X", "f8", (NQ, BLOCK)), ("line", "f8", BLOCK), ("B", "f8", (NQ, NU)),
        # The bounded problem min ½ uᵀP u - rᵀu.
        ("P", "f8", (NU, NU)), ("r", "f8", NU), ("lower", "f8", NU), ("root", "f8", (NU, NU)), ("x", "f8", NU),
    ],
    align=True,
)  # fmt: skip
"""Work space of the allocation."""

_ROWS = np.dtype(
    [
        ("A", "f8", (NQ, LANES)), ("C", "f8", (NQ, LANES)), ("E", "f8", (NQ, LANES)),  # columns of rows of A
        ("b_v", "f8", (1, LANES)), ("kept", "f8", (1, LANES)), ("force", "f8", (1, LANES)),
        ("free", "f8", (1, LANES)),  # 1: not yet a pivot
        ("V", "f8", (NQ, LANES)), ("T", "f8", (NQ, NQ)), ("z", "f8", NQ),
        ("spring", "f8", NU), ("L", "f8", (NQ, NQ)), ("S", "f8", (BASE, BASE)),
        ("D", "f8", (BASE, LANES)), ("Y", "f8", (NU, LANES)),
    ],
    align=True,
)  # fmt: skip
"""Work space of the allocation by floating coordinates, a row of A in each lane (`biped.numerics.lanes`)."""

_PUSH = np.dtype(
    [
        ("on", "u1"),
        ("friction", "f8"), ("approach", "f8"), ("braking", "f8"), ("reach", "f8"), ("yielding", "f8"),
        ("regularisation", "f8"),
        ("counted", "i8"),  # forces that torques count on: those of points, and perhaps of stops
        # Fraction of the way that torques go in a tick, their largest change in it [N m], and where they are.
        ("follow", "f8"), ("most", "f8"), ("latest", "f8", NU),
        # The sets of the latest tick, with which the next one begins: forces of the wanted motion and of the torques'
        # problem that may be positive, and torques at a limit (-1, 1).
        ("held", "u1", N_ROWS), ("pressed", "u1", N_ROWS), ("side", "i8", NU),
        ("changes", "i8", 2),  # how often the two sets changed in this tick
        ("speed", "f8", N_POINTS),  # m/s with which points rise
        ("scale", "f8", (1, LANES)),  # m: an angle of a stop as a distance; 1 for points
        ("least", "f8", (1, LANES)), ("away", "f8", (1, LANES)), ("rho", "f8", (1, LANES)),
        ("wanted_force", "f8", (1, LANES)), ("slack", "f8", (1, LANES)),
        ("force", "f8", (1, LANES)), ("price", "f8", (1, LANES)),
        ("H", "f8", (N_ROWS, LANES)), ("f", "f8", (1, LANES)), ("order", "i8", N_ROWS), ("U", "f8", (N_ROWS, LANES)),
    ],
    align=True,
)  # fmt: skip
"""Ground that only pushes (`biped.control.planar.pushing`): settings, what it remembers, and work space."""

CONTROL = np.dtype(
    [
        ("gait", GAIT), ("tree", TREE), ("belief", _BELIEF), ("sensing", _SENSING), ("switches", _SWITCHES),
        ("backstep", BACKSTEP), ("actuation", _ACTUATION), ("memory", _MEMORY), ("at", PLACES),
        ("tick", _TICK),
        ("work", _WORK), ("rows", _ROWS), ("push", _PUSH),
        ("observer", observer_type(BASE, SEGMENTS, N_POINTS)),
        ("ground", GROUND),
    ],
    align=True,
)  # fmt: skip
"""The controller; `tree` and `at` are the lengths and masses it believes in and where it senses itself to be, `ground`
the ground above which it senses heights."""


def new() -> np.ndarray:
    """A zeroed controller record, (1,)."""
    return np.zeros(1, CONTROL)


_M1, _A1, _M2, _A2 = 2147483563, 40014, 2147483399, 40692
GENERATOR_SEEDS = _M2
"""Both states begin between 1 and this, exclusive."""


@kernel
def uniform(generator):
    """A number in (0, 1); advances the generator's two states."""
    generator[0] = generator[0] * _A1 % _M1
    generator[1] = generator[1] * _A2 % _M2
    z = generator[0] - generator[1]
    if z < 1:
        z += _M1 - 1
    return z / _M1


@kernel
def redraw(belief):
    """Draws the factors of M (9, 9), of which the upper triangle counts, and of A (10, 9): 1 + error N(0, 1) each."""
    generator = belief["generator"]
    for i in range(NQ + N_ROWS):
        for j in range(NQ):
            radius = math.sqrt(-2.0 * math.log(uniform(generator)))
            z = radius * math.cos(2.0 * math.pi * uniform(generator))
            if i < NQ:
                belief["mass_factor"][i, j] = 1.0 + belief["mass_error"] * z
            else:
                belief["row_factor"][i - NQ, j] = 1.0 + belief["row_error"] * z


def controller_record(run: Run, believed: Tree) -> np.ndarray:
    """The compiled tick's record for a run.

    Args:
        run: Scenario, gains and draws.
        believed: Lengths and masses the controller believes in.

    Returns:
        Array (1,) of `biped.control.planar.setup.CONTROL`.
    """
    s = run.scenario
    out = new()
    c = out[0]
    set_gains(c["gait"], run.gains)
    for name, value in believed._asdict().items():
        c["tree"][name] = value
    _set_beliefs(c["belief"], run)
    _set_sensing(c["sensing"], s)
    inferred, predicted = s.estimator is not None, predicts(s)
    c["switches"]["on"], c["switches"]["believed"] = inferred and not predicted, inferred and predicted
    set_backstep(c["backstep"], s.backstep)
    _set_actuation(c["actuation"], s, run.torque_limits)
    _set_pushing(c["push"], s, believed)
    if s.actuation.mode == "joint":
        set_observer(c["observer"], s.actuation.observer, 1.0 / s.simulation.control_rate)
    if not (inferred and predicted):  # who infers a posture takes what touches for one level line
        set_ground(c["ground"], run.profile)
    return out


def set_gains(gait: np.void, gains: Gains) -> None:
    """Writes a gait into the gait of a controller record."""
    complete: Any = gains  # `read_gains` has seen to it
    gait["k_d1"], gait["b_d1"], gait["theta_b"] = complete.k_d1, complete.b_d1, np.radians(complete.theta_b)
    gait["k"] = np.transpose([complete.k_d2, complete.k_d3, complete.k_d4])
    gait["b"] = np.transpose([complete.b_d2, complete.b_d3, complete.b_d4])
    gait["theta_k"] = np.radians(complete.theta_k or STRAIGHT)
    gait["theta_l"], gait["theta_a"] = np.radians(complete.theta_l), np.radians(complete.theta_a)
    gait["pace"] = parts(complete.pace)


def _set_beliefs(belief: np.void, run: Run) -> None:
    ground = run.scenario.ground
    belief["gravity"] = gravity(ground.slope)
    belief["tilt"] = np.radians(ground.slope) if ground.angles == "gravity" else 0.0
    random = run.scenario.randomise
    belief["mass_error"], belief["row_error"] = random.controller_mass_matrix, random.controller_constraints
    redrawn = random.controller_errors == "tick" and max(belief["mass_error"], belief["row_error"]) > 0.0
    belief["redrawn"] = redrawn
    if redrawn:
        belief["generator"] = stream(run.seed, "controller_errors").integers(1, GENERATOR_SEEDS, 2)
    belief["perturbed"] = redrawn or run.mass_factor is not None or run.row_factor is not None
    belief["mass_factor"] = 1.0 if run.mass_factor is None else run.mass_factor
    belief["row_factor"] = 1.0 if run.row_factor is None else run.row_factor


def _set_sensing(sensing: np.void, s: Scenario) -> None:
    keys = s.sensing
    sensing["contact_height"], sensing["knee_angle"] = keys.contact_height, keys.knee_angle
    holds = (keys.heel_on, keys.heel_off, keys.toe_on, keys.toe_off)
    sensing["hold"] = [round(hold * s.simulation.control_rate) for hold in holds]
    sensing["extended"], sensing["ahead"] = keys.extended, keys.ahead
    sensing["late_stance"] = np.radians(keys.late_stance)
    sensing["passing"] = np.inf if keys.passing is None else keys.passing


def pushes(s: Scenario) -> bool:
    """Whether joint torques are those for ground that only pushes."""
    return s.actuation.contacts == "pushing" and s.actuation.mode == "joint"


def _set_pushing(push: np.void, s: Scenario, believed: Tree) -> None:
    keys = s.actuation.pushing
    push["on"] = pushes(s)
    push["friction"], push["approach"], push["reach"] = keys.friction, keys.approach, keys.reach
    push["yielding"], push["regularisation"] = keys.yielding, keys.regularisation
    push["braking"] = keys.braking
    push["counted"] = N_ROWS if keys.stops else STOP_ROW
    push["follow"] = fraction(keys.smoothing, 1.0 / s.simulation.control_rate)
    push["most"] = most_in_a_tick(keys.slew, 1.0 / s.simulation.control_rate)
    push["scale"] = 1.0
    push["scale"][0, STOP_ROW:N_ROWS] = [np.hypot(*believed.joint[foot]) for foot in FOOT]


def _set_actuation(actuation: np.void, s: Scenario, limits: tuple[float, ...]) -> None:
    keys = s.actuation
    actuation["generalized"] = keys.mode == "generalized"
    actuation["release"] = keys.contacts == "released"
    actuation["release_force"] = keys.release_force
    actuation["single_tangential"] = keys.single_tangential
    actuation["tolerance"] = keys.rank_tolerance
    actuation["limit"] = limits
    actuation["bounded"] = 0 if keys.limit == "clip" else EXACT if keys.solver == "active_set" else FOREIGN
    actuation["use_u_0"] = keys.null_torque is not None
    actuation["u_0"] = keys.null_torque or 0.0


CHANGE = step_type(GAIT, ("release", "i8"), ("release_force", "f8"))
"""One change; its settings are -1 and nan where they are not changed."""


def changes_of(run: Run, record: np.ndarray) -> Changes:
    """A run's changes of its controller's record (1,)."""
    out = changes_in(record, CHANGE, run.scenario, run.gains, set_gains)
    for c, change in zip(out.steps, run.scenario.change, strict=True):
        contacts, force = change.actuation.contacts, change.actuation.release_force
        c["release"] = -1 if contacts is None else contacts == "released"
        c["release_force"] = math.nan if force is None else force
    return out


@kernel
def bring_up_to_date(record, changes, k):
    """Brings the controller's record (1,) to tick k of its `Changes`; k goes through every tick."""
    blend(changes, k)
    actuation, steps = record[0]["actuation"], changes.steps
    for i in range(steps.size):
        step = steps[i]
        if step["first"] != k:
            continue
        if step["release"] >= 0:
            actuation["release"] = step["release"]
        if not math.isnan(step["release_force"]):
            actuation["release_force"] = step["release_force"]


def believed_forces(run: Run, t: Trajectory) -> np.ndarray | None:
    """The forces c of the second problem (`biped.control.planar.pushing`) that the torques of each tick belong to.

    They follow from a tick's coordinates and Q_d, both logged.

    Args:
        run: The run.
        t: What it left behind.

    Returns:
        (n, 4, 2) [N] on toes and heels, along and normal to the ground; None where the law counts on no forces, or
        measured coordinates that the log does not have.
    """
    s = run.scenario
    counted = s.actuation.contacts == "pushing" and s.actuation.mode == "joint" and s.law is None and run.law is None
    if "Q_d" not in t.columns or not counted or predicts(s) or s.estimator is not None or s.sensors != Sensors():
        return None
    out = np.zeros((len(t), N_POINTS, 2))
    _forces(controller_record(run, run.tree), *(np.array(a) for a in (t.q, t.v, t.Q_d)), out)
    return out


@kernel
def _forces(record, q, v, Q_d, out):
    c = record[0]
    push = c["push"]
    for k in range(len(q)):
        sense_links(c, q[k], v[k])
        for j in range(NQ):
            c["tick"]["Q_d"][j] = Q_d[k, j]
        mass_matrix(c["tree"], c["at"], c["work"]["M"])
        if c["belief"]["redrawn"]:
            redraw(c["belief"])
        pushing_torques(c, c["work"]["M"], q[k], v[k])
        for i in range(N_POINTS):
            ahead, behind = push["force"][0, 2 * i], push["force"][0, 2 * i + 1]
            out[k, i, 0] = push["friction"] * (ahead - behind)
            out[k, i, 1] = ahead + behind
