"""The state of any robot at a tick: judged for a fall, and written into its row of the trajectory, in one kernel."""

import math
from typing import NamedTuple

import mujoco
import numpy as np

from biped.base.jit import inner_kernel, kernel
from biped.engines.forces import nearest_point, write_spin
from biped.engines.loop import GOING, LOW, NOT_FINITE, TILTED
from biped.robot.ground import GROUND, Profile, height_below, set_ground
from biped.robot.robot import Robot
from biped.scenario.keys import Fall

TIME, Q, V, U, POINT, FORCE, CONTACT, COM, COM_VELOCITY, BASE, FIGURE, GROUND_FORCE = range(12)
ENERGY, WORK, GIVEN = range(12, 15)
"""Quantities of a trajectory (`biped.robot.columns.columns_of`), in their order."""
N_JOINTS = 6
"""Of a stick figure: hip, knee and ankle of each leg."""


class State(NamedTuple):
    """MuJoCo's state after the first half of a step, and what is needed to judge and to log it; arrays are live.

    Attributes:
        q: (nq,) coordinates.
        v: (nv,) velocities.
        place: (nbody, 3) [m] origins of bodies.
        turn: (nbody, 9) their axes.
        quaternion: (nbody, 4) likewise.
        centre: (nbody, 3) [m] their centres of mass.
        com: (nbody, 3) [m] centres of mass of bodies with all that hangs on them.
        com_velocity: (nbody, 3) [m/s] of these.
        anchor: (njnt, 3) [m] places of joints.
        energy: (2,) [J] potential and kinetic.
        inertia: (nbody, 10) of bodies about the centre of mass of all.
        moving: (nbody, 6) velocities of bodies there.
        columns: (15,) first columns of a trajectory's quantities.
        base: (2,) numbers of base and trunk.
        axes: (3, 3) against gravity; in the base's frame up when it stands, and the trunk's upper end [m].
        bounds: (2,) of a fall: height of the trunk [m] and lean of the base [degrees].
        ground: (1,) `biped.robot.ground.GROUND`.
        body: (P,) bodies that contact points are on.
        foot: (P,) feet of contact points.
        local: (P, 3) [m] contact points in their bodies' frames.
        anchors: (6,) joints that a stick figure shows; -1 - foot where a leg has no such joint.
        point: (P, 3) [m] contact points, overwritten.
        touching: (P,) which of them touch, overwritten.
    """

    q: np.ndarray
    v: np.ndarray
    place: np.ndarray
    turn: np.ndarray
    quaternion: np.ndarray
    centre: np.ndarray
    com: np.ndarray
    com_velocity: np.ndarray
    anchor: np.ndarray
    energy: np.ndarray
    inertia: np.ndarray
    moving: np.ndarray
    columns: np.ndarray
    base: np.ndarray
    axes: np.ndarray
    bounds: np.ndarray
    ground: np.ndarray
    body: np.ndarray
    foot: np.ndarray
    local: np.ndarray
    anchors: np.ndarray
    point: np.ndarray
    touching: np.ndarray


