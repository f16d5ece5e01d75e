"""A mechanism described by an MJCF file: its tree through Pinocchio, its loops from `<connect>`."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import mujoco
import numpy as np
import pinocchio as pin

from biped.base.errors import InputError
from biped.base.files import nearest
from biped.dynamics.system import ConstrainedSystem

AXES = "xyz"
"""Rows of a connect, in their order."""


class LoadedMechanism(NamedTuple):
    """A system and the start its file describes."""

    system: ConstrainedSystem
    q: np.ndarray  # (n,) joint positions: of the first keyframe, else the reference pose [rad, m]
    v: np.ndarray  # (n,) joint velocities of the first keyframe, else zero
    joints: list[str]  # names, in the order of q


def load(path: str | Path, drop: Mapping[str | int, str] | None = None) -> LoadedMechanism:
    """Read a mechanism of hinges and slides whose loops are closed by `<equality><connect>`.

    Each connect gives the three rows Φ = p₁ − p₂ [m] in world axes; in a planar mechanism one of them is
    redundant, which costs nothing but time and can be dropped. Masses, armature, damping, springs and gravity are
    taken over; contacts, limits and actuators are not. The functions run as ordinary Python.

    Args:
        path: The file.
        drop: Rows to leave out, as axes of each connect by its name or its number in the file: {"loop": "y"}.

    Raises:
        InputError: The file cannot be read, has something that is not supported, or lacks what is to be dropped.
    """
    path = Path(path)
    try:
        mj = mujoco.MjModel.from_xml_path(str(path))
        model = pin.buildModelFromMJCF(str(path))
    except (ValueError, RuntimeError) as error:
        raise InputError(f"{path}: {error}") from error
    _refuse(path, mj, model)
    tree = _Tree(mj, model, _anchors(path, mj, model), _remaining_rows(path, mj, drop or {}))
    q = np.array(mj.key_qpos[0] if mj.nkey else mj.qpos0, dtype=float)
    v = np.array(mj.key_qvel[0] if mj.nkey else np.zeros(mj.nv), dtype=float)
    _compare_mass(path, mj, tree, q)
    system = ConstrainedSystem(
        n=mj.nv,
        m=tree.kept.size,
        mass=tree.mass,
        force=tree.force,
        phi=tree.phi,
        A=tree.A,
        b_v=tree.b_v,
        potential=tree.potential,
        name=path.stem,
        compiled=False,
    )
    return LoadedMechanism(system, q, v, [mj.joint(i).name for i in range(mj.njnt)])


def _refuse(path: Path, mj: Any, model: Any) -> None:
    if mj.nq != mj.nv or model.nq != model.nv or mj.nv == 0:
        raise InputError(f"{path}: only hinge and slide joints are supported (no ball, no free joint)")
    if model.nv != mj.nv:
        raise InputError(f"{path}: Pinocchio sees {model.nv} joints of {mj.nv}; give every body a name")
    if mj.ntendon or (mj.dof_frictionloss > 0).any():
        raise InputError(f"{path}: tendons and dry friction (frictionloss) are not supported")
    for i in range(mj.neq):
        if mj.eq_active0[i] and mj.eq_type[i] != mujoco.mjtEq.mjEQ_CONNECT:
            kind = mujoco.mjtEq(mj.eq_type[i]).name.removeprefix("mjEQ_").lower()
            raise InputError(f"{path}: equality {i} is a {kind}; only connect is supported")


def _remaining_rows(path: Path, mj: Any, drop: Mapping[str | int, str]) -> np.ndarray:
    """Numbers of the rows that stay, of three for every active connect."""
    active = [i for i in range(mj.neq) if mj.eq_active0[i]]
    names = [mj.equality(i).name or str(i) for i in active]
    dropped = set()
    for name, axes in drop.items():
        places = [k for k, i in enumerate(active) if name in (i, mj.equality(i).name)]
        if not places:
            hint = nearest(str(name), names)
            raise InputError(
                f"{path}: no active connect is called {name!r}, only {', '.join(names)}; {hint}".rstrip("; ")
            )
        if not axes or set(axes) - set(AXES):
            raise InputError(f"{path}: of connect {name!r} the rows x, y and z can be dropped, not {axes!r}")
        dropped |= {3 * places[0] + AXES.index(axis) for axis in axes}
    return np.array([row for row in range(3 * len(active)) if row not in dropped], np.int64)


def _anchors(path: Path, mj: Any, model: Any) -> list[tuple[int, int]]:
    """Frames (added to the model) of the two ends of every active connect."""
    anchors = []
    for i in range(mj.neq):
        if not mj.eq_active0[i]:
            continue
        site = mj.eq_objtype[i] == mujoco.mjtObj.mjOBJ_SITE
        ends = []
        for side, number in enumerate((mj.eq_obj1id[i], mj.eq_obj2id[i])):
            body = mj.site_bodyid[number] if site else number
            place = mj.site_pos[number] if site else mj.eq_data[i, 3 * side : 3 * side + 3]
            name = mj.body(body).name
            if body == 0:
                parent, within = 0, pin.SE3.Identity()
            elif model.existBodyName(name):
                frame = model.frames[model.getBodyId(name)]
                parent, within = frame.parentJoint, frame.placement
            else:
                raise InputError(f"{path}: connect {i} needs a name on its body number {body}")
            at = within * pin.SE3(np.eye(3), np.array(place, dtype=float))
            ends.append(model.addFrame(pin.Frame(f"connect {i}.{side}", parent, at, pin.FrameType.OP_FRAME)))
        anchors.append((ends[0], ends[1]))
    return anchors


class _Tree:
    """The functions of the system, all read from one pass of Pinocchio's algorithms a state."""

    def __init__(self, mj: Any, model: Any, anchors: list[tuple[int, int]], kept: np.ndarray) -> None:
        model.gravity.linear = np.array(mj.opt.gravity)
        self.model, self.data, self.anchors, self.kept = model, model.createData(), anchors, kept
        self.damping = np.array(mj.dof_damping)
        self.stiffness, self.rest = np.array(mj.jnt_stiffness), np.array(mj.qpos_spring)
        self.state = b""

    def update(self, q: np.ndarray, v: np.ndarray) -> None:
        state = q.tobytes() + v.tobytes()
        if state != self.state:
            model, data = self.model, self.data
            pin.crba(model, data, q, pin.Convention.WORLD)
            pin.nonLinearEffects(model, data, q, v)
            pin.forwardKinematics(model, data, q, v, np.zeros(model.nv))
            pin.computeJointJacobians(model, data, q)
            pin.updateFramePlacements(model, data)
            self.state = state

    def mass(self, t, q, v, p, M):
        self.update(q, v)
        upper = np.triu(self.data.M)
        M[:] = upper + np.triu(upper, 1).T

    def force(self, t, q, v, p, Q):
        self.update(q, v)
        Q[:] = -self.data.nle - self.damping * v - self.stiffness * (q - self.rest)

    def phi(self, t, q, v, p, phi):
        self.update(q, v)
        places = [self.data.oMf[one].translation - self.data.oMf[two].translation for one, two in self.anchors]
        phi[:] = np.reshape(places, -1)[self.kept]

    def A(self, t, q, v, p, A):
        self.update(q, v)
        frame, jacobian = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED, pin.getFrameJacobian
        rows = [[jacobian(self.model, self.data, end, frame)[:3] for end in ends] for ends in self.anchors]
        A[:] = np.reshape([one - two for one, two in rows], (-1, self.model.nv))[self.kept]

    def b_v(self, t, q, v, p, b_v):
        self.update(q, v)
        frame, drift = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED, pin.getFrameClassicalAcceleration
        rows = [[drift(self.model, self.data, end, frame).linear for end in ends] for ends in self.anchors]
        b_v[:] = np.reshape([two - one for one, two in rows], -1)[self.kept]

    def potential(self, t, q, v, p):
        springs = 0.5 * self.stiffness @ (q - self.rest) ** 2
        return float(pin.computePotentialEnergy(self.model, self.model.createData(), q) + springs)


def _compare_mass(path: Path, mj: Any, tree: _Tree, q: np.ndarray) -> None:
    """Refuse a file that the two libraries read differently."""
    q = q + 0.1 + 0.01 * np.arange(mj.nv)
    data, theirs, ours = mujoco.MjData(mj), np.zeros((mj.nv, mj.nv)), np.zeros((mj.nv, mj.nv))
    data.qpos[:] = q
    mujoco.mj_forward(mj, data)
    mujoco.mj_fullM(mj, data, theirs)
    tree.mass(0.0, q, np.zeros(mj.nv), np.zeros(0), ours)
    if not np.allclose(theirs, ours, rtol=1e-9, atol=1e-12 * np.abs(theirs).max()):
        raise InputError(f"{path}: Pinocchio and MuJoCo read different mass matrices from it")
