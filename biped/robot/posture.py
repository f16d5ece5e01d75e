"""Start postures: a keyframe or the human's, disturbed if asked for, set down on the ground, upright on a slope.

A posture of the human in space is taken over by another biped: torso and thighs are turned as the human's are, knees
and ankles bent as far, within the ranges of the joints; rates are multiplied by the root of the ratio of leg lengths,
and the base moves so that the foot that stands moves as the human's does.
"""

import math
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

import mujoco
import numpy as np

from biped.base.errors import InputError
from biped.base.files import locate
from biped.robot.anatomy import HIP, JOINTS, Anatomy, JointedLeg, anatomy_of
from biped.robot.ground import frame
from biped.robot.parts import places_of
from biped.robot.recognise import robot_of
from biped.robot.robot import Robot
from biped.robot.spec import no_keyframe, parsed
from biped.scenario.keys import GIVES_WAY, Scenario
from biped.scenario.laws import THESIS
from biped.scenario.robot import Described, Foot
from biped.scenario.world import Ground

_MOST_CHANGES = 100
_STEADY = 1e-9
"""[m, rad] change with which the search ends."""
_STIFFNESS = 1e-3
"""[m²/rad²] What turning a joint costs beside points that are elsewhere: it chooses among postures that fit alike."""
_TRAVEL, _LIFT = 1.0, 1e-2
"""The same for the place of the base, along level ground and up."""
_FURTHEST = 0.03
"""[m] A point that stays further from its place than this makes another posture."""


def stand_upright(model: mujoco.MjModel, data: mujoco.MjData, robot: Robot, frame: np.ndarray) -> None:
    """Turns the base to where gravity says, about the middle of the feet, and bends legs until feet are as before.

    Args:
        model: Of the robot.
        data: A posture of level ground; changed in place.
        robot: What it is.
        frame: (3, 3) from the world, whose z is up, to the ground's frame.

    Raises:
        InputError: The legs cannot reach.
    """
    mujoco.mj_kinematics(model, data)
    wanted = contact_points(data, robot)
    middle = wanted.mean(axis=0)
    middle[2] = wanted[:, 2].min()
    if robot.planar:
        pitch = int(model.dof_jntid[robot.pitch_column])
        axis, place = data.xaxis[pitch], data.xanchor[pitch]
        data.qpos[_along(model, robot)] += (middle + frame @ (place - middle) - place)[::2]
        data.qpos[model.jnt_qposadr[pitch]] += axis[1] * math.atan2(frame[0, 2], frame[0, 0])
    else:
        first = int(model.jnt_qposadr[model.body_jntadr[robot.base_number]])
        data.qpos[first : first + 3] = middle + frame @ (data.qpos[first : first + 3] - middle)
        turn, out = np.empty(4), np.empty(4)
        mujoco.mju_mat2Quat(turn, frame.ravel())
        mujoco.mju_mulQuat(out, turn, data.qpos[first + 3 : first + 7])
        data.qpos[first + 3 : first + 7] = out
    _reach(model, data, robot, wanted, frame[:, 2])
    if float(np.linalg.norm(contact_points(data, robot) - wanted, axis=1).max()) > _FURTHEST:
        raise InputError(
            "start.upright: the legs cannot reach the slope with the body upright; expected a gentler slope, or false",
            "start.upright",
        )


def contact_points(data: mujoco.MjData, robot: Robot) -> np.ndarray:
    """(P, 3) [m] contact points; of data with kinematics."""
    return np.concatenate([places_of(data, foot) for foot in robot.feet])


