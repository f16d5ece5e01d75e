"""The robot as its model file draws it, its footing, and what is around it: ground, contact forces, pushes, its trail.

A trajectory is in the slope's frame, in which gravity leans. What is below `scene` is turned by the slope, so
that in the viewer gravity is vertical and the ground rises. Footing lies on the ground: the outline of the points that
touch, of each foot where it stood, and the extrapolated centre of mass (the capture point): while it is inside the
outline of what touches, the walker could stop there.
"""

import math
from typing import Any

import mujoco
import numpy as np
import rerun as rr

from biped.measure.metrics.gait import extrapolated, outline
from biped.measure.signals import means
from biped.measure.trajectory import Trajectory
from biped.robot.ground import GRAVITY, slabs
from biped.robot.spec import DRAWN
from biped.show import spatial
from biped.show.recording.series import LANE, LEFT, RIGHT, Placed, times

PICTURES = 60.0
"""[Hz]"""
_DEFAULT_COLOUR = np.array([0.5, 0.5, 0.5, 1.0], np.float32)
_GHOST = (150, 150, 155, 70)


def log_body(recording: rr.RecordingStream, placed: Placed, rows: np.ndarray) -> None:
    """Logs shapes and their motion.

    Args:
        recording: Where to.
        placed: The run.
        rows: (m,) rows of the trajectory to show.
    """
    model, trajectory = placed.run.model, placed.run.trajectory
    shown = drawn_geoms(model)
    bodies = sorted({int(model.geom_bodyid[g]) for g in shown})
    for geom in shown:
        path = placed.entity("scene", "body", model.body(model.geom_bodyid[geom]).name, f"shape_{geom}")
        recording.log(path, _shape(model, geom, placed.run.ghost), static=True)
    position, quaternion = body_poses(model, trajectory.qpos(model)[rows])
    at = times(trajectory.time[rows])
    for body in bodies:
        recording.send_columns(
            placed.entity("scene", "body", model.body(body).name),
            indexes=[at],
            columns=rr.Transform3D.columns(
                translation=position[:, body].astype(np.float32),
                quaternion=np.roll(quaternion[:, body], -1, axis=-1).astype(np.float32),  # w last
            ),
        )


def drawn_geoms(model: mujoco.MjModel) -> list[int]:
    """Numbers of the geoms that are drawn, the world's excepted: `scene` draws the ground."""
    return [g for g in range(model.ngeom) if model.geom_bodyid[g] > 0 and model.geom_group[g] <= DRAWN]


def mass_centres(model: mujoco.MjModel, q: np.ndarray, body: str) -> np.ndarray:
    """(m, 3) [m] the centre of mass of a body in configurations q (m, nq), in the model's order."""
    data, number = mujoco.MjData(model), model.body(body).id
    out = np.empty((len(q), 3))
    for i, row in enumerate(q):
        data.qpos[:] = row
        mujoco.mj_kinematics(model, data)
        out[i] = data.xipos[number]
    return out


