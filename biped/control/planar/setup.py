"""A run's controller record: gait, beliefs and settings written into it before the first tick."""

import math
from typing import Any

import numpy as np

from biped.base.jit import kernel
from biped.control.blending import Changes, blend, changes_in, step_type
from biped.control.planar import record
from biped.control.planar.bounded import EXACT, FOREIGN
from biped.control.planar.errors import GENERATOR_SEEDS
from biped.control.planar.prediction import predicts
from biped.control.planar.record import GAIT
from biped.control.smoothing import fraction
from biped.robot.gravity import gravity
from biped.robot.ground import set_ground
from biped.robot.planar.topology import FOOT, N_ROWS, STOP_ROW
from biped.robot.planar.tree import Tree
from biped.robot.run import Run
from biped.scenario.gains import Gains
from biped.scenario.keys import Scenario
from biped.scenario.vary import stream


def controller_record(run: Run, believed: Tree) -> np.ndarray:
    """The compiled tick's record for a run.

    Args:
        run: Scenario, gains and draws.
        believed: Lengths and masses the controller believes in.

    Returns:
        Array (1,) of `biped.control.planar.record.CONTROL`.
    """
    s = run.scenario
    out = record.new()
    c = out[0]
    set_gains(c["gait"], run.gains)
    for name, value in believed._asdict().items():
        c["tree"][name] = value
    _set_beliefs(c["belief"], run)
    _set_sensing(c["sensing"], s)
    inferred, predicted = s.estimator is not None, predicts(s)
    c["switches"]["on"], c["switches"]["believed"] = inferred and not predicted, inferred and predicted
    if s.backstep is not None:
        back = c["backstep"]
        back["on"], back["margin"], back["theta_l"] = 1, s.backstep.margin, np.radians(s.backstep.theta_l)
        back["k_d2"], back["b_d2"] = s.backstep.k_d2, s.backstep.b_d2
    _set_actuation(c["actuation"], s, run.torque_limits)
    _set_pushing(c["push"], s, believed)
    if not (inferred and predicted):  # who infers a posture takes what touches for one level line
        set_ground(c["ground"], run.profile)
    return out


def set_gains(gait: np.void, gains: Gains) -> None:
    """Writes a gait into the gait of a controller record."""
    complete: Any = gains  # `read_gains` has seen to it
    gait["k_d1"], gait["b_d1"], gait["theta_b"] = complete.k_d1, complete.b_d1, np.radians(complete.theta_b)
    gait["k"] = np.transpose([complete.k_d2, complete.k_d3, complete.k_d4])
    gait["b"] = np.transpose([complete.b_d2, complete.b_d3, complete.b_d4])
    gait["theta_l"], gait["theta_a"] = np.radians(complete.theta_l), np.radians(complete.theta_a)


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
    push["counted"] = N_ROWS if keys.stops else STOP_ROW
    push["follow"] = fraction(keys.smoothing, 1.0 / s.simulation.control_rate)
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
