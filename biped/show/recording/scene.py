"""Around the biped: tilted ground, contact forces, pushes, the centre of mass and its trail.

A trajectory is in the slope's frame, in which gravity leans. What is below `scene` is turned by the slope, so
that in the viewer gravity is vertical and the ground rises.
"""

import math
from typing import Any

import mujoco
import numpy as np
import rerun as rr

from biped.measure.signals import means
from biped.robot.gravity import GRAVITY
from biped.robot.ground import slabs
from biped.robot.planar.topology import POINT_LINK
from biped.show import spatial
from biped.show.recording.body import drawn_geoms, mass_centres
from biped.show.recording.footing import log_footing
from biped.show.recording.recorded import LANE, Placed, times

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
    robot, out = trajectory.robot, trajectory.point[rows]
    if robot.seven_links is None:
        return out
    for i, (point, link) in enumerate(zip(robot.points, POINT_LINK, strict=True)):
        out[:, i, 1] = _sideways(run.model, run.model.body(robot.bodies[link]).id, run.model.site(point).id) + _BESIDE
    return out


def _sideways(model: mujoco.MjModel, body: int, site: int) -> float:
    """[m] y of the middle of a body's visual geoms: legs are drawn apart, though the motion is planar."""
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
