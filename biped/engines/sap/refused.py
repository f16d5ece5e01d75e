"""Parts of a MuJoCo model that Drake has no counterpart of: refused by name, instead of left out without a word."""

from __future__ import annotations

from collections.abc import Iterator

import mujoco
import numpy as np

from biped.base.errors import InputError

_FLAGS = ("CONSTRAINT", "CONTACT", "LIMIT", "FRICTIONLOSS", "SPRING", "DAMPER", "GRAVITY", "FILTERPARENT", "CLAMPCTRL",
          "ACTUATION")  # fmt: skip
"""MuJoCo's flags of parts of the physics that Drake's plant is built with in any case."""
_EDGED = (mujoco.mjtGeom.mjGEOM_HFIELD, mujoco.mjtGeom.mjGEOM_SDF)


def check_model(model: mujoco.MjModel, name: str) -> None:
    """Makes sure that Drake can step a model.

    Args:
        model: Compiled for a run.
        name: What the scenario calls it.

    Raises:
        InputError: It has a part that has no counterpart there.
    """
    for what, why in _reasons(model):
        raise InputError(f"engine: 'drake' cannot simulate model '{name}': it has {what}, {why}; expected engine = "
                         "'mujoco'", "engine")  # fmt: skip


def _reasons(m: mujoco.MjModel) -> Iterator[tuple[str, str]]:
    """Each part that has no counterpart, and why."""
    free, ball = m.jnt_type == mujoco.mjtJoint.mjJNT_FREE, m.jnt_type == mujoco.mjtJoint.mjJNT_BALL
    for j in np.flatnonzero(ball):
        yield f"the ball joint '{m.joint(j).name}'", "and Drake's has three angles, which lock"
    if m.neq:
        yield f"{m.neq} equality constraints", "which MuJoCo makes soft in a way of its own"
    stiff = m.tendon_stiffness if m.tendon_stiffness.ndim == 1 else m.tendon_stiffness[:, 0]
    damped = m.tendon_damping if m.tendon_damping.ndim == 1 else m.tendon_damping[:, 0]
    if m.ntendon and (np.any(stiff) or np.any(damped) or m.tendon_limited.any() or m.tendon_frictionloss.any()):
        yield "tendons that pull", "which Drake has not"
    if m.opt.density or m.opt.viscosity or np.any(m.opt.wind):
        yield "air or water around it", "which Drake has not"
    if np.any(m.body_gravcomp):
        yield "bodies whose weight is compensated", "which Drake has not"
    if np.any(m.dof_dampingpoly) or np.any(m.jnt_stiffnesspoly):
        yield "springs or dampers that are not linear", "which Drake's joints have not"
    for j in np.flatnonzero(free):
        columns = slice(m.jnt_dofadr[j], m.jnt_dofadr[j] + 6)
        spring = m.jnt_stiffness[j] if m.jnt_stiffness.ndim == 1 else m.jnt_stiffness[j, 0]
        damping = m.dof_damping[columns]
        if m.dof_armature[columns].any() or np.any(damping) or spring or m.dof_frictionloss[columns].any():
            yield (f"armature, damping, friction or a spring in the free joint '{m.joint(j).name}'",
                   "which Drake's has not")  # fmt: skip
    if np.any(m.geom_solref[:, 0] <= 0.0) or np.any(m.pair_solref[:, 0] <= 0.0):
        yield "contacts of a stiffness and damping of their own (solref < 0)", "which have no contact time here"
    if off := [name for name in _FLAGS if m.opt.disableflags & getattr(mujoco.mjtDisableBit, f"mjDSBL_{name}")]:
        yield f"disabled parts of the physics ({', '.join(off).lower()})", "which are not taken away here"
    if m.nflex:
        yield "parts that bend", "which are not built here"
    for g in np.flatnonzero(np.isin(m.geom_type, _EDGED)):
        yield f"a height field or signed distance ('{m.geom(g).name}')", "whose contacts Drake has not"
