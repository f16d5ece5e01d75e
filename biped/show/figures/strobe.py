"""Stroboscopic view (Figs 3.4 to 3.9): where the biped was, at equal times, in one picture."""

import math

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Polygon

from biped.measure.signals import corners_of, limbs
from biped.measure.trajectory import Trajectory
from biped.robot.planar.topology import CHAINS
from biped.show.figures.style import LEFT, RIGHT, TRUNK, figure

# Metres between bodies and beside them for a leg of a metre, seconds between stick figures.
_BODIES, _STICKS = 0.84, 0.1
_MARGIN = 0.47
# Radii of the limbs at both ends and of the head, as fractions of the leg.
_THIGH, _SHANK, _TRUNK, _HEAD = (0.078, 0.055), (0.054, 0.036), (0.085, 0.105), 0.1
_NECK = 0.17
_COLOURS = (RIGHT, LEFT)


def strobe(trajectory: Trajectory, title: str) -> Figure:
    """Bodies every 0.8 legs or so and stick figures every 0.1 s between them, on the ground as it slopes."""
    slope = math.radians(trajectory.slope)
    turn = np.array([[math.cos(slope), math.sin(slope)], [-math.sin(slope), math.cos(slope)]])
    # Joints (n, links, 2), points (n, 4, 2), the torso's upper end (n, 2); turned so that gravity is vertical.
    joint, point, torso = (places @ turn for places in limbs(trajectory))
    leg, shown = trajectory.robot.leg, trajectory.robot.shown
    low = np.minimum(joint[..., 0].min(), point[..., 0].min()) - _MARGIN * leg
    high = np.maximum(joint[..., 0].max(), point[..., 0].max()) + _MARGIN * leg
    way = ground_line(trajectory, low, high)
    floor = way[:, 1]
    bottom, top = floor.min() - 0.12, max(torso[:, 1].max() + 0.35 * leg, floor.max() + 0.3)
    width = 11.0
    drawn = figure(width, max(2.4, width * 0.94 * (top - bottom) / (high - low) + 0.8))
    axes = drawn.add_subplot()
    axes.grid(False)
    axes.set_aspect("equal")
    axes.set_xlim(low, high)
    axes.set_ylim(bottom, top)
    axes.fill_between(way[:, 0], floor, bottom, color="#E5E7EB", linewidth=0.0)
    axes.plot(way[:, 0], floor, color="#4B5563", linewidth=1.2)
    if len(seat := corners_of(trajectory)):
        axes.add_patch(Polygon(seat @ turn, facecolor="#D6CBBD", edgecolor="#4B5563", linewidth=0.8))
    _sticks(axes, joint, point, torso, np.arange(0, len(trajectory), max(1, round(_STICKS / trajectory.tick))))
    for row in body_rows(trajectory):
        _body(axes, joint[row], point[row], torso[row], leg, shown.head)
    axes.set_title(f"{title}: a stick figure every {_STICKS:g} s; right leg blue, left leg orange")
    axes.set_xlabel("x [m]")
    axes.set_ylabel("height [m]")
    return drawn


def ground_line(trajectory: Trajectory, low: float, high: float) -> np.ndarray:
    """The ground (k, 2) [m] between two horizontal places, turned so that gravity is vertical."""
    slope = math.radians(trajectory.slope)
    if trajectory.ground.level:
        return np.array([[x, math.tan(slope) * x] for x in (low, high)])
    reach = 1.0 + np.ptp(trajectory.ground.z)  # a turned line of heights begins and ends elsewhere
    x, z = trajectory.ground.between(low / math.cos(slope) - reach, high / math.cos(slope) + reach)
    turned = np.stack([x * math.cos(slope) - z * math.sin(slope), x * math.sin(slope) + z * math.cos(slope)], axis=1)
    inside = turned[(turned[:, 0] > low) & (turned[:, 0] < high)]
    ends = np.interp([low, high], turned[:, 0], turned[:, 1])
    return np.concatenate([[[low, ends[0]]], inside, [[high, ends[1]]]])


def body_rows(trajectory: Trajectory) -> list[int]:
    """Rows at which a body is drawn: at equal times, 0.8 legs apart on average, and at the end."""
    travelled = abs(trajectory.x[-1] - trajectory.x[0])
    count = max(1, round(travelled / (_BODIES * trajectory.robot.leg)))
    return np.round(np.linspace(0, len(trajectory) - 1, count + 1)).astype(int).tolist()


def _sticks(axes: Axes, joint: np.ndarray, point: np.ndarray, torso: np.ndarray, rows: np.ndarray) -> None:
    for leg in (1, 0):
        hip, knee, ankle = CHAINS[leg][1:]
        lines = np.stack(
            [joint[rows, hip], joint[rows, knee], joint[rows, ankle], point[rows, 2 * leg],
             point[rows, 2 * leg + 1], joint[rows, ankle]], axis=1,
        )  # fmt: skip
        axes.add_collection(LineCollection(list(lines), colors=_COLOURS[leg], linewidths=0.7, alpha=0.45))
    hip = joint[rows, 1]
    trunk = np.stack([hip, torso[rows]], axis=1)
    axes.add_collection(LineCollection(list(trunk), colors=TRUNK, linewidths=0.7, alpha=0.45))


def _body(axes: Axes, joint: np.ndarray, point: np.ndarray, torso: np.ndarray, leg: float, head: bool) -> None:
    """One body: left leg, trunk and head, right leg in front; joint (7, 2), point (4, 2), torso's end (2,) [m]."""
    _leg(axes, joint, point, leg, 1)
    hip = joint[1]
    if head:
        axis = (torso - hip) / np.linalg.norm(torso - hip)
        _patch(axes, Circle(tuple(torso + _NECK * leg * axis), _HEAD * leg), TRUNK)
    _patch(axes, Polygon(capsule(hip, torso, _TRUNK[0] * leg, _TRUNK[1] * leg)), TRUNK)
    _leg(axes, joint, point, leg, 0)


def _leg(axes: Axes, joint: np.ndarray, point: np.ndarray, leg: float, side: int) -> None:
    hip, knee, ankle = (joint[link] for link in CHAINS[side][1:])
    toe, heel = point[2 * side], point[2 * side + 1]
    forward = (toe - heel) / np.linalg.norm(toe - heel)
    up = np.array([-forward[1], forward[0]])
    radius = _SHANK[1] * leg
    foot = [heel, toe, toe + 0.7 * radius * up, ankle + radius * forward, ankle - radius * forward]
    _patch(axes, Polygon(np.array(foot), joinstyle="round"), _COLOURS[side])
    for start, end, (first, last) in ((knee, ankle, _SHANK), (hip, knee, _THIGH)):
        _patch(axes, Polygon(capsule(start, end, first * leg, last * leg)), _COLOURS[side])


def _patch(axes: Axes, patch: Circle | Polygon, colour: str) -> None:
    patch.set(facecolor=colour, edgecolor="white", linewidth=0.7, zorder=3)
    axes.add_patch(patch)


def capsule(start: np.ndarray, end: np.ndarray, first: float, last: float) -> np.ndarray:
    """Outline (24, 2) of a limb from start to end (2,) [m] with radii first and last."""
    along = math.atan2(end[1] - start[1], end[0] - start[0])
    arc = np.linspace(-0.5 * math.pi, 0.5 * math.pi, 12)

    def cap(centre: np.ndarray, radius: float, angle: np.ndarray) -> np.ndarray:
        return centre + radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)

    return np.concatenate([cap(end, last, along + arc), cap(start, first, along + math.pi + arc)])
