"""A run's controller record: gait, beliefs and settings written into it before the first tick."""

from __future__ import annotations

import math
from typing import Any

import mujoco
import numpy as np

from biped.base.errors import InputError
from biped.control.law import Setup
from biped.control.smoothing import fraction
from biped.control.space import record
from biped.control.space.places import Mechanics
from biped.control.space.topology import BASE, BODIES, FOOT, LEG_POINTS, LEGS, NU, N
from biped.robot.robot import Robot
from biped.scenario.gains import Gains
from biped.scenario.gait import out_of_the_plane
from biped.scenario.keys import Scenario


def controller_record(setup: Setup) -> np.ndarray:
    """The compiled tick's record for a run.

    Returns:
        Array (1,) of `biped.control.space.record.CONTROL`.

    Raises:
        InputError: The gait lacks a table, or the robot is of another kind.
    """
    s, model = setup.scenario, setup.model
    out_of_the_plane(setup.gains, s.model)
    check_robot(setup.robot, model, s.model)
    out = record.new()
    c = out[0]
    set_gains(c["gait"], setup.gains)
    _set_beliefs(c["belief"], s, model)
    _set_sensing(c["sensing"], s, setup.tick)
    _set_actuation(c["actuation"], s, setup.torque_limit)
    return out


def check_robot(robot: Robot, model: mujoco.MjModel, name: str) -> None:
    """Makes sure that a robot is what the law is for.

    Raises:
        InputError: It is not.
    """
    kinds, bodies = model.jnt_type[model.dof_jntid], model.jnt_bodyid[model.dof_jntid]
    # Of every coordinate the body that it moves: the torso, then thigh, shank and foot of each leg.
    moved = [1] * BASE + [2 + 3 * leg + link for leg in range(LEGS) for link in (0, 0, 0, 1, 2, 2)]
    right = (
        model.nv == N
        and model.nbody == 1 + BODIES
        and bool((kinds[:BASE] == mujoco.mjtJoint.mjJNT_FREE).all())
        and bool((kinds[BASE:] == mujoco.mjtJoint.mjJNT_HINGE).all())
        and bodies.tolist() == moved
        and [drive.column for drive in robot.drives] == list(range(BASE, N))
        and [len(foot.points) for foot in robot.feet] == [LEG_POINTS] * LEGS
        and [foot.on for foot in robot.feet] == [(1 + body,) * LEG_POINTS for body in FOOT]
    )
    if not right:
        raise InputError(
            "law: 'spatial' is for a torso with a free joint and two legs, right first, with hips that flex, abduct "
            "and rotate, knees, and ankles that flex and invert, all driven, on feet of four points "
            f"(models/human3d.xml); model '{name}' is another", "law",
        )  # fmt: skip


def set_gains(gait: np.void, gains: Gains) -> None:
    """Writes a gait into the gait of a controller record."""
    g: Any = gains  # `read_gains` has seen to it that it is complete
    frontal, axial = g.frontal, g.axial
    gait["k_torso"] = g.k_d1, frontal.k_d1, axial.k_d1
    gait["b_torso"] = g.b_d1, frontal.b_d1, axial.b_d1
    gait["rest_torso"] = math.radians(g.theta_b), 0.0, 0.0
    gait["heading"] = math.radians(axial.theta_b)
    zero = (0.0,) * 4
    gait["k"] = np.transpose([g.k_d2, frontal.k_d2, axial.k_d2, g.k_d3, g.k_d4, frontal.k_d4])
    gait["b"] = np.transpose([g.b_d2, frontal.b_d2, axial.b_d2, g.b_d3, g.b_d4, frontal.b_d4])
    gait["rest"] = np.radians(
        np.transpose([g.theta_l, frontal.theta_l, axial.theta_l, zero, g.theta_a, frontal.theta_a])
    )
    gait["position"], gait["velocity"] = frontal.placement.position, frontal.placement.velocity


def _set_beliefs(belief: np.void, s: Scenario, model: mujoco.MjModel) -> None:
    x, y, z = -model.opt.gravity
    if s.ground.angles == "gravity":
        belief["tilt"] = math.atan2(x, z), math.atan2(y, z)
    belief["hip"] = 0.5 * abs(float(model.body_pos[5, 1] - model.body_pos[2, 1]))
    belief["mass"] = float(model.body_mass.sum())
    belief["shank"] = abs(float(model.body_pos[4, 2]))


def _set_sensing(sensing: np.void, s: Scenario, tick: float) -> None:
    given = s.sensing
    sensing["contact_height"] = given.contact_height
    holds = given.heel_on, given.heel_off, given.toe_on, given.toe_off
    sensing["hold"] = [round(hold / tick) for hold in holds]
    sensing["extended"], sensing["ahead"] = given.extended, given.ahead
    sensing["late_stance"] = math.radians(given.late_stance)
    sensing["passing"] = math.inf if given.passing is None else given.passing


def _set_actuation(actuation: np.void, s: Scenario, limit: np.ndarray) -> None:
    actuation["generalized"] = s.actuation.mode == "generalized"
    actuation["limit"] = limit[:NU]
    for name in ("friction", "approach", "reach", "yielding", "regularisation", "stops"):
        actuation[name] = getattr(s.actuation.pushing, name)
    actuation["follow"] = fraction(s.actuation.pushing.smoothing, 1.0 / s.simulation.control_rate)


def mechanics_of(robot: Robot, data: mujoco.MjData) -> Mechanics:
    """A walker's state and what MuJoCo knows of it after `mj_step1`, live."""
    points = np.array([geom for foot in robot.feet for geom in foot.geoms])
    return Mechanics(
        data.qpos, data.qvel, data.M, data.qfrc_bias, data.cdof, data.cdof_dot, data.cvel, data.subtree_com, data.xmat,
        data.geom_xpos, points,
    )  # fmt: skip
