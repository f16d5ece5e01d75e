"""The stage of a film: walkers, ground with a ruler, forces and pushes, and a camera that follows from a chosen side.

Falls are drawn to their end: a robot whose run ended in one drops with its motors off while the clip goes on.
"""

import math
from collections.abc import Sequence
from copy import copy
from typing import NamedTuple

import mujoco
import numpy as np

from biped.base.errors import InputError, safe
from biped.base.files import nearest
from biped.measure.signals import finite, means
from biped.measure.trajectory import Trajectory
from biped.robot.ground import GRAVITY, slabs
from biped.show import spatial
from biped.show.spatial import light_evenly

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


LANE = 1.3
"""[m] from walker to walker side by side."""
_GEOMS = 600
_TILE, _REACH, _WIDTH = 0.5, 7.0, 0.5
_WALL, _FAR = (0.91, 0.93, 0.95, 1.0), 9.0
_LIGHT, _DARK, _MARK = (0.80, 0.82, 0.80, 1.0), (0.69, 0.72, 0.71, 1.0), (0.2, 0.22, 0.24, 1.0)
_SEAT = (0.72, 0.63, 0.52, 1.0)
_FORCE, _PUSHED, _GHOST = (0.0, 0.62, 0.45, 1.0), (0.80, 0.3, 0.62, 1.0), (0.55, 0.57, 0.6, 0.35)
_WEIGHT, _PUSH = 0.6, 1.0 / 400.0
"""[m] of a force of one body weight; [m/N] of a push."""
_FAINT = 0.02
_AFTER, _SLOWED = 1.0, 1.0
"""[s] that a clip goes on after a fall, and [N m s/rad] of joints that are without power then."""
_LEAST, _GAP, _MIDDLE = 0.2, 0.12, 0.56
"""[robot heights] of the smallest push's arrow; from its head to the middle of what is pushed; of what is looked at."""
_SEEN = 0.25
"""[s] for which a push is seen at least: one of 0.1 s would be a frame or two."""
_UPRIGHT = np.eye(3).ravel()
_ASIDE = -0.12


class FilmedWalker(NamedTuple):
    """A run on the stage.

    Attributes:
        name: What people call it.
        run: Its finite rows.
        model: MuJoCo model with its visual geoms.
        lane: [m] sideways.
        ghost: Whether it is a shadow.
        q: (n + m, nq) its coordinates as the model has them, and how it drops on after a fall.
        speed: (n,) [m/s] forward.
    """

    name: str
    run: Trajectory
    model: mujoco.MjModel
    lane: float
    ghost: bool
    q: np.ndarray
    speed: np.ndarray

    @property
    def end(self) -> float:
        """[s] at which there is nothing more to see of it."""
        return float(self.run.time[0]) + (len(self.q) - 1) * self.run.tick


def walkers(runs: Sequence[tuple[str, Trajectory, mujoco.MjModel]], ghost: bool) -> list[FilmedWalker]:
    """Runs side by side, or the second as a ghost over the first."""
    out = []
    for i, (name, whole, model) in enumerate(runs):
        run = finite(whole)
        place = 0.0 if ghost else i * LANE, ghost and i > 0
        q = run.qpos(model)
        if run.end == "fell":
            q = np.concatenate([q, fallen(run, model, q, _AFTER)])
        out.append(FilmedWalker(name, run, model, *place, q, run.forward_speed))
    return out


