"""Figures of a run: its curves (Figs 3.10 to 3.14), and where it was at equal times (Figs 3.4 to 3.9).

Curves are of one run or many: the loads that an engineer asks for, engines over each other.
"""

import math
from collections.abc import Mapping, Sequence
from itertools import cycle

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Polygon

from biped.measure import signals
from biped.measure.pushes import pushes_of
from biped.measure.trajectory import Trajectory
from biped.robot.ground import GRAVITY
from biped.robot.planar.topology import CHAINS, SEGMENTS
from biped.show import document
from biped.show.figures.style import LEFT, PUSH, QUIET, RIGHT, STATES, TRUNK, figure, legend_above, timed

Window = tuple[float, float]
_MEANS = f"means over {1e3 * signals.SMOOTH:.0f} ms"
_BEFORE, _AFTER = 2.0, 5.0


def velocity(trajectory: Trajectory, title: str, window: Window) -> Figure:
    """Forward velocity of the torso's centre of mass (Fig 3.10) with its mean in the window."""
    drawn = figure(8.0, 3.0)
    axes = timed(drawn.add_subplot(), f"{title}: forward velocity of the torso", "velocity [m/s]")
    rows = signals.inside(trajectory, window)
    mean = float(trajectory.forward_speed[rows].mean())
    axes.plot(trajectory.time, trajectory.forward_speed, color=RIGHT)
    span = trajectory.time[rows][[0, -1]]
    axes.plot(span, [mean, mean], "--", color=LEFT, label=f"mean {mean:.2f} m/s in {span[0]:.3g} to {span[1]:.3g} s")
    _mark_pushes(axes, trajectory)
    axes.legend(loc="lower right")
    return drawn


def torso(trajectory: Trajectory, title: str) -> Figure:
    """Torso angle (Fig 3.11): 90° is upright."""
    drawn = figure(8.0, 3.0)
    axes = timed(drawn.add_subplot(), f"{title}: torso angle, 90° is upright", "θ [°]")
    axes.axhline(90.0, color=QUIET, linestyle="--", linewidth=1.0)
    axes.plot(trajectory.time, np.degrees(signals.torso_angle(trajectory)), color=RIGHT, label="true")
    if (inferred := signals.inferred_torso_angle(trajectory)) is not None:
        axes.plot(trajectory.time, np.degrees(inferred), "--", color=LEFT, linewidth=1.0, label="inferred")
        legend_above(axes, 2)
    _mark_pushes(axes, trajectory)
    return drawn


def phase(trajectory: Trajectory, title: str, window: Window) -> Figure:
    """Phase portraits of the right hip, knee and ankle (Fig 3.12): the window over the whole run."""
    drawn = figure(9.5, 3.4)
    rows = signals.inside(trajectory, window)
    angle, rate = np.degrees(trajectory.joint_angles), np.degrees(trajectory.joint_rates)
    symbols = {"hip": "θ1 − θ", "knee": "θ2 − θ1", "ankle": "θ3 − θ2 + π/2"}
    for i, (axes, (joint, symbol)) in enumerate(zip(drawn.subplots(1, 3), symbols.items(), strict=True)):
        axes.plot(angle[:, i], rate[:, i], color=QUIET, linewidth=0.4, alpha=0.6, label="whole run")
        mean = signals.smooth(rate[:, i], trajectory.tick)
        axes.plot(angle[rows, i], mean[rows], color=RIGHT, linewidth=1.2, label=f"window, {_MEANS}")
        axes.set_xlabel(f"right {joint} {symbol} [°]")
    drawn.axes[0].set_ylabel("rate [°/s]")
    legend_above(drawn.axes[2], 2)
    drawn.suptitle(f"{title}: phase portraits", fontsize=11, x=0.01, ha="left")
    return drawn


def push(trajectory: Trajectory, title: str) -> Figure:
    """Forward velocity around the pushes (Fig 3.13)."""
    drawn = figure(8.0, 3.2)
    axes = timed(drawn.add_subplot(), f"{title}: response to the push", "velocity of the torso [m/s]")
    axes.plot(trajectory.time, trajectory.forward_speed, color=RIGHT)
    _mark_pushes(axes, trajectory)
    start, end = min(p[0] for p in trajectory.pushes), max(p[1] for p in trajectory.pushes)
    axes.set_xlim(max(0.0, start - _BEFORE), min(trajectory.time[-1] + trajectory.tick, end + _AFTER))
    axes.legend(loc="lower right")
    return drawn


