"""What a file asks for beside a robot on level ground: physics that a run has not, and things to meet."""

from __future__ import annotations

import mujoco
import numpy as np

from biped.robot.gravity import GRAVITY
from biped.robot.legs import above
from biped.robot.soles import pairs_of, touches

_GRAVITY = 0.02
"""[m/s²] by which a file's gravity may differ."""
_NEEDED = ("CONSTRAINT", "CONTACT", "DAMPER", "GRAVITY", "ACTUATION")
"""Parts of the physics that no file may take away."""


def physics_of(model: mujoco.MjModel, faults: list[str]) -> None:
    """Notes what a file asks of the physics that a run does not do."""
    gravity = model.opt.gravity
    if np.abs(gravity - [0.0, 0.0, -GRAVITY]).max() > _GRAVITY:
        faults.append(f"option: gravity {' '.join(f'{one:g}' for one in gravity)}: expected 0 0 {-GRAVITY}; a slope is "
                      "set in the scenario")  # fmt: skip
    off = [name for name in _NEEDED if model.opt.disableflags & getattr(mujoco.mjtDisableBit, f"mjDSBL_{name}")]
    if off:
        faults.append(f"option: flag: {', '.join(name.lower() for name in off)} disabled; expected enabled")
    for body in np.flatnonzero(model.body_gravcomp):
        faults.append(f"body '{model.body(int(body)).name}': gravcomp {model.body_gravcomp[body]:g}: expected 0: only "
                      "its actuators and the ground hold a robot up")  # fmt: skip


def surroundings(model: mujoco.MjModel, base: int, ground: int, faults: list[str]) -> None:
    """Notes what a file has beside robot and ground that the robot could meet: nothing of it is accounted for."""
    pairs = pairs_of(model)
    own = [g for g in range(model.ngeom) if belongs(model, int(model.geom_bodyid[g]), base)]
    others = [b for b in range(1, model.nbody)
              if not belongs(model, b, base) and any(model.body_dofnum[one] for one in above(model, b))]  # fmt: skip
    for body in others:
        faults.append(f"body '{model.body(body).name}': moves, and is no part of what hangs on the base "
                      f"'{model.body(base).name}'; expected the robot alone")  # fmt: skip
    for geom in range(model.ngeom):
        body = int(model.geom_bodyid[geom])
        if geom == ground or belongs(model, body, base) or body in others:
            continue
        if any(touches(model, pairs, one, geom) for one in own):
            name = f"'{model.geom(geom).name}'" if model.geom(geom).name else str(geom)
            faults.append(
                f"geom {name} of '{model.body(body).name}': the robot can touch it, but it is not the ground; expected "
                "one level plane (uneven ground is set in the scenario); of others contype and conaffinity 0"
            )


def belongs(model: mujoco.MjModel, body: int, base: int) -> bool:
    """Whether a body hangs on the base, or is it."""
    return base in above(model, body)
