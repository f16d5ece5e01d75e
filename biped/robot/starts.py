"""Start postures: a keyframe or the human's, disturbed if asked for, set down on the ground, upright on a slope."""

from pathlib import Path

import mujoco
import numpy as np

from biped.robot.borrowing import borrow, borrowed_names
from biped.robot.ground import frame
from biped.robot.parts import base_places, contact_points, height_of, places_of
from biped.robot.recognise import robot_of
from biped.robot.robot import Robot
from biped.robot.spec import no_keyframe, parsed
from biped.robot.upright import stand_upright
from biped.scenario.keys import GIVES_WAY, Scenario
from biped.scenario.laws import THESIS
from biped.scenario.robot import Described
from biped.scenario.world import Ground

_CLEAR = 0.01
"""Of the height of the base above the standing foot: what a foot in the air is above it at least."""


class Starts:
    """Start postures of one robot.

    Args:
        path: Its model file.
        table: Its description.
    """

    def __init__(self, path: Path, table: Described):
        self._path, self.robot = path, robot_of(path, table)
        self.model = parsed(path, table)[1]
        self._data = mujoco.MjData(self.model)

    def start(self, s: Scenario, noise: np.random.Generator | None) -> tuple[np.ndarray, np.ndarray]:
        """Coordinates (nq,) and velocities (nv,) that a run starts with.

        Args:
            s: Its scenario; the posture "" is the robot's own.
            noise: Draws the deviations of its hinges and of its base's orientation; None: there are none.

        Raises:
            InputError: There is no such keyframe, or the robot cannot stand so.
        """
        model, data, robot, start = self.model, self._data, self.robot, s.start
        mujoco.mj_resetData(model, data)
        name = start.posture or robot.start
        if name and name not in robot.starts:
            if s.law != THESIS or name not in borrowed_names():
                valid = (*robot.starts, *(borrowed_names() if s.law == THESIS else ()))
                raise no_keyframe(self._path, name, valid)
            if robot.start:
                mujoco.mj_resetDataKeyframe(model, data, robot.starts.index(robot.start))
            borrow(model, data, robot, name)
        elif name:
            mujoco.mj_resetDataKeyframe(model, data, robot.starts.index(name))
        if start.upright and not start.walking:
            self._stand_upright(s.ground)
        if noise is not None:
            turning = np.array([_turns(model, column) for column in range(model.nv)])
            deviation = np.where(turning, noise.standard_normal(model.nv) * start.jitter, 0.0)
            before = data.qpos.copy()
            mujoco.mj_integratePos(model, data.qpos, deviation, 1.0)
            _keep_within(model, before, data.qpos)
        if start.settle:
            self._set_down()
        return data.qpos.copy(), data.qvel.copy()

    def from_walk(self, s: Scenario, q: np.ndarray, v: np.ndarray, first: int) -> tuple[np.ndarray, np.ndarray]:
        """A state of a walk on level ground, set down where a run begins: the first one on a single foot.

        Args:
            s: The scenario of the run.
            q: (n, nq) coordinates of the walk.
            v: (n, nv) velocities.
            first: Row of the first state that will do; the last one does if none after it stands on a single foot.

        Raises:
            InputError: The legs cannot reach the ground of the run.
        """
        model, data, robot = self.model, self._data, self.robot
        rows = range(min(first, len(q) - 1), len(q))
        row = next((row for row in rows if self._on_one_foot(q[row])), len(q) - 1)
        mujoco.mj_resetData(model, data)
        data.qpos[:], data.qvel[:] = q[row], v[row]
        across = base_places(model, robot)[:-1]
        data.qpos[across] = model.qpos0[across] if robot.planar else 0.0
        if s.start.upright:
            self._stand_upright(s.ground)
        self._set_down()
        return data.qpos.copy(), data.qvel.copy()

    def _set_down(self) -> None:
        """Puts the lowest contact point on the ground."""
        mujoco.mj_kinematics(self.model, self._data)
        self._data.qpos[height_of(self.model, self.robot)] -= lowest(self._data, self.robot)

    def _on_one_foot(self, q: np.ndarray) -> bool:
        """Whether one foot of a state is clear of where the other one stands."""
        data, robot = self._data, self.robot
        data.qpos[:] = q
        mujoco.mj_kinematics(self.model, data)
        low = sorted(float(places_of(data, foot)[:, 2].min()) for foot in robot.feet)
        return low[1] - low[0] > _CLEAR * (q[height_of(self.model, robot)] - low[0])

    def _stand_upright(self, ground: Ground) -> None:
        """Stands the posture up on a slope."""
        if ground.slope == 0.0 and ground.side_slope == 0.0:
            return
        stand_upright(self.model, self._data, self.robot, frame(ground.slope, ground.side_slope))

    def foremost(self, s: Scenario) -> float:
        """[m] the foremost contact point of the start without deviations."""
        self.start(s, None)
        mujoco.mj_kinematics(self.model, self._data)
        return float(contact_points(self._data, self.robot)[:, 0].max())


def lowest(data: mujoco.MjData, robot: Robot) -> float:
    """[m] height of the lowest contact point; of data with kinematics."""
    return float(contact_points(data, robot)[:, 2].min())


def _keep_within(model: mujoco.MjModel, before: np.ndarray, q: np.ndarray) -> None:
    """Takes hinges back that a deviation turned beyond their stops, but for those that were further beyond before."""
    stopped = np.flatnonzero((model.jnt_limited > 0) & (model.jnt_type == mujoco.mjtJoint.mjJNT_HINGE))
    places, (low, high) = model.jnt_qposadr[stopped], model.jnt_range[stopped].T
    least, most = np.minimum(low - GIVES_WAY, before[places]), np.maximum(high + GIVES_WAY, before[places])
    q[places] = np.clip(q[places], least, most)


def _turns(model: mujoco.MjModel, column: int) -> bool:
    """Whether a velocity turns something."""
    joint = int(model.dof_jntid[column])
    match mujoco.mjtJoint(model.jnt_type[joint]):
        case mujoco.mjtJoint.mjJNT_FREE:
            return column - int(model.jnt_dofadr[joint]) >= 3
        case mujoco.mjtJoint.mjJNT_SLIDE:
            return False
    return True
