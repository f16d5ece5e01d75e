"""Cameras of clips: they follow a robot from a chosen side, at a distance from which it fills the frame."""

import math
from typing import NamedTuple

import mujoco
import numpy as np

from biped.base.errors import InputError
from biped.base.files import nearest
from biped.base.text import safe
from biped.measure.trajectory import Trajectory
from biped.show import spatial

SIDES = {
    "three-quarters": (35.0, 10.0),
    "side": (0.0, 6.0),
    "front": (80.0, 8.0),
    "back": (-80.0, 8.0),
    "left": (180.0, 6.0),
}
"""Azimuth and elevation [degrees] by name: azimuth 0 is the robot's right, 90 is ahead of it."""
_FILLED = 0.64
"""Share of the frame's height that a robot that stands fills."""
_BROAD = 1.05
"""[robot heights] that a frame is wide at least: a stride, and the arrow of a push."""
_CALM = 0.6
"""[s] over which the camera's way is the mean of the robot's."""


class Camera(NamedTuple):
    """Where a clip is seen from.

    Attributes:
        azimuth: [degrees] from the robot's right (0) by what is ahead of it (90).
        elevation: [degrees] above the ground.
    """

    azimuth: float
    elevation: float

    @property
    def direction(self) -> np.ndarray:
        """(3,) unit vector from the robot to the camera."""
        a, e = math.radians(self.azimuth), math.radians(self.elevation)
        return np.array([math.sin(a) * math.cos(e), -math.cos(a) * math.cos(e), math.sin(e)])


def camera_of(words: str) -> Camera:
    """The camera that `--eye` names: one of `SIDES`, or azimuth and elevation with a comma between them.

    Raises:
        InputError: It names none.
    """
    if words in SIDES:
        return Camera(*SIDES[words])
    try:
        azimuth, elevation = (float(word) for word in words.split(","))
    except ValueError:
        azimuth = elevation = math.nan
    if not (-360.0 <= azimuth <= 360.0 and -5.0 <= elevation <= 85.0):
        hint = nearest(words, list(SIDES))
        raise InputError(
            f"--eye {safe(words)}: expected {', '.join(SIDES)}, or azimuth and elevation in degrees such as 35,10 "
            f"(elevation -5 … 85); {hint}"
        )
    return Camera(azimuth, elevation)


def height_of(model: mujoco.MjModel, data: mujoco.MjData) -> float:
    """The height [m] of a robot's highest part above its lowest one, from the balls around its geoms."""
    own = model.geom_bodyid > 0
    top = (data.geom_xpos[own, 2] + 0.7 * model.geom_rbound[own]).max()
    return float(top - data.geom_xpos[own, 2].min())


def distance(height: float, field: float, shape: float) -> float:
    """The distance [m] from which a robot fills the frame.

    Args:
        height: [m] of the robot.
        field: [degrees] that the frame's height spans.
        shape: Width of the frame over its height.
    """
    seen = 2.0 * math.tan(math.radians(0.5 * field))
    return max(height / _FILLED, _BROAD * height / shape) / seen


def path_of(run: Trajectory) -> np.ndarray:
    """(n, 2) the way of a camera [m]: the centre of mass along and across, without its sway within a step."""
    rows = max(1, min(round(_CALM / run.tick), len(run) // 2))
    width = 2 * (rows // 2) + 1
    way = run.com[:, [0, 1]] if run.com.shape[1] == 3 else np.stack([run.com[:, 0], 0.0 * run.com[:, 0]], axis=1)
    # Beyond both ends it goes on as it is there, so that the camera neither waits nor jumps.
    before, after = 2.0 * way[0] - way[width // 2 : 0 : -1], 2.0 * way[-1] - way[-2 : -2 - width // 2 : -1]
    whole = np.concatenate([before, way, after])
    kernel = np.full(width, 1.0 / width)
    return np.stack([np.convolve(column, kernel, "valid") for column in whole.T], axis=1)


def aim(scene: mujoco.MjvScene, run: Trajectory, eye: np.ndarray, target: np.ndarray) -> None:
    """Points a scene's cameras from one place to another, level with gravity.

    Args:
        scene: The scene.
        run: The run, whose ground may slope.
        eye: (3,) [m] in the ground's frame.
        target: (3,) [m].
    """
    way = (target - eye) / np.linalg.norm(target - eye)
    upright = spatial.plumb(run) - (spatial.plumb(run) @ way) * way
    for camera in scene.camera:
        camera.pos[:], camera.forward[:], camera.up[:] = eye, way, upright / np.linalg.norm(upright)