class FilmStage:
    """Scenes of walkers at any time.

    Args:
        shown: The walkers; the camera follows the first.
        rate: [Hz] of frames, which forces are means over.
        camera: Where it is seen from.
        shape: Width of the frame over its height.
    """

    def __init__(self, shown: Sequence[FilmedWalker], rate: float, camera: Camera, shape: float):
        self._shown = shown
        # One of its own: models of a scenario are shared.
        self.model = copy(shown[0].model)
        light_evenly(self.model)
        self.scene = mujoco.MjvScene(self.model, _GEOMS)
        for flag in ("SHADOW", "REFLECTION", "SKYBOX"):  # four times the time without a graphics card
            self.scene.flags[getattr(mujoco.mjtRndFlag, f"mjRND_{flag}")] = 0
        self._option = mujoco.MjvOption()
        self._data = [mujoco.MjData(walker.model) for walker in shown]
        self._still = mujoco.MjvPerturb()
        self._free = mujoco.MjvCamera()
        self._each = [max(1, round(1.0 / (rate * walker.run.tick))) for walker in shown]
        self._path = path_of(shown[0].run)
        self._data[0].qpos[:] = shown[0].q[0]
        mujoco.mj_forward(shown[0].model, self._data[0])
        self._height = height_of(shown[0].model, self._data[0])
        self._camera, self._away = camera, distance(self._height, self.model.vis.global_.fovy, shape)

    def at(self, time: float) -> mujoco.MjvScene:
        """The scene at a time [s]; a run that has ended stays where it ended."""
        kinds = mujoco.mjtCatBit.mjCAT_DYNAMIC.value
        for i, (walker, data, each) in enumerate(zip(self._shown, self._data, self._each, strict=True)):
            row = self._row(walker, time)
            data.qpos[:] = walker.q[row]
            mujoco.mj_forward(walker.model, data)
            first = 0 if i == 0 else self.scene.ngeom
            if i == 0:
                mujoco.mjv_updateScene(
                    self.model, data, self._option, self._still, self._free, kinds, self.scene
                )  # fmt: skip
            else:
                mujoco.mjv_addGeoms(walker.model, data, self._option, self._still, kinds, self.scene)
            for geom in self.scene.geoms[first : self.scene.ngeom]:
                geom.pos[1] += walker.lane
                if walker.ghost:
                    geom.rgba[:] = _GHOST
            if not walker.ghost and row < len(walker.run):
                self._forces(walker, row, each)
                self._pushes(walker, data, row)
        along, across = self._path[min(self._row(self._shown[0], time), len(self._path) - 1)]
        self._ground(float(along), float(across))
        self._look(float(along), float(across))
        return self.scene

    @staticmethod
    def _row(walker: FilmedWalker, time: float) -> int:
        return int(np.clip(round((time - walker.run.time[0]) / walker.run.tick), 0, len(walker.q) - 1))

    def _add(self, kind: mujoco.mjtGeom, size: Sequence[float] | np.ndarray, place: np.ndarray, colour: Sequence[float],
             label: str = "", turn: np.ndarray = _UPRIGHT) -> None:  # fmt: skip
        if self.scene.ngeom >= self.scene.maxgeom:
            return
        geom = self.scene.geoms[self.scene.ngeom]
        mujoco.mjv_initGeom(geom, kind, np.array(size, float), place, turn, np.array(colour, np.float32))
        geom.label = label
        self.scene.ngeom += 1

    def _arrow(
        self, start: np.ndarray, end: np.ndarray, width: float, colour: Sequence[float], label: str = ""
    ) -> None:
        if self.scene.ngeom >= self.scene.maxgeom or np.linalg.norm(end - start) < _FAINT:
            return
        geom, kind = self.scene.geoms[self.scene.ngeom], mujoco.mjtGeom.mjGEOM_ARROW
        mujoco.mjv_initGeom(geom, kind, np.zeros(3), np.zeros(3), np.eye(3).ravel(), np.array(colour, np.float32))
        mujoco.mjv_connector(geom, kind, width, start, end)
        geom.size[2] *= 2.0  # the renderer draws an arrow half as long as it is
        geom.label = label
        self.scene.ngeom += 1

    def _ground(self, along: float, across: float) -> None:
        """Tiles around the walker, a mark at every metre, and its number."""
        box, far = mujoco.mjtGeom.mjGEOM_BOX, max(walker.lane for walker in self._shown)
        middle, width = across + 0.5 * far, _WIDTH + 0.5 * far
        ground = self._shown[0].run.ground
        laid = slabs(ground, math.floor((along - _REACH) / _TILE), math.ceil((along + _REACH) / _TILE), _TILE)
        for (x, z), length, angle, odd in zip(*laid, strict=True):
            c, s = math.cos(angle), math.sin(angle)
            place = np.array([x + 0.03 * s, middle, z - 0.03 * c])
            turn = np.array([c, 0.0, -s, 0.0, 1.0, 0.0, s, 0.0, c])
            self._add(box, (0.5 * length, width, 0.03), place, _LIGHT if odd else _DARK, turn=turn)
        for metre in range(math.ceil(along - _REACH), math.floor(along + _REACH) + 1):
            place = np.array([float(metre), middle - width, float(ground.height(np.array(metre)))])
            self._add(box, (0.008, 0.06, 0.004), place + np.array([0.0, 0.06, 0.0]), _MARK)
            self._add(box, (0.004, 0.004, 0.002), place + np.array([0.0, 0.0, -0.05]), _MARK, f"{metre} m")
        for walker in self._shown:
            seat = spatial.seat(walker.run)
            if seat is not None:
                self._add(box, seat[1], seat[0] + np.array([0.0, walker.lane, 0.0]), _SEAT)
        # What is behind, across the camera's view: as bright whatever shines on it.
        back = -self._camera.direction * [1.0, 1.0, 0.0] / math.cos(math.radians(self._camera.elevation))
        turn = np.column_stack([[-back[1], back[0], 0.0], back, [0.0, 0.0, 1.0]]).ravel()
        self._add(box, (40.0, 0.01, 40.0), np.array([along, across, 0.0]) + _FAR * back, _WALL, turn=turn)
        self.scene.geoms[self.scene.ngeom - 1].emission = 1.0

    def _forces(self, walker: FilmedWalker, row: int, each: int) -> None:
        """Ground forces, means over a frame."""
        run = walker.run
        force = means(run.force[row : row + each], np.array([0]))[0] / (run.mass * GRAVITY)
        for point, vector in zip(run.point[row], force, strict=True):
            start = point + np.array([0.0, walker.lane + spatial.beside(run, _ASIDE), 0.0])
            self._arrow(start, start + _WEIGHT * vector, 0.02, _FORCE)
        place, seated = spatial.seated(run, np.array([row]))
        for point, vector in zip(place[0], means(seated[row : row + each], np.array([0]))[0], strict=True):
            start = point + np.array([0.0, walker.lane + _ASIDE, 0.0])
            self._arrow(start, start + _WEIGHT / (run.mass * GRAVITY) * vector, 0.02, _FORCE)

    def _pushes(self, walker: FilmedWalker, data: mujoco.MjData, row: int) -> None:
        """Pushes that act now or did a moment ago, as arrows whose heads end beside the pushed body."""
        time = float(walker.run.time[row])
        for push in spatial.pushes(walker.run):
            if push.start - 1e-9 <= time < max(push.end, push.start + _SEEN) - 1e-9:
                piece = np.searchsorted(push.time[1:-1] - 1e-9, time, side="right")
                force = push.force[min(int(piece), len(push.force) - 1)]
                size = float(np.linalg.norm(force))
                if size == 0.0:
                    continue
                vector = max(_PUSH * size, _LEAST * self._height) * force / size
                body = walker.model.body(push.body).id
                gap = _GAP * self._height * force / size
                place = data.xipos[body] + [0.0, walker.lane, 0.0] - gap
                self._arrow(place - vector, place, 0.02 * self._height, _PUSHED, f"{size:.0f} N")

    def _look(self, along: float, across: float) -> None:
        """The camera follows the first walker, further off the more there are."""
        aside = max(walker.lane for walker in self._shown)
        target = np.array([along, across + 0.5 * aside, _MIDDLE * self._height])
        eye = target + (self._away + 0.45 * aside) * self._camera.direction
        run = self._shown[0].run
        turn = spatial.tilt(run).T
        foot = np.array([along, across, float(run.ground.height(np.array(along)))])
        aim(self.scene, run, foot + turn @ (eye - [along, across, 0.0]), foot + turn @ (target - [along, across, 0.0]))


