"""Light that is the same wherever a walker goes."""

from __future__ import annotations

import mujoco


def light_evenly(model: mujoco.MjModel) -> None:
    """Lights a model from the camera and, dimly, by its own lamps as if far away: one at the start is soon left behind.

    Args:
        model: A compiled model, changed in what is for looking only.
    """
    model.vis.headlight.ambient[:], model.vis.headlight.diffuse[:] = 0.45, 0.5
    model.light_type[:] = mujoco.mjtLightType.mjLIGHT_DIRECTIONAL.value
    model.light_diffuse[:] = 0.15
