"""How large and heavy a biped may be for the arithmetic of a walk to mean something."""

from __future__ import annotations

import mujoco
import numpy as np

from biped.base.errors import InputError


def check_sizes(model: mujoco.MjModel, name: str) -> None:
    """Checks that a compiled model is of a size at which the arithmetic of a walk means something.

    Args:
        model: The model.
        name: The file, for the error.

    Raises:
        InputError: A link is lighter, heavier or longer than any that could walk, or a posture is none.
    """
    # What is fixed to something heavier may weigh nothing: a frame, as URDFs have many.
    fixed = (model.body_mass[1:] == 0.0) & (
        np.bincount(model.body_weldid, model.body_mass)[model.body_weldid[1:]] > 0.0
    )
    fixed |= model.body_weldid[1:] == 0
    for what, values, least, most, unit in (
        ("mass", np.where(fixed & (model.body_mass[1:] == 0.0), 1.0, model.body_mass[1:]), 1e-6, 1e6, "kg"),
        ("inertia", np.where(fixed, 1.0, model.body_inertia[1:].min(axis=1)), 1e-12, 1e9, "kg m²"),
        ("place", np.abs(model.body_pos[1:]).max(axis=1), 0.0, 1e3, "m"),
        ("centre of mass", np.abs(model.body_ipos[1:]).max(axis=1), 0.0, 1e3, "m"),
    ):
        for i in np.flatnonzero(~((values >= least) & (values <= most)))[:1]:
            raise InputError(
                f"{name}: body '{model.body(int(i) + 1).name}': {what}: expected {least:g} … {most:g} {unit}, got "
                f"{values[i]:g}"
            )
    for i in np.flatnonzero(~(np.abs(model.key_qpos) <= 1e3).all(axis=1))[:1]:
        raise InputError(f"{name}: key '{model.key(int(i)).name}': qpos: expected at most 1000 m or rad")