def fallen(run: Trajectory, model: mujoco.MjModel, q: np.ndarray, seconds: float) -> np.ndarray:
    """The coordinates of a robot that drops from where its run ended.

    Args:
        run: Its finite rows.
        model: What it is drawn with; it is not changed.
        q: (n, nq) its coordinates as the model has them.
        seconds: [s] for how long.

    Returns:
        (m, nq) its coordinates at every further tick.
    """
    limp = copy(model)
    limp.opt.timestep, steps = run.tick, round(seconds / run.tick)
    # Every part meets the ground, and no part another one: what is drawn may overlap at the joints.
    own, floor = limp.geom_bodyid > 0, limp.geom_type == mujoco.mjtGeom.mjGEOM_PLANE.value
    limp.geom_contype[:], limp.geom_conaffinity[:] = own, floor
    limp.geom_condim[:] = 3
    limp.dof_damping[:] = np.maximum(limp.dof_damping, np.where(limp.dof_bodyid > 1, _SLOWED, 0.0))
    data = mujoco.MjData(limp)
    back = min(10, len(q) - 1)
    data.qpos[:] = q[-1]
    if back:
        mujoco.mj_differentiatePos(limp, data.qvel, back * run.tick, q[-1 - back], q[-1])
    out = np.empty((steps, limp.nq))
    for row in out:
        mujoco.mj_step(limp, data)
        row[:] = data.qpos
    return out
