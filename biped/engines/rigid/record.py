"""All that the compiled rigid-body step reads and remembers, as one numpy record (see `biped.control.record`)."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pinocchio

from biped.robot.description import Robot, robot_at
from biped.robot.model import believed_model, gravity, true_tree
from biped.robot.topology import BASE
from biped.robot.tree import Tree
from biped.scenario.keys import Truth

ROWS = 10
"""Rows of A: normal and tangential of right toe, right heel, left toe, left heel, then the knees' stops."""

RIGID = np.dtype(
    [
        # -- the walker: offsets in the frame of the parent link (joint) or of the link itself
        ("offset", "f8", (7, 2)), ("centre", "f8", (7, 2)), ("mass", "f8", 7), ("inertia", "f8", 7),
        ("armature", "f8", 6), ("damping", "f8", 6), ("foot", "f8", (4, 2)), ("gravity", "f8", 2),
        # -- what acts during a tick: generalized forces (9,), forces at the links' centres of mass
        ("Q", "f8", 9), ("pushed", "u1"), ("push", "f8", (7, 2)),
        # -- which constraints act (points, knees), where points landed, which may not let go before the step's end
        ("active", "u1", 6), ("held", "u1", 6), ("anchor", "f8", 4),
        # -- the state at the start of a step and at its tentative end
        ("q0", "f8", 9), ("v0", "f8", 9), ("q1", "f8", 9), ("v1", "f8", 9),
        # -- the configuration last evaluated; places relative to the torso's centre of mass
        ("angle", "f8", 7), ("rate", "f8", 7), ("joint", "f8", (7, 2)), ("com", "f8", (7, 2)),
        ("point", "f8", (4, 2)),
        ("joint_bias", "f8", (7, 2)), ("com_bias", "f8", (7, 2)), ("point_bias", "f8", (4, 2)),
        ("M", "f8", (9, 9)), ("R", "f8", (9, 9)), ("h", "f8", 9), ("force", "f8", 9),
        ("A", "f8", (ROWS, 9)), ("b_v", "f8", ROWS), ("row", "i8", ROWS), ("signed", "u1", ROWS),
        ("C", "f8", (ROWS, 9)),
        ("gap", "f8", 6), ("gap_rate", "f8", 6),
        # -- results of an evaluation, and those of the stages of a step (the last is its end, the next one's start)
        ("q_dot", "f8", 9), ("v_dot", "f8", 9), ("lam", "f8", ROWS), ("shift", "f8", 9), ("power", "f8"),
        ("k_q", "f8", (5, 9)), ("k_v", "f8", (5, 9)), ("k_lam", "f8", (5, ROWS)), ("k_power", "f8", 5),
        ("k_shift", "f8", 9), ("k_gap", "f8", 6), ("k_gap_rate", "f8", 6),

               # -- the search for an event: both ends of the bracket, who is beyond it, who has only hopped
        ("b_gap", "f8", (2, 6)), ("b_rate", "f8", (2, 6)), ("b_lam", "f8", (2, 6)), ("beyond", "u1", 6),
        ("resting", "u1", 6),
        # -- the tick's impulses of the constraints [N s, N m s], and the run's ledger [J]
        ("impulse", "f8", ROWS), ("work", "f8"), ("loss", "f8"), ("least_loss", "f8"),
        ("impacts", "i8"), ("releases", "i8"), ("capped", "i8"),
        # -- work space of the factorisations
        ("F", "f8", (ROWS, 9)), ("tau", "f8", ROWS), ("pivot", "i8", ROWS), ("L", "f8", (ROWS, ROWS)),
        ("tau2", "f8", ROWS), ("d", "f8", ROWS), ("z", "f8", ROWS), ("y", "f8", 9), ("f", "f8", 9), ("x", "f8", 9),
        ("r", "f8", 9),
        ("solved", "f8", ROWS), ("multiplier", "f8", ROWS), ("passive", "u1", ROWS), ("chosen", "i8", ROWS),
    ],
    align=True,
)  # fmt: skip


def rigid_record(path: Path, slope: float, truth: Truth | None = None) -> np.ndarray:
    """The record (1,) of the biped that walks on a slope [degrees].

    Args:
        path: The model file; lengths, inertias and damping are Pinocchio's of that file.
        slope: Degrees, uphill positive.
        truth: How the biped that walks differs from the file.
    """
    truth = Truth() if truth is None else truth
    model = believed_model(path, slope)
    out = np.zeros(1, RIGID)
    w = out[0]
    tree = true_tree(pinocchio_tree(model, robot_at(path)), truth)
    w["offset"], w["centre"], w["mass"], w["inertia"] = tree.joint, tree.com, tree.mass, tree.inertia
    w["armature"], w["foot"] = tree.armature, tree.point
    w["damping"] = tree.damping
    w["gravity"] = gravity(slope)
    w["least_loss"] = np.inf
    return out


def pinocchio_tree(model: pinocchio.Model, robot: Robot) -> Tree:
    """Lengths and masses of Pinocchio's model; bodies welded to a link are part of it."""
    joints = [1, *(model.getJointId(name) for name in robot.joints[BASE:])]
    frames = [model.frames[model.getFrameId(point)] for point in robot.points]
    inertias = [model.inertias[joint] for joint in joints]
    planar = [0, 2]
    return Tree(
        joint=np.array([[0.0, 0.0], *(model.jointPlacements[joint].translation[planar] for joint in joints[1:])]),
        com=np.array([inertia.lever[planar] for inertia in inertias]),
        mass=np.array([inertia.mass for inertia in inertias]),
        inertia=np.array([inertia.inertia[1, 1] for inertia in inertias]),
        armature=np.array(model.armature[BASE:]),
        damping=np.array(model.damping[BASE:]),
        point=np.array([frame.placement.translation[planar] for frame in frames]),
    )