def _reach(model: mujoco.MjModel, data: mujoco.MjData, robot: Robot, wanted: np.ndarray, up: np.ndarray) -> None:
    """Least squares in the legs' joints and the base's place (Gauss-Newton), within the joints' ranges."""
    bodies = [body for foot in robot.feet for body in foot.on]
    base, own = _along(model, robot), {int(joint) for joint in model.dof_jntid[list(robot.base_columns)]}
    n = len(base)
    joints = [j for j in range(model.njnt) if j not in own and model.jnt_type[j] == mujoco.mjtJoint.mjJNT_HINGE]
    places, columns = model.jnt_qposadr[joints], [*robot.moving_columns, *model.jnt_dofadr[joints]]
    limited = np.r_[np.zeros(n, bool), model.jnt_limited[joints] > 0]
    low, high = (np.r_[np.zeros(n), end] for end in model.jnt_range[joints].T)
    cost = np.diag(np.full(len(columns), _STIFFNESS))
    travel = _TRAVEL * (np.eye(3) - np.outer(up, up)) + _LIFT * np.outer(up, up)
    cost[:n, :n] = travel[::2, ::2] if robot.planar else travel
    start, rows = np.r_[data.qpos[base], data.qpos[places]], np.empty((3, model.nv))
    at = start.copy()
    for _ in range(_MOST_CHANGES):
        data.qpos[base], data.qpos[places] = at[:n], at[n:]
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        now = contact_points(data, robot)
        J = np.empty((len(now), 3, len(columns)))
        for p, (point, body) in enumerate(zip(now, bodies, strict=True)):
            mujoco.mj_jac(model, data, rows, None, point, body)
            J[p] = rows[:, columns]
        J = J.reshape(-1, len(columns))
        H, f = J.T @ J + cost, J.T @ (wanted - now).ravel() - cost @ (at - start)
        # What is at the end of its range and wants beyond stays there.
        free = ~(limited & (((at <= low) & (f < 0.0)) | ((at >= high) & (f > 0.0))))
        step = np.zeros(len(columns))
        step[free] = np.linalg.solve(H[np.ix_(free, free)], f[free])
        after = np.where(limited, np.clip(at + step, low, high), at + step)
        steady = float(np.abs(after - at).max()) < _STEADY
        at = after
        if steady:
            break


def _along(model: mujoco.MjModel, robot: Robot) -> list[int]:
    """Where the coordinates of the base's place stand in q: along x, y and z, in the plane along x and z."""
    first = int(model.jnt_qposadr[model.body_jntadr[robot.base_number]])
    if not robot.planar:
        return [first, first + 1, first + 2]
    return [int(model.jnt_qposadr[model.dof_jntid[column]]) for column in robot.moving_columns]


_CLEAR = 0.01
"""Of the height of the base above the standing foot: what a foot in the air is above it at least."""
_STEPS = 50
_CLOSE = 1e-10
_NEAR_END = 0.02
"""[rad] from the end of a joint's range at which it starts at the most."""


class _Walker(NamedTuple):
    """A biped in a state.

    Attributes:
        model: Of it.
        data: Its state, with kinematics and velocities.
        anatomy: What is what in it.
    """

    model: mujoco.MjModel
    data: mujoco.MjData
    anatomy: Anatomy


@lru_cache(maxsize=1)
def _human() -> tuple[mujoco.MjModel, Robot]:
    path = locate("models", "human3d", "model")
    feet = tuple(Foot(name, tuple(f"{name}_{end}_{side}" for end in ("toe", "heel") for side in ("inner", "outer")))
                 for name in ("right", "left"))  # fmt: skip
    table = Described(foot=feet)
    return parsed(path, table)[1], robot_of(path, table)


def borrowed_names() -> tuple[str, ...]:
    """Postures that a biped in space may take over."""
    return _human()[1].starts


def borrow(model: mujoco.MjModel, data: mujoco.MjData, robot: Robot, name: str) -> None:
    """Puts a biped into a posture of the human's.

    Args:
        model: Of the biped.
        data: Its state, at its own start; changed in place.
        robot: What it is.
        name: The posture.

    Raises:
        InputError: Its legs are of another kind.
    """
    human, who = _human()
    theirs = mujoco.MjData(human)
    mujoco.mj_resetDataKeyframe(human, theirs, who.starts.index(name))
    _computed(human, theirs)
    teacher = _Walker(human, theirs, anatomy_of(human, who))
    pupil = _Walker(model, data, anatomy_of(model, robot))
    pace = math.sqrt(teacher.anatomy.leg / pupil.anatomy.leg)
    base, their_base = robot.base_number, who.base_number
    data.qvel[:] = 0.0
    turned = _axes(theirs, their_base, teacher.anatomy.axes)
    spin = pace * _spin(human, theirs, their_base)
    if robot.planar:
        pitch = [int(model.dof_jntid[robot.pitch_column])]
        _turn(pupil, pitch, base, pupil.anatomy.axes, turned)
        data.qvel[robot.pitch_column] = data.xaxis[pitch[0]] @ spin
    else:
        first, column = int(model.jnt_qposadr[model.body_jntadr[base]]), robot.base_columns[0]
        turn = turned @ pupil.anatomy.axes.T
        mujoco.mju_mat2Quat(data.qpos[first + 3 : first + 7], turn.ravel())
        data.qvel[column + 3 : column + 6] = turn.T @ spin
    for mine, other in zip(pupil.anatomy.legs, teacher.anatomy.legs, strict=True):
        _bend(pupil, mine, teacher, other)
        _turn(pupil, mine.hips, mine.thigh, mine.axes, _axes(theirs, other.thigh, other.axes))
    _computed(model, data)
    for mine, other in zip(pupil.anatomy.legs, teacher.anatomy.legs, strict=True):
        wanted = pace * _spin(human, theirs, other.thigh) - _spin(model, data, base)
        axes = data.xaxis[mine.hips]
        rates = axes @ wanted if robot.planar else np.linalg.solve(axes.T, wanted)
        data.qvel[model.jnt_dofadr[mine.hips]] = rates
        for i in range(HIP, JOINTS):
            joint = mine.joints[i]
            if joint >= 0:
                rate = theirs.qvel[human.jnt_dofadr[other.joints[i]]] * other.sign[i]
                data.qvel[model.jnt_dofadr[joint]] = pace * mine.sign[i] * rate
    _computed(model, data)
    low = [_sole(walker)[:, :, 2].mean(axis=1) for walker in (teacher, pupil)]
    stands = int(np.argmin(low[0]))
    theirs_moves, mine_moves = (_moving(walker, stands) for walker in (teacher, pupil))
    along = theirs_moves / pace - mine_moves
    data.qvel[list(robot.moving_columns)] = along[::2] if robot.planar else along


