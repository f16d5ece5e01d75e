"""The observation of a law of a robot of any kind at a tick; only the parts that it reads are computed."""

from collections.abc import Callable
from functools import cached_property
from typing import NamedTuple

import mujoco
import numpy as np

from biped.base.jit import bound, kernel
from biped.robot.ground import LEVEL, Profile
from biped.robot.parts import above
from biped.robot.robot import Robot
from biped.scenario.devices import Command


class Touch(NamedTuple):
    """Contact points, of a foot or of both.

    Attributes:
        position: (k, 3) [m].
        velocity: (k, 3) [m/s].
        contact: (k,) whether each touches the ground.
        force: (k, 3) [N] of the ground on each, in the latest step.
    """

    position: np.ndarray
    velocity: np.ndarray
    contact: np.ndarray
    force: np.ndarray


class Pose(NamedTuple):
    """Of the base.

    Attributes:
        position: (3,) [m] of its frame.
        orientation: (3, 3) its axes as columns.
        velocity: (3,) [m/s] of its frame's origin.
        angular_velocity: (3,) [rad/s] in the world's frame.
    """

    position: np.ndarray
    orientation: np.ndarray
    velocity: np.ndarray
    angular_velocity: np.ndarray


class Observation:
    """The observation at a tick, in the ground's frame: x forward, y to the left, z along the ground's normal.

    Arrays that are not copies cannot be written through. Coordinates, velocities and their order are MuJoCo's.

    Args:
        model: What is stepped.
        data: Its state, with what `mj_step1` computes, at once or by `compute`.
        robot: What it is.
        ground: The line of the ground.
        contact: Whether each contact point touches (P,), and the ground's force (P, 3) [N] on it, live; None: nothing
            touches.
        points: (P, 3) [m] places of the contact points where something else computes them, live.
        compute: Has what `mj_step1` computes computed, once at a tick at which a law reads any of it.

    Attributes:
        time: [s].
        robot: What it is.
        q: (nq,) coordinates.
        v: (nv,) velocities.
        gravity: (3,) [m/s²].
        down: (3,) its direction.
        touching: (P,) whether each contact point touches the ground; those of the first foot come first.
        ground_force: (P, 3) [N] on them, in the latest step.
        command_at: The scenario's command, if it has one.
    """

    def __init__(
        self, model: mujoco.MjModel, data: mujoco.MjData, robot: Robot, ground: Profile = LEVEL,
        contact: tuple[np.ndarray, np.ndarray] | None = None, points: np.ndarray | None = None,
        compute: Callable[[], None] | None = None,
    ):  # fmt: skip
        self._model, self._state, self.robot, self._ground = model, data, robot, ground
        self._compute, self._computed = compute, compute is None
        self.time = 0.0
        self.q, self.v = _read_only(data.qpos), _read_only(data.qvel)
        self.gravity = _read_only(model.opt.gravity)
        self.down = _read_only(self.gravity / np.linalg.norm(self.gravity))
        self._objects: dict[str, tuple[mujoco.mjtObj, int]] = {}
        self._frames: dict[str, Pose] = {}
        self.command_at: Command | None = None
        self._on = np.array([body for foot in robot.feet for body in foot.on], dtype=int)
        self._places = np.array([place for foot in robot.feet for place in foot.points])
        self._feet = robot.of_foot
        self._known_points = points
        self._jacobian: Callable[..., None] | None = None
        self._moves: tuple[np.ndarray, ...] = ()
        if contact is None:
            contact = np.zeros(len(self._on), dtype=bool), np.zeros((len(self._on), 3))
        self.touching, self.ground_force = (_read_only(array) for array in contact)
        self._size = len(self.__dict__) + 1  # nothing computed

    def begin(self, time: float) -> None:
        """Forgets what was computed at the tick before."""
        self.time, self._computed = time, self._compute is None
        self._frames.clear()
        if len(self.__dict__) > self._size:
            for name in _COMPUTED:
                self.__dict__.pop(name, None)

    @property
    def _data(self) -> mujoco.MjData:
        """The state with what `mj_step1` computes at it."""
        if self._compute is not None and not self._computed:
            self._computed = True
            self._compute()
        return self._state

    @staticmethod
    def names_of(robot: Robot) -> list[str]:
        """Names of `numbers`.

        Coordinates `q.NAME` and velocities `v.NAME` as in `biped model --json`; of contact points `height.NAME` [m] and
        `contact.NAME` (0 or 1); `com.x` … of the centre of mass [m] and `com_velocity.x` … [m/s]; in the frame of the
        base the direction `gravity.x` … and `gyro.x` … [rad/s]; `time` [s].
        """
        points, three = robot.points, "xyz"
        return [
            *(f"q.{name}" for name in robot.q_names), *(f"v.{name}" for name in robot.v_names),
            *(f"height.{name}" for name in points), *(f"contact.{name}" for name in points),
            *(f"{what}.{axis}" for what in ("com", "com_velocity", "gravity", "gyro") for axis in three), "time",
        ]  # fmt: skip

    @property
    def numbers(self) -> np.ndarray:
        """All that a network can be shown, in the order of `names_of`."""
        to_base = self.base.orientation.T
        gravity, gyro = to_base @ self.gravity / np.linalg.norm(self.gravity), to_base @ self.base.angular_velocity
        parts = self.q, self.v, self.height, self.touching, self.com, self.com_velocity, gravity, gyro
        return np.concatenate([*parts, [self.time]])

    @cached_property
    def com(self) -> np.ndarray:
        """(3,) [m] centre of mass of the whole robot."""
        return self._data.subtree_com[self.robot.base_number].copy()

    @cached_property
    def com_velocity(self) -> np.ndarray:
        """(3,) [m/s]."""
        mujoco.mj_subtreeVel(self._model, self._data)
        return self._data.subtree_linvel[self.robot.base_number].copy()

    @cached_property
    def base(self) -> Pose:
        """Place, orientation and velocities of the base."""
        data, number = self._data, self.robot.base_number
        turning = np.empty(6)
        mujoco.mj_objectVelocity(self._model, data, mujoco.mjtObj.mjOBJ_XBODY, number, turning, 0)
        return Pose(data.xpos[number].copy(), data.xmat[number].reshape(3, 3).copy(), turning[3:], turning[:3])

    @cached_property
    def points(self) -> np.ndarray:
        """(P, 3) [m] contact points of both feet."""
        if self._known_points is not None:
            return self._known_points.copy()
        turn = self._data.xmat[self._on].reshape(-1, 3, 3)
        return self._data.xpos[self._on] + np.einsum("pij,pj->pi", turn, self._places)

    @cached_property
    def height(self) -> np.ndarray:
        """(P,) [m] of the contact points above the ground below them."""
        points = self.points
        return points[:, 2] - self._ground.height(points[:, 0])

    @cached_property
    def point_velocity(self) -> np.ndarray:
        """(P, 3) [m/s]."""
        return (self.J @ self._data.qvel).reshape(-1, 3)

    @cached_property
    def foot(self) -> tuple[Touch, ...]:
        """Contact points, foot by foot."""
        return tuple(
            Touch(*(values[self._feet == i] for values in (
                self.points, self.point_velocity, self.touching, self.ground_force)))
            for i in range(len(self.robot.feet))
        )  # fmt: skip

    @cached_property
    def M(self) -> np.ndarray:
        """(nv, nv) mass matrix, the rotors' inertia included."""
        out = np.empty((self._model.nv, self._model.nv))
        mujoco.mj_fullM(self._model, self._data, out)
        return out

    @property
    def h(self) -> np.ndarray:
        """(nv,) bias forces, gravity included; without the joints' own damping and springs."""
        return _read_only(self._data.qfrc_bias)

    @property
    def passive(self) -> np.ndarray:
        """(nv,) forces of the joints' own damping and springs: M v̇ + h = torques + passive + Jᵀ forces."""
        return _read_only(self._data.qfrc_passive)

    @cached_property
    def J(self) -> np.ndarray:
        """(3 P, nv) of all contact points: x, y and z row of each."""
        out = np.zeros((3 * len(self._on), self._model.nv))
        if self._jacobian is None:
            moves = np.zeros((len(self._on), self._model.nv), dtype=bool)
            for moved, body in zip(moves, self._on, strict=True):
                chain = above(self._model, body)
                moved[np.isin(self._model.dof_bodyid, chain)] = True
            root = self._model.body_rootid[self._on[0]]
            self._moves = moves, self._data.cdof, self._data.subtree_com[root]
            self._jacobian = bound(jacobian, self.points, *self._moves, out)
        self._jacobian(self.points, *self._moves, out)
        return out

    @cached_property
    def b(self) -> np.ndarray:
        """(3 P,) -J̇v of these rows: J v̇ = b where the points stay."""
        out, row = np.empty((len(self._on), 3)), np.empty((3, self._model.nv))
        for i, (body, place) in enumerate(zip(self._on, self.points, strict=True)):
            mujoco.mj_jacDot(self._model, self._data, row, None, place, body)
            out[i] = -row @ self._data.qvel
        return out.ravel()

    @property
    def command(self) -> np.ndarray:
        """(3,) [m/s, m/s, rad/s] velocity forward, to the left and about z that is asked for; zero where none is."""
        return np.zeros(3) if self.command_at is None else np.array(self.command_at.at(self.time))

    def frame(self, name: str) -> Pose:
        """Pose of a site or, where none has this name, of a body; velocities in its own axes, as sensors on it measure.

        Raises:
            KeyError: Neither has this name.
        """
        if name in self._frames:
            return self._frames[name]
        model, data, site = self._model, self._data, mujoco.mjtObj.mjOBJ_SITE
        if name not in self._objects:
            number = mujoco.mj_name2id(model, site, name)
            self._objects[name] = (
                (site, number) if number >= 0 else (mujoco.mjtObj.mjOBJ_XBODY, int(model.body(name).id))
            )
        kind, number = self._objects[name]
        place, turn = (data.site_xpos, data.site_xmat) if kind == site else (data.xpos, data.xmat)
        turning = np.empty(6)
        mujoco.mj_objectVelocity(model, data, kind, number, turning, 1)
        out = self._frames[name] = Pose(
            place[number].copy(), turn[number].reshape(3, 3).copy(), turning[3:], turning[:3]
        )
        return out

    def J_com(self) -> np.ndarray:
        """(3, nv) of the centre of mass."""
        out = np.empty((3, self._model.nv))
        mujoco.mj_jacSubtreeCom(self._model, self._data, out, self.robot.base_number)
        return out

    def body(self, name: str) -> tuple[np.ndarray, np.ndarray]:
        """Centre of mass (3,) [m] and axes (3, 3), as columns, of a body."""
        number = self.robot.bodies.index(name) + 1
        return self._data.xipos[number].copy(), self._data.xmat[number].reshape(3, 3).copy()

    def J_body(self, name: str) -> tuple[np.ndarray, np.ndarray]:
        """(3, nv) each: of a body's centre of mass, and of its angular velocity."""
        along, about = np.empty((3, self._model.nv)), np.empty((3, self._model.nv))
        mujoco.mj_jacBodyCom(self._model, self._data, along, about, self.robot.bodies.index(name) + 1)
        return along, about