def state_of(
    model: mujoco.MjModel, data: mujoco.MjData, robot: Robot, columns: dict[str, tuple[int, tuple[int, ...]]],
    fall: Fall, profile: Profile,
) -> State:  # fmt: skip
    """The state of a run.

    Args:
        model: What is stepped.
        data: Its state, that of the start.
        robot: What it is.
        columns: Of a trajectory.
        fall: Bounds of height, as a share of the start's, and of lean.
        profile: The line of the ground.
    """
    ground, gravity = np.zeros(1, GROUND), np.array(model.opt.gravity)
    set_ground(ground[0], profile)
    body = np.array([on for foot in robot.feet for on in foot.on])
    mujoco.mj_kinematics(model, data)
    trunk = data.xipos[robot.trunk_number]
    least = fall.height * (float(trunk[2]) - float(profile.height(trunk[0])))
    anchors = [
        foot.joints[i] if i < len(foot.joints) else -1 - number
        for number, foot in enumerate(robot.feet)
        for i in range(N_JOINTS // 2)
    ]
    return State(
        data.qpos, data.qvel, data.xpos, data.xmat, data.xquat, data.xipos, data.subtree_com, data.subtree_linvel,
        data.xanchor, data.energy, data.cinert, data.cvel, np.array([first for first, _ in columns.values()]),
        np.array([robot.base_number, robot.trunk_number]),
        np.array([-gravity / np.linalg.norm(gravity), robot.upright, robot.top]),
        np.array([least, fall.tilt]), ground, body, robot.of_foot,
        np.array([place for foot in robot.feet for place in foot.points]), np.array(anchors),
        np.zeros((len(body), 3)), np.zeros(len(body), dtype=bool),
    )  # fmt: skip


@inner_kernel
def _status(s):
    for j in range(s.q.size):
        if not math.isfinite(s.q[j]):
            return NOT_FINITE
    for j in range(s.v.size):
        if not math.isfinite(s.v[j]):
            return NOT_FINITE
    up, own, R = s.axes[0], s.axes[1], s.turn[s.base[0]]
    upright = 0.0
    for i in range(3):
        upright += up[i] * (R[3 * i] * own[0] + R[3 * i + 1] * own[1] + R[3 * i + 2] * own[2])
    if math.degrees(math.acos(min(max(upright, -1.0), 1.0))) > s.bounds[1]:
        return TILTED
    trunk = s.centre[s.base[1]]
    return LOW if trunk[2] - height_below(s.ground[0], trunk[0]) < s.bounds[0] else GOING


@inner_kernel
def ride(R, place, local, out):
    """Writes where a point of a body is, place + R local; summed as numpy's einsum does, which laws may use."""
    for i in range(3):
        out[i] = place[i] + ((R[3 * i] * local[0] + R[3 * i + 2] * local[2]) + R[3 * i + 1] * local[1])


@inner_kernel
def _write_figure(s, figure):
    """Writes joints of the legs and the trunk's end (21,) [m]."""
    for k in range(N_JOINTS):
        joint = s.anchors[k]
        for i in range(3):
            if joint >= 0:
                figure[3 * k + i] = s.anchor[joint, i]
                continue
            total, count = 0.0, 0  # a foot without an ankle: the middle of its contact points
            for p in range(s.foot.size):
                if s.foot[p] == -1 - joint:
                    total, count = total + s.point[p, i], count + 1
            figure[3 * k + i] = total / count
    ride(s.turn[s.base[0]], s.place[s.base[0]], s.axes[2], figure[3 * N_JOINTS :])


@inner_kernel
def write_state(at, line, time, q, v, com, com_velocity, place, quaternion, energy):
    """Writes what is MuJoCo's of a state into its row.

    Args:
        at: (15,) first columns of a trajectory's quantities.
        line: The row.
        time: [s].
        q: (nq,) coordinates.
        v: (nv,) velocities.
        com: (3,) [m] centre of mass.
        com_velocity: (3,) [m/s] of it.
        place: (3,) [m] origin of the base.
        quaternion: (4,) its orientation.
        energy: (2,) [J] potential and kinetic.
    """
    line[at[TIME]] = time
    for j in range(q.size):
        line[at[Q] + j] = q[j]
    for j in range(v.size):
        line[at[V] + j] = v[j]
    for i in range(3):
        line[at[COM] + i] = com[i]
        line[at[COM_VELOCITY] + i] = com_velocity[i]
        line[at[BASE] + i] = place[i]
    for i in range(4):
        line[at[BASE] + 3 + i] = quaternion[i]
    line[at[ENERGY]] = energy[0] + energy[1]


@kernel
def log_state(s, contacts, line, outside, time):
    """Judges a state and writes it into its row, all but the forces of the step that follows.

    Args:
        s: `State`.
        contacts: `biped.engines.forces.Contacts`.
        line: The row.
        outside: (9,) that of `Trajectory.outside`.
        time: [s].

    Returns:
        GOING, LOW, TILTED or NOT_FINITE; then nothing is written.
    """
    status = _status(s)
    if status == NOT_FINITE:
        return status
    at, base = s.columns, s.base[0]
    points = s.body.size
    write_state(at, line, time, s.q, s.v, s.com[base], s.com_velocity[base], s.place[base], s.quaternion[base],
                s.energy)  # fmt: skip
    for p in range(points):
        ride(s.turn[s.body[p]], s.place[s.body[p]], s.local[p], s.point[p])
        s.touching[p] = False
    for c in range(contacts.gap.size):
        if contacts.gap[c] <= contacts.margin[c]:
            p = nearest_point(s.point, s.foot, contacts, c)
            if p >= 0:
                s.touching[p] = True
    for p in range(points):
        for i in range(3):
            line[at[POINT] + 3 * p + i] = s.point[p, i]
        line[at[CONTACT] + p] = 1.0 if s.touching[p] else 0.0
    _write_figure(s, line[at[FIGURE] :])
    write_spin(s.inertia, s.moving, outside)
    return status
