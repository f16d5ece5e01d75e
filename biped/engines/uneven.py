"""Ground in MuJoCo that is not the same everywhere: planes laid below a robot's parts, friction and softness by place.

What `biped.engines.planar.ground` is to the compiled loop, planes here are to a run that is stepped from Python; the
model is `biped.robot.build`'s. Friction and softness are `biped.robot.unmodelled`'s: seven links have a pair for each
contact point, whose numbers are written before every step; contacts of any other robot are changed one by one, where
they are, between MuJoCo's search for them and its solver.
"""

import copy
from collections.abc import Callable, Sequence
from typing import NamedTuple

import mujoco
import numpy as np

from biped.base.jit import kernel
from biped.robot.build import pairs_with_planes
from biped.robot.ground import Profile
from biped.robot.planar.description import PlanarParts
from biped.robot.unmodelled import Patches, factors_at


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


LEAST_FRICTION = 1e-5
"""MuJoCo's smallest coefficient of friction."""


class PatchedPairs(NamedTuple):
    """Pairs of seven links with the ground; the model's are live.

    Attributes:
        patches: The ground.
        pairs: (4,) numbers of the pairs, by point.
        friction: (npair, 5) coefficients, the model's.
        time: (npair, 2) [s] time constants and damping ratios, likewise.
        usual: Coefficient of friction of uniform ground.
        usual_time: [s] time constant on it.
    """

    patches: Patches
    pairs: np.ndarray
    friction: np.ndarray
    time: np.ndarray
    usual: float
    usual_time: float


def patched_pairs(patches: Patches, model: mujoco.MjModel, robot: PlanarParts) -> PatchedPairs:
    """The pairs of a model that is the run's own."""
    pairs = np.array([model.pair(point).id for point in robot.points])
    first = pairs[0]
    return PatchedPairs(patches, pairs, model.pair_friction, model.pair_solref, float(model.pair_friction[first, 0]),
                        float(model.pair_solref[first, 0]))  # fmt: skip


@kernel
def patch_pairs(patched, place, points):
    """Gives the pairs the friction and the softness of the ground below their points.

    Args:
        patched: (`PatchedPairs`,), or ().
        place: (ngeom, 3) [m] where geoms are now.
        points: (4,) geoms of the points.
    """
    if len(patched) == 0:
        return
    of = patched[0]
    for i in range(points.size):
        at, pair = place[points[i]], of.pairs[i]
        friction, time = factors_at(of.patches, at[0], at[1])
        of.friction[pair, 0] = of.friction[pair, 1] = max(friction * of.usual, LEAST_FRICTION)
        of.time[pair, 0] = max(time * of.usual_time, min(of.usual_time, of.patches.least))


class PatchedContacts:
    """Contacts of a robot of any kind with the ground.

    Args:
        patches: The ground.
        model: What is stepped.
        data: Its state.
        is_ground: (ngeom,) whether a geom is ground.
    """

    def __init__(self, patches: Patches, model: mujoco.MjModel, data: mujoco.MjData, is_ground: np.ndarray):
        self._patches, self._model, self._data, self._is_ground = patches, model, data, is_ground

    def change(self) -> None:
        """Changes the contacts of the first half of a step, whose constraints are made anew."""
        model, data, contact = self._model, self._data, self._data.contact
        friction, reference = contact.friction, contact.solref
        there = np.flatnonzero(self._is_ground[contact.geom].any(axis=1))
        for c, (x, y) in zip(there, contact.pos[there, :2], strict=True):
            of_friction, of_time = factors_at(self._patches, x, y)
            friction[c, :2] = np.maximum(of_friction * friction[c, :2], LEAST_FRICTION)
            if reference[c, 0] > 0.0:
                time = reference[c, 0]
                reference[c, 0] = max(of_time * time, min(time, self._patches.least))
            else:  # stiffness and damping, both negative
                reference[c] /= of_time**2, of_time
        if len(there):
            mujoco.mj_makeConstraint(model, data)
            mujoco.mj_island(model, data)
            mujoco.mj_projectConstraint(model, data)
            mujoco.mj_referenceConstraint(model, data)


def beginning(
    model: mujoco.MjModel, data: mujoco.MjData, split: bool, uneven: Uneven | None, patched: Sequence[PatchedContacts]
) -> Callable[[], None]:
    """Returns a function that brings MuJoCo's data to the state that a step begins with.

    Args:
        model: What is stepped.
        data: Its state.
        split: Whether a law ticks between two halves of a step.
        uneven: Planes that are laid before it; None: the ground is level.
        patched: Contacts that are changed in it.
    """
    first_half = mujoco.mj_step1 if split else mujoco.mj_forward

    def begin() -> None:
        if uneven is not None:
            uneven.lay()
        first_half(model, data)
        for one in patched:
            one.change()

    return begin