def body_poses(model: mujoco.MjModel, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Positions (m, nbody, 3) [m] and quaternions (m, nbody, 4), w first, of all bodies."""
    data = mujoco.MjData(model)
    position, quaternion = np.empty((len(q), model.nbody, 3)), np.empty((len(q), model.nbody, 4))
    for i, row in enumerate(q):
        data.qpos[:] = row
        mujoco.mj_kinematics(model, data)
        position[i], quaternion[i] = data.xpos, data.xquat
    return position, quaternion


def _shape(model: mujoco.MjModel, geom: int, ghost: bool) -> rr.AsComponents:
    """A geom in its body's frame."""
    kind, size = mujoco.mjtGeom(model.geom_type[geom]), model.geom_size[geom]
    centre, quaternion = model.geom_pos[geom], model.geom_quat[geom]
    turned = np.roll(quaternion, -1)
    colour = _GHOST if ghost else _colour(model, geom)
    turn = np.zeros(9)
    mujoco.mju_quat2Mat(turn, quaternion)
    turn = turn.reshape(3, 3)
    solid = rr.components.FillMode.Solid
    match kind:
        case mujoco.mjtGeom.mjGEOM_CAPSULE:  # rerun's starts at its origin, MuJoCo's is centred
            return rr.Capsules3D(
                lengths=2.0 * size[1], radii=size[0], translations=centre - turn[:, 2] * size[1],
                quaternions=turned, colors=colour, fill_mode=solid,
            )  # fmt: skip
        case mujoco.mjtGeom.mjGEOM_CYLINDER:
            return rr.Cylinders3D(
                lengths=2.0 * size[1], radii=size[0], centers=centre, quaternions=turned, colors=colour,
                fill_mode=solid,
            )  # fmt: skip
        case mujoco.mjtGeom.mjGEOM_BOX:
            return rr.Boxes3D(half_sizes=size, centers=centre, quaternions=turned, colors=colour, fill_mode=solid)
        case mujoco.mjtGeom.mjGEOM_MESH:
            mesh = model.mesh(model.geom_dataid[geom])
            first, count = int(mesh.vertadr[0]), int(mesh.vertnum[0])
            face, faces = int(mesh.faceadr[0]), int(mesh.facenum[0])
            return rr.Mesh3D(
                vertex_positions=model.mesh_vert[first : first + count] @ turn.T + centre,
                triangle_indices=model.mesh_face[face : face + faces],
                albedo_factor=colour,
            )
    half = np.full(3, size[0]) if kind == mujoco.mjtGeom.mjGEOM_SPHERE else size
    return rr.Ellipsoids3D(half_sizes=half, centers=centre, quaternions=turned, colors=colour, fill_mode=solid)


def _colour(model: mujoco.MjModel, geom: int) -> np.ndarray:
    """RGBA (4,) as MuJoCo shows it: a material counts unless the geom has a colour of its own."""
    rgba, material = model.geom_rgba[geom], model.geom_matid[geom]
    if material >= 0 and np.array_equal(rgba, _DEFAULT_COLOUR):
        rgba = model.mat_rgba[material]
    return np.round(255.0 * rgba).astype(np.uint8)


CAPTURE, SUPPORT = "capture_point", "support"
STEPS = ("right_steps", "left_steps")
"""Entities below `scene`."""
_CAPTURE, _SUPPORT = (120, 94, 240), (40, 44, 52)
# [m] above the ground, so that what lies on it is seen.
_ABOVE = 0.004


def log_footing(recording: rr.RecordingStream, placed: Placed, t: Trajectory, rows: np.ndarray) -> None:
    """Logs all of it.

    Args:
        recording: Where to.
        placed: The run.
        t: Its trajectory.
        rows: (m,) rows of it to show.
    """
    at = times(t.time[rows])
    path = placed.entity("scene", CAPTURE)
    recording.log(path, rr.Points3D.from_fields(radii=0.03, colors=_CAPTURE), static=True)
    columns = rr.Points3D.columns(positions=_on_ground(extrapolated(t)[rows]))
    recording.send_columns(path, indexes=[at], columns=columns)
    path = placed.entity("scene", SUPPORT)
    recording.log(path, rr.LineStrips3D.from_fields(radii=0.006, colors=_SUPPORT), static=True)
    strips = [_closed(t.point[row, t.contact[row] > 0.0, :2]) for row in rows]
    standing = [strip for strip in strips if len(strip)]
    columns = rr.LineStrips3D.columns(strips=standing).partition([int(len(strip) > 0) for strip in strips])
    recording.send_columns(path, indexes=[at], columns=columns)
    _log_steps(recording, placed, t)


def _log_steps(recording: rr.RecordingStream, placed: Placed, t: Trajectory) -> None:
    """The outline of a foot from every strike on, as it is when the foot is flattest before the next."""
    feet, found = t.robot.of_foot, t.strikes
    for foot, (name, colour) in enumerate(zip(STEPS, (RIGHT, LEFT), strict=True)):
        mine = [row for row, which in found if which == foot]
        if not mine:
            continue
        path = placed.entity("scene", name)
        recording.log(path, rr.LineStrips3D.from_fields(radii=0.005, colors=colour), static=True)
        strips = []
        for first, last in zip(mine, [*mine[1:], len(t)], strict=True):
            points = t.point[first:last, feet == foot]
            flat = int(np.argmin(points[:, :, 2].max(axis=1)))
            strips.append(_closed(points[flat, :, :2]))
        recording.send_columns(path, indexes=[times(t.time[mine])], columns=rr.LineStrips3D.columns(strips=strips))


def _closed(points: np.ndarray) -> np.ndarray:
    """(k + 1, 3) an outline on the ground, back to where it begins; (0, 3) of no points."""
    corners = outline(points)
    return _on_ground(np.concatenate([corners, corners[:1]]))


def _on_ground(places: np.ndarray) -> np.ndarray:
    """(n, 3) of places (n, 2) [m]."""
    return np.concatenate([places, np.full((len(places), 1), _ABOVE)], axis=1).astype(np.float32)


BODY_WEIGHT = 0.6
"""[m] length of a contact force arrow of one body weight."""
PUSH = 1.0 / 400.0
"""[m/N] length of a push arrow: a push of 200 N would be hard to see on the other scale."""
_TILE = 0.5
_MARGIN = 1.0
_SLAB = 0.04
_LIGHT, _DARK, _MARK = (222, 224, 220), (196, 200, 197), (255, 255, 255)
_SEAT = (184, 161, 133)
_FORCE, _PUSHED, _CENTRE, _BELIEVED = (0, 158, 115), (245, 110, 170), (60, 60, 66), (230, 159, 0)
# Forces and the centre of mass are drawn [m] on the viewer's side, where limbs and trunk do not hide them.
_BESIDE, _ASIDE = -0.07, -0.14
# Forces that the controller counts on are thin, in front of those that there are.
_NEARER = np.array([0.0, -0.03, 0.0])
# Forces below this [N] have an arrow too short to see.
_FAINT = 5.0


def log_scene(recording: rr.RecordingStream, placed: Placed, rows: np.ndarray) -> None:
    """Logs everything around one run's biped.

    Args:
        recording: Where to.
        placed: The run.
        rows: (m,) rows of the trajectory to show.
    """
    tilt = rr.Transform3D(translation=[0.0, placed.lane, 0.0], mat3x3=spatial.tilt(placed.run.trajectory))
    recording.log(placed.entity("scene"), tilt, static=True)
    _log_eye(recording, placed, rows)
    _log_centre(recording, placed, rows)
    if placed.run.ghost:
        return
    _log_ground(recording, placed)
    _log_seat(recording, placed, rows)
    _log_forces(recording, placed, rows, placed.run.trajectory.force)
    believed = placed.run.believed(placed.run.trajectory)
    if believed is not None:
        _log_forces(recording, placed, rows, spatial.lift(believed), believed=True)
    if not placed.run.trajectory.robot.planar:
        log_footing(recording, placed, placed.run.trajectory, rows)
    if placed.run.trajectory.pushes:
        _log_pushes(recording, placed, rows)


def _log_ground(recording: rr.RecordingStream, placed: Placed) -> None:
    """A strip of tiles, with a number at every metre, as far as the walk goes."""
    x = placed.run.trajectory.x
    first, last = math.floor((x.min() - _MARGIN) / _TILE), math.ceil((x.max() + _MARGIN) / _TILE)
    ground = placed.run.trajectory.ground
    laid, width = slabs(ground, first, last, _TILE), 0.42 * LANE
    down = 0.5 * _SLAB * np.stack([np.sin(laid.angle), -np.cos(laid.angle)], axis=1)
    count, half = len(laid.length), -0.5 * laid.angle
    turned = None if ground.level else np.stack([0 * half, np.sin(half), 0 * half, np.cos(half)], axis=1)
    recording.log(
        placed.entity("scene", "ground"),
        rr.Boxes3D(
            half_sizes=np.stack([0.5 * laid.length, np.full(count, width), np.full(count, 0.5 * _SLAB)], axis=1),
            centers=spatial.lift(laid.middle + down),
            quaternions=turned,
            colors=np.where(laid.odd[:, None], _DARK, _LIGHT).astype(np.uint8),
            fill_mode=rr.components.FillMode.Solid,
        ),
        static=True,
    )
    metres = np.arange(math.ceil(first * _TILE), math.floor(last * _TILE) + 1)
    recording.log(
        placed.entity("scene", "metres"),
        rr.Points3D(
            np.stack([metres, np.full(len(metres), -width), ground.height(metres) + 0.01], axis=1),
            radii=0.012,
            colors=_MARK,
            labels=[f"{metre} m" for metre in metres],
            show_labels=True,
        ),
        static=True,
    )


def _log_seat(recording: rr.RecordingStream, placed: Placed, rows: np.ndarray) -> None:
    """The seat, and how it bears the pelvis."""
    trajectory = placed.run.trajectory
    box = spatial.seat(trajectory)
    if box is None:
        return
    middle, half = box
    solid = rr.components.FillMode.Solid
    boxes = rr.Boxes3D(half_sizes=[half], centers=[middle], colors=_SEAT, fill_mode=solid)
    recording.log(placed.entity("scene", "seat"), boxes, static=True)
    place, force = spatial.seated(trajectory, rows)
    place[..., 1] -= half[1]  # on the viewer's side of the box
    _log_arrows(recording, placed, rows, "seat_force", force, place, {"radii": 0.022, "colors": _FORCE})


def _log_eye(recording: rr.RecordingStream, placed: Placed, rows: np.ndarray) -> None:
    """The frame that the view moves with: upright and level with the ground below, without tilt and bobbing."""
    trajectory = placed.run.trajectory
    slope = math.radians(trajectory.slope)
    along = trajectory.com[rows, 0]
    place = np.stack([along * math.cos(slope), np.full(len(rows), placed.lane), along * math.sin(slope)], axis=1)
    recording.send_columns(
        placed.entity("eye"),
        indexes=[times(trajectory.time[rows])],
        columns=rr.Transform3D.columns(translation=place.astype(np.float32)),
    )


def _log_centre(recording: rr.RecordingStream, placed: Placed, rows: np.ndarray) -> None:
    """The centre of mass above the ground, and its trail up to now."""
    trajectory = placed.run.trajectory
    place = trajectory.com[rows]
    place[:, 1] += spatial.beside(trajectory, _ASIDE)
    # Straight down is where gravity points, not where the slope's normal does.
    below = place - place[:, 2:] * spatial.plumb(trajectory)
    below[:, 2] += trajectory.ground.height(below[:, 0])
    path = placed.entity("scene", "centre_of_mass")
    at = times(trajectory.time[rows])
    recording.log(path, rr.Points3D.from_fields(radii=0.028, colors=_CENTRE), static=True)
    recording.send_columns(path, indexes=[at], columns=rr.Points3D.columns(positions=place.astype(np.float32)))
    _log_strips(recording, f"{path}/plumb", at, below, place)
    # One piece a picture: the view shows all pieces up to its time.
    before = np.concatenate([place[:1], place[:-1]])
    _log_strips(recording, placed.entity("scene", "trail"), at, before, place)


def _log_strips(
    recording: rr.RecordingStream, path: str, at: rr.TimeColumn, start: np.ndarray, end: np.ndarray
) -> None:
    """A thin line from `start` to `end` (m, 3) [m] at each time."""
    recording.log(path, rr.LineStrips3D.from_fields(radii=0.006, colors=_CENTRE), static=True)
    strips = list(np.stack([start, end], axis=1).astype(np.float32))
    recording.send_columns(path, indexes=[at], columns=rr.LineStrips3D.columns(strips=strips))


def _log_forces(
    recording: rr.RecordingStream, placed: Placed, rows: np.ndarray, forces: np.ndarray, believed: bool = False
) -> None:
    """Contact forces (n, P, 3) [N] as arrows from their points, means over each picture."""
    origin = contact_points(placed, rows)
    if believed:
        origin += _NEARER
    style = {"radii": 0.012, "colors": _BELIEVED} if believed else {"radii": 0.022, "colors": _FORCE}
    _log_arrows(recording, placed, rows, "believed_force" if believed else "contact_force", forces, origin, style)


def _log_arrows(
    recording: rr.RecordingStream, placed: Placed, rows: np.ndarray, name: str, forces: np.ndarray,
    origin: np.ndarray, style: dict[str, Any],
) -> None:  # fmt: skip
    """Forces (n, P, 3) [N], means over each picture, as arrows from places (m, P, 3) [m]."""
    trajectory = placed.run.trajectory
    force = means(forces, rows)
    scale = BODY_WEIGHT / (trajectory.mass * GRAVITY)
    loaded = np.linalg.norm(force, axis=2) > _FAINT  # (m, P)
    path = placed.entity("scene", name)
    recording.log(path, rr.Arrows3D.from_fields(**style), static=True)
    recording.send_columns(
        path,
        indexes=[times(trajectory.time[rows])],
        columns=rr.Arrows3D.columns(
            vectors=(scale * force)[loaded].astype(np.float32), origins=origin[loaded].astype(np.float32)
        ).partition(loaded.sum(axis=1)),
    )


def contact_points(placed: Placed, rows: np.ndarray) -> np.ndarray:
    """(m, 4, 3) [m] toes and heels on the slope, beside the legs as the model draws them; of others all points."""
    run = placed.run
    trajectory = run.trajectory
    out = trajectory.point[rows]
    marked = [name for foot in trajectory.robot.feet for name in foot.names]
    for i, point in enumerate(marked):
        out[:, i, 1] = _sideways(run.model, run.model.site(point).id) + _BESIDE
    return out


def _sideways(model: mujoco.MjModel, site: int) -> float:
    """[m] y of the middle of a body's visual geoms: legs are drawn apart, though the motion is planar."""
    body = model.site_bodyid[site]
    drawn = [model.geom_pos[g][1] for g in drawn_geoms(model) if model.geom_bodyid[g] == body]
    return float(np.mean(drawn)) if drawn else float(model.site_pos[site][1])


def _log_pushes(recording: rr.RecordingStream, placed: Placed, rows: np.ndarray) -> None:
    """Each push as an arrow that ends at the pushed body's centre of mass, while it lasts."""
    trajectory = placed.run.trajectory
    time = trajectory.time
    for i, push in enumerate(spatial.pushes(trajectory)):
        first, last = np.searchsorted(time, [push.start - 1e-9, push.end - 1e-9])
        if first == len(time):
            continue  # fallen before
        shown = np.unique(np.concatenate([[first], rows[(rows > first) & (rows < last)]]))
        vectors = PUSH * push.force[np.searchsorted(push.time[1:-1] - 1e-9, time[shown], side="right")]
        path = placed.entity("scene", f"push_{i}")
        label = f"{push.largest:.0f} N" if len(push.force) == 1 else f"up to {push.largest:.0f} N"
        style = rr.Arrows3D.from_fields(radii=0.035, colors=_PUSHED, labels=label, show_labels=True)
        recording.log(path, style, static=True)
        origin = mass_centres(placed.run.model, trajectory.qpos(placed.run.model)[shown], push.body) - vectors
        ended = time[last : last + 1]  # none if the run ends before the push does
        recording.send_columns(
            path,
            indexes=[times(np.append(time[shown], ended))],
            columns=rr.Arrows3D.columns(
                vectors=vectors.astype(np.float32), origins=origin.astype(np.float32)
            ).partition([1] * len(shown) + [0] * len(ended)),
        )