@kernel
def jacobian(points, moves, axes, com, out):
    """Writes the Jacobian of points, by MuJoCo's axes of motion about the centre of mass: `mj_jac` of all at once.

    Args:
        points: (P, 3) [m].
        moves: (P, nv) whether a velocity moves a point.
        axes: (nv, 6) rotation, then linear motion at the centre of mass, of each velocity.
        com: (3,) [m] centre of mass.
        out: (3 P, nv) zeros, overwritten: x, y and z row of each point.
    """
    for p in range(points.shape[0]):
        x, y, z = points[p, 0] - com[0], points[p, 1] - com[1], points[p, 2] - com[2]
        for j in range(axes.shape[0]):
            if moves[p, j]:
                axis = axes[j]
                out[3 * p, j] = axis[3] + (axis[1] * z - axis[2] * y)
                out[3 * p + 1, j] = axis[4] + (axis[2] * x - axis[0] * z)
                out[3 * p + 2, j] = axis[5] + (axis[0] * y - axis[1] * x)


_COMPUTED = tuple(name for name, value in vars(Observation).items() if isinstance(value, cached_property))


def _read_only(array: np.ndarray) -> np.ndarray:
    """A live view that a law cannot write through: changing what it senses would change the physics."""
    view = array.view()
    view.flags.writeable = False
    return view