def loads(trajectory: Trajectory, title: str, window: Window) -> Figure:
    """Joint torques, ground forces against body weight, and leg states, in the window."""
    drawn = figure(9.5, 9.6)
    *joints, force, lanes = drawn.subplots(5, 1, sharex=True, height_ratios=[1.0, 1.0, 1.0, 1.1, 0.6])
    rows = signals.inside(trajectory, window)
    time, applied = trajectory.time[rows], trajectory.joint_torques
    legs = list(zip(trajectory.robot.legs, (RIGHT, LEFT), strict=True))
    for joint, (axes, name) in enumerate(zip(joints, ("hip", "knee", "ankle"), strict=True)):
        for leg, (side, colour) in enumerate(legs):
            torque = applied[:, SEGMENTS * leg + joint]
            axes.plot(time, torque[rows], color=colour, linewidth=0.4, alpha=0.3)
            axes.plot(time, signals.smooth(torque, trajectory.tick)[rows], color=colour, label=side)
        axes.set_ylabel(f"{name} [N m]")
        axes.sharey(joints[0])
    joints[0].set_title(f"{title}: torques and ground forces, {_MEANS}")
    legend_above(joints[0], 2)
    _forces(force, trajectory, rows)
    _lanes(lanes, trajectory, rows)
    lanes.set_xlabel("time [s]")
    lanes.set_xlim(time[0], time[-1])
    return drawn


def ensemble(trajectories: Sequence[Trajectory], title: str) -> Figure:
    """Forward velocity of many runs (Fig 3.14); those that did not stay up stand out and end in a cross."""
    drawn = figure(8.0, 3.6)
    axes = timed(drawn.add_subplot(), title, "velocity of the torso [m/s]")
    shade = max(0.15, min(0.8, 6.0 / len(trajectories)))
    for t in trajectories:
        rows = signals.every(t, 100.0)
        stood = t.end == "completed"
        style = {"color": RIGHT, "alpha": shade} if stood else {"color": LEFT, "zorder": 3}
        axes.plot(t.time[rows], t.forward_speed[rows], linewidth=0.7 if stood else 1.0, **style)
        if not stood:
            axes.plot(t.time[rows[-1]], t.forward_speed[rows[-1]], "x", color=LEFT, zorder=4)
    # Speeds of walking, not of falling.
    walking = [t.forward_speed for t in trajectories if t.end == "completed"] or [t.forward_speed for t in trajectories]
    low, high = min(v.min() for v in walking), max(v.max() for v in walking)
    axes.set_ylim(low - 0.3 * (high - low), high + 0.3 * (high - low))
    return drawn


def _mark_pushes(axes: Axes, trajectory: Trajectory) -> None:
    for push in pushes_of(trajectory):
        label = f"{push.size} on the {push.body}"
        axes.axvspan(push.start, push.end, color=PUSH, alpha=0.35, linewidth=0.0, label=label)


def _forces(axes: Axes, trajectory: Trajectory, rows: np.ndarray) -> None:
    weight = trajectory.mass * GRAVITY
    force = trajectory.foot_force
    for foot, (side, colour) in enumerate((("right", RIGHT), ("left", LEFT))):
        mean = signals.smooth(force[:, foot], trajectory.tick)
        axes.plot(trajectory.time[rows], mean[rows], color=colour, label=side)
    axes.axhline(weight, color="black", linestyle="--", linewidth=0.8, label=f"body weight {weight:.0f} N")
    # The peaks of 1 ms would leave the rest of the curve on the floor: they are told, not drawn.
    peak = force[rows].max()
    axes.plot([], [], " ", label=f"(peak of one tick {peak:.0f} N)")
    axes.set_ylabel("normal force [N]")
    legend_above(axes, 4)


def _lanes(axes: Axes, trajectory: Trajectory, rows: np.ndarray) -> None:
    """Leg states as bars; drawn as one filled step per state and leg."""
    time, states = trajectory.time[rows], signals.leg_states(trajectory)[rows]
    for leg, colour in enumerate((RIGHT, LEFT)):
        for state, share in STATES.items():
            axes.fill_between(
                time, 0.6 - leg, 1.4 - leg, where=states[:, leg] == state, step="post", color=to_rgba(colour, share),
                linewidth=0.0, label=document.STATES[state] if leg == 0 else None,
            )  # fmt: skip
    axes.set_yticks([1.0, 0.0], ["right", "left"])
    axes.set_ylim(-0.5, 1.5)
    axes.set_ylabel("leg state")
    axes.grid(False)
    legend_above(axes, 4)


_COLOURS = (LEFT, RIGHT, "tab:green", "tab:purple", "tab:brown")
_LAST = 3.0
"""[s] of joint angles shown: at the end, where the gait is steady."""