def _bend(pupil: _Walker, mine: JointedLeg, teacher: _Walker, other: JointedLeg) -> None:
    """Bends knee and ankle as far as the human's."""
    for i in range(HIP, JOINTS):
        joint = mine.joints[i]
        if joint < 0:
            continue
        theirs = teacher.data.qpos[teacher.model.jnt_qposadr[other.joints[i]]]
        angle = other.sign[i] * (theirs - other.zero[i])
        value = mine.zero[i] + mine.sign[i] * angle
        pupil.data.qpos[pupil.model.jnt_qposadr[joint]] = _within(pupil.model, joint, float(value))


def _within(model: mujoco.MjModel, joint: int, value: float) -> float:
    """A coordinate, or the next one within its joint's range."""
    if not model.jnt_limited[joint]:
        return value
    low, high = model.jnt_range[joint]
    return min(max(value, float(low) + _NEAR_END), float(high) - _NEAR_END)


def _turn(walker: _Walker, joints: list[int], body: int, own: np.ndarray, wanted: np.ndarray) -> None:
    """Turns joints until a body's own axes are as wanted, or as near as its joints allow (Gauss-Newton)."""
    model, data = walker.model, walker.data
    for _ in range(_STEPS):
        mujoco.mj_kinematics(model, data)
        rest = wanted @ _axes(data, body, own).T
        quat, away = np.empty(4), np.empty(3)
        mujoco.mju_mat2Quat(quat, rest.ravel())
        mujoco.mju_quat2Vel(away, quat, 1.0)
        step = np.linalg.lstsq(data.xaxis[joints].T, away, rcond=1e-3)[0]
        data.qpos[model.jnt_qposadr[joints]] += np.clip(step, -0.5, 0.5)
        if np.abs(step).max() < _CLOSE:
            break
    for joint in joints:
        place = model.jnt_qposadr[joint]
        data.qpos[place] = _within(model, joint, float(data.qpos[place]))


def _axes(data: mujoco.MjData, body: int, own: np.ndarray) -> np.ndarray:
    """(3, 3) a body's own axes in the world, as columns."""
    return data.xmat[body].reshape(3, 3) @ own


def _computed(model: mujoco.MjModel, data: mujoco.MjData) -> None:
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    mujoco.mj_comVel(model, data)


def _spin(model: mujoco.MjModel, data: mujoco.MjData, body: int) -> np.ndarray:
    """(3,) [rad/s] angular velocity of a body in the world."""
    out = np.empty(6)
    mujoco.mj_objectVelocity(model, data, mujoco.mjtObj.mjOBJ_XBODY, body, out, 0)
    return out[:3]


def _sole(walker: _Walker) -> np.ndarray:
    """(2, 4, 3) [m] corners of the soles."""
    data = walker.data
    return np.array([data.xpos[leg.foot] + leg.sole @ data.xmat[leg.foot].reshape(3, 3).T
                     for leg in walker.anatomy.legs])  # fmt: skip


def _moving(walker: _Walker, side: int) -> np.ndarray:
    """(3,) [m/s] of the middle of a sole."""
    model, data, leg = walker.model, walker.data, walker.anatomy.legs[side]
    J = np.empty((3, model.nv))
    mujoco.mj_jac(model, data, J, None, _sole(walker)[side].mean(axis=0), leg.foot)
    return J @ data.qvel


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
        across = _along(model, robot)[:-1]
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


def height_of(model: mujoco.MjModel, robot: Robot) -> int:
    """Which coordinate lifts the base."""
    return _along(model, robot)[-1]


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
