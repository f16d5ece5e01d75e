"""Ground that is not level below a robot of any kind: planes that are laid below its parts before every step.

What `biped.engines.planar.planes` is to the compiled loop, this is to a run that is stepped from Python; the model is
`biped.robot.uneven`'s.
"""

import copy

import mujoco
import numpy as np

from biped.robot.ground import Profile
from biped.robot.uneven import pairs_with_planes


class Uneven:
    """The planes of a run's model.

    Args:
        model: What is stepped; its planes are moved, so it is the run's own.
        data: Its state.
        profile: The line of the ground.

    Attributes:
        planes: Numbers of the planes' geoms.
    """

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData, profile: Profile):
        self._model, self._data, self._profile = model, data, profile
        laid = pairs_with_planes(model)
        self.planes, self._parts = model.pair_geom1[laid], model.pair_geom2[laid]

    def lay(self) -> None:
        """Moves the planes below the parts; what MuJoCo has computed at this state is out of date then."""
        model, data, profile = self._model, self._data, self._profile
        mujoco.mj_kinematics(model, data)
        x = data.geom_xpos[self._parts, 0]
        half = -0.5 * np.arctan(profile.rise(x))  # about y, which turns z towards x
        model.geom_pos[self.planes, 0], model.geom_pos[self.planes, 2] = x, profile.height(x)
        model.geom_quat[self.planes, 0], model.geom_quat[self.planes, 2] = np.cos(half), np.sin(half)


def own(model: mujoco.MjModel) -> mujoco.MjModel:
    """A copy whose planes may be moved."""
    out = copy.copy(model)
    planes = out.geom_type == mujoco.mjtGeom.mjGEOM_PLANE
    out.geom_sameframe[planes] = mujoco.mjtSameFrame.mjSAMEFRAME_NONE  # otherwise their place is the world's
    return out