def overlay(walkers: Mapping[str, Trajectory], title: str) -> Figure:
    """Velocity over the whole run, and angles of the first three driven joints over its last seconds.

    Args:
        walkers: Trajectories of one robot by the name of their engine.
        title: The scenario's name.
    """
    drawn = figure(8.0, 8.0)
    velocity, *joints = drawn.subplots(4, 1)
    timed(velocity, f"{title}: forward velocity of the base", "velocity [m/s]")
    end = min(float(t.time[-1]) for t in walkers.values())
    for (engine, t), colour in zip(walkers.items(), cycle(_COLOURS)):
        velocity.plot(t.time, signals.smooth(t.forward_speed, t.tick), color=colour, label=engine, alpha=0.8)
        shown = (t.time >= end - _LAST) & (t.time <= end)
        for drive, axes in zip(t.robot.drives, joints):  # noqa: B905 – the first three
            timed(axes, drive.name.replace("_", " "), "angle [°]")
            axes.plot(t.time[shown], np.degrees(t.q[shown, drive.place]), color=colour, alpha=0.8)
    velocity.legend(loc="lower right")
    for axes in (velocity, *joints[:-1]):
        axes.set_xlabel("")
    return drawn


_AROUND = 0.005, 0.025
"""[s] that are shown before and after a strike."""


def first_strike(t: Trajectory) -> tuple[int, int] | None:
    """Row and foot of the first time that a foot comes down from the air; None if none does."""
    loaded = t.foot_force > 0.0
    for row in np.flatnonzero((loaded[1:] & ~loaded[:-1]).any(axis=1)) + 1:
        for foot in np.flatnonzero(loaded[row] & ~loaded[row - 1]):
            if row * t.tick > 0.1 and not loaded[max(0, row - round(0.1 / t.tick)) : row, foot].any():
                return int(row), int(foot)
    return None


def strike(walkers: Mapping[str, Trajectory], title: str) -> Figure:
    """Normal force of the foot that strikes first, and of its most loaded point, over 30 ms.

    Args:
        walkers: Trajectories by the name of their engine.
        title: The scenario's name.
    """
    drawn = figure(8.0, 5.0)
    whole, single = drawn.subplots(2, 1, sharex=True)
    for i, (engine, t) in enumerate(walkers.items()):
        found = first_strike(t)
        if found is None:
            continue
        row, foot = found
        first, last = max(0, row - round(_AROUND[0] / t.tick)), row + round(_AROUND[1] / t.tick)
        time, normal = 1e3 * t.tick * (np.arange(first, min(last, len(t))) - row), t.force[first:last, :, 2]
        points = normal[:, t.robot.of_foot == foot]
        label = f"{engine}, at {row * t.tick:.3f} s"
        whole.step(time, 1e-3 * t.foot_force[first:last, foot], where="post", color=f"C{i}", label=label)
        single.step(time, 1e-3 * points[:, points.max(axis=0).argmax()], where="post", color=f"C{i}", label=label)
    whole.set_title(f"{title}: the first strike")
    whole.set_ylabel("foot [kN]")
    single.set_ylabel("its most loaded point [kN]")
    single.set_xlabel("after the first contact [ms]")
    if whole.get_legend_handles_labels()[0]:
        whole.legend(loc="upper right")
    return drawn


# Metres between bodies and beside them for a leg of a metre, seconds between stick figures.
_BODIES, _STICKS = 0.84, 0.1
_MARGIN = 0.47
# Radii of the limbs at both ends and of the head, as fractions of the leg.
_THIGH, _SHANK, _TRUNK, _HEAD = (0.078, 0.055), (0.054, 0.036), (0.085, 0.105), 0.1
_NECK = 0.17
_LEGS = (RIGHT, LEFT)


def strobe(trajectory: Trajectory, title: str) -> Figure:
    """Bodies every 0.8 legs or so and stick figures every 0.1 s between them, on the ground as it slopes."""
    slope = math.radians(trajectory.slope)
    turn = np.array([[math.cos(slope), math.sin(slope)], [-math.sin(slope), math.cos(slope)]])
    # Joints (n, links, 2), points (n, 4, 2), the torso's upper end (n, 2); turned so that gravity is vertical.
    joint, point, torso = (places @ turn for places in signals.limbs(trajectory))
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
    if len(seat := signals.corners_of(trajectory)):
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
        axes.add_collection(LineCollection(list(lines), colors=_LEGS[leg], linewidths=0.7, alpha=0.45))
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
    _patch(axes, Polygon(np.array(foot), joinstyle="round"), _LEGS[side])
    for start, end, (first, last) in ((knee, ankle, _SHANK), (hip, knee, _THIGH)):
        _patch(axes, Polygon(capsule(start, end, first * leg, last * leg)), _LEGS[side])


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
