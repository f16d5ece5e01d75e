"""A robot of any kind as a tree of rigid bodies, with the numbers of its model file: for dynamics that are no engine's.

MuJoCo has read the file, with what `biped.robot.spec` completes in it: Pinocchio's own reader leaves out the masses of
geoms that do not collide, and knows no keyframes of what it takes for one joint.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import mujoco
import numpy as np

from biped.base.errors import InputError

if TYPE_CHECKING:
    import pinocchio

BODY = np.dtype(
    [
        ("parent", "i8"), ("first", "i8"), ("count", "i8"),  # its first velocity, and how many
        ("free", "i8"),  # where its free joint stands in q; -1: it has none
        ("place", "f8", 3), ("turn", "f8", 9),  # m, in its parent's frame, all joints at zero
        ("mass", "f8"), ("com", "f8", 3), ("inertia", "f8", 6),  # kg; m; kg m² xx, yy, zz, xy, xz, yz about it
        # Of the state: about the robot's centre of mass, along the world's axes.
        ("centre", "f8", 3),  # m
        ("carried", "f8", 10), ("own", "f8", 10),  # inertia with all that hangs on it, and its own; first moment; mass
        ("rise", "f8", 6), ("force", "f8", 6),  # acceleration without any of the coordinates', and what it takes
    ],
    align=True,
)  # fmt: skip
"""A body: what the file says of it, and work space."""

DOF = np.dtype(
    [
        ("axis", "f8", 3), ("anchor", "f8", 3),  # in its body's frame, m
        ("slide", "u1"), ("place", "i8"), ("zero", "f8"),  # where it stands in q, and what it is there at zero
        ("armature", "f8"),  # kg m² of its rotor
        ("row", "i8"),  # where its row of the mass matrix begins
    ],
    align=True,
)  # fmt: skip
"""A velocity; of a free joint only the rotors' inertia and the row mean something."""


class BodyTree(NamedTuple):
    """A tree of rigid bodies, in MuJoCo's order.

    Attributes:
        bodies: (nbody,) of `BODY`, the world first.
        dofs: (nv,) of `DOF`.
        columns: (nM,) columns of the mass matrix's numbers: of a row those that its body hangs on, itself last.
        gravity: (3,) [m/s²].
    """

    bodies: np.ndarray
    dofs: np.ndarray
    columns: np.ndarray
    gravity: np.ndarray


def tree_of(model: mujoco.MjModel) -> BodyTree:
    """The tree of a model file that MuJoCo has read.

    Raises:
        InputError: It has parts that no tree of hinges, slides and one free base has.
    """
    if what := beyond_tree(model):
        raise InputError(f"control.mechanics: expected 'engine': the model has {what}, which only MuJoCo computes with",
                         "control.mechanics")  # fmt: skip
    bodies, dofs = np.zeros(model.nbody, BODY), np.zeros(model.nv, DOF)
    bodies["parent"], bodies["first"], bodies["count"] = model.body_parentid, model.body_dofadr, model.body_dofnum
    bodies["place"], bodies["mass"], bodies["com"] = model.body_pos, model.body_mass, model.body_ipos
    moved = model.body_mocapid >= 0  # by hand; nothing that the robot's motion follows from
    bodies["mass"][(model.body_weldid == 0) | moved[model.body_weldid]] = 0.0
    bodies["free"] = -1
    turn, principal = np.empty(9), np.empty(9)
    for number in range(model.nbody):
        mujoco.mju_quat2Mat(turn, model.body_quat[number])
        mujoco.mju_quat2Mat(principal, model.body_iquat[number])
        bodies["turn"][number], axes = turn, principal.reshape(3, 3)
        full = axes @ np.diag(model.body_inertia[number]) @ axes.T
        bodies["inertia"][number] = full[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
    for joint in range(model.njnt):
        place, first = int(model.jnt_qposadr[joint]), int(model.jnt_dofadr[joint])
        if model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_FREE:
            bodies["free"][model.jnt_bodyid[joint]] = place
            continue
        dof = dofs[first]
        dof["axis"], dof["anchor"] = model.jnt_axis[joint], model.jnt_pos[joint]
        dof["slide"] = model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_SLIDE
        dof["place"], dof["zero"] = place, model.qpos0[place]
    dofs["armature"], dofs["row"] = model.dof_armature, model.M_rowadr
    columns = np.array(model.M_colind, dtype=np.int64)
    return BodyTree(bodies, dofs, columns, np.array(model.opt.gravity))


def beyond_tree(model: mujoco.MjModel) -> str:
    """Returns what a model has that a tree of bodies does not say, and only MuJoCo computes with; "": nothing."""
    kinds = [int(kind) for kind in model.jnt_type]
    moving = model.body_rootid[model.dof_bodyid]
    wrong = (
        ("ball joints", int(mujoco.mjtJoint.mjJNT_BALL) in kinds),
        ("parts that move beside the robot", len(set(moving.tolist())) > 1),
        ("tendons with an inertia", bool(np.any(model.tendon_armature))),
    )
    return next((what for what, there in wrong if there), "")


def pinocchio_model(tree: BodyTree) -> pinocchio.Model:
    """Pinocchio's model of a tree; its coordinates are in the same order, joints counted from their zeros."""
    import pinocchio as pin

    out, bodies, dofs = pin.Model(), tree.bodies, tree.dofs
    out.gravity.linear = tree.gravity
    on = [(0, pin.SE3.Identity())]  # the joint that carries a body, and the body's place in the joint's frame
    for number in range(1, len(bodies)):
        body = bodies[number]
        joint, place = on[body["parent"]]
        place = place * pin.SE3(body["turn"].reshape(3, 3), body["place"])
        if body["free"] >= 0:
            place = pin.SE3.Identity()  # a free body's place is its coordinates alone
            joint = out.addJoint(joint, pin.JointModelFreeFlyer(), place, f"free_{number}")
        for column in range(body["first"], body["first"] + body["count"]) if body["free"] < 0 else ():
            dof = dofs[column]
            kind = pin.JointModelPrismaticUnaligned if dof["slide"] else pin.JointModelRevoluteUnaligned
            at = place * pin.SE3(np.eye(3), dof["anchor"])
            joint, place = (
                out.addJoint(joint, kind(dof["axis"]), at, f"dof_{column}"),
                pin.SE3(np.eye(3), -dof["anchor"]),
            )
        xx, yy, zz, xy, xz, yz = body["inertia"]
        about = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        if joint > 0:
            out.appendBodyToJoint(joint, pin.Inertia(float(body["mass"]), body["com"], about), place)
            out.addFrame(pin.Frame(str(number), joint, 0, place, pin.FrameType.BODY))
        on.append((joint, place))
    out.armature = np.array(dofs["armature"])
    return out
