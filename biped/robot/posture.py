"""Start postures: a keyframe, disturbed if that is asked for, set down on the ground."""

from pathlib import Path

import mujoco
import numpy as np

from biped.robot.borrowed import borrow, borrowed_names
from biped.robot.gravity import frame
from biped.robot.recognise import robot_of
from biped.robot.robot import Robot
from biped.robot.spec import no_keyframe, parsed
from biped.robot.upright import contact_points, stand_upright
from biped.scenario.keys import Scenario
from biped.scenario.laws import SPATIAL
from biped.scenario.robot import Described
from biped.scenario.world import Ground


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
            if s.law != SPATIAL or name not in borrowed_names():
                raise no_keyframe(self._path, name, robot.starts)
            if robot.start:
                mujoco.mj_resetDataKeyframe(model, data, robot.starts.index(robot.start))
            borrow(model, data, robot, name)
        elif name:
            mujoco.mj_resetDataKeyframe(model, data, robot.starts.index(name))
        if start.upright:
            self._stand_upright(s.ground)
        if noise is not None:
            turning = np.array([_turns(model, column) for column in range(model.nv)])
            deviation = np.where(turning, noise.standard_normal(model.nv) * start.jitter, 0.0)
            mujoco.mj_integratePos(model, data.qpos, deviation, 1.0)
        if start.settle:
            mujoco.mj_kinematics(model, data)
            data.qpos[height_of(model, robot)] -= lowest(data, robot)
        return data.qpos.copy(), data.qvel.copy()

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


def height_of(model: mujoco.MjModel, robot: Robot) -> int:
    """Which coordinate lifts the base."""
    first = int(model.body_jntadr[robot.base_number])
    if not robot.planar:
        return int(model.jnt_qposadr[first]) + 2
    column = robot.base_columns[1]
    return int(model.jnt_qposadr[model.dof_jntid[column]])


def _turns(model: mujoco.MjModel, column: int) -> bool:
    """Whether a velocity turns something."""
    joint = int(model.dof_jntid[column])
    match mujoco.mjtJoint(model.jnt_type[joint]):
        case mujoco.mjtJoint.mjJNT_FREE:
            return column - int(model.jnt_dofadr[joint]) >= 3
        case mujoco.mjtJoint.mjJNT_SLIDE:
            return False
    return True
