"""Footing of a walker in space: its support, its steps, and where a foot would bring it to rest.

All of it lies on the ground: the outline of the points that touch, of each foot where it stood, and the extrapolated
centre of mass (the capture point): while it is inside the outline of what touches, the walker could stop there.
"""

import numpy as np
import rerun as rr

from biped.measure.metrics.space import extrapolated, outline
from biped.measure.trajectory import Trajectory
from biped.show.recording.recorded import Placed, times
from biped.show.recording.series import LEFT, RIGHT

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
