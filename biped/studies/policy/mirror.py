"""Left and right: what a policy does in a mirrored state, against the mirror image of what it does."""

from typing import NamedTuple

import mujoco
import numpy as np

from biped.control.card import Walker
from biped.engines.plant import MujocoPlant
from biped.robot.robot import Robot
from biped.robot.run import Run
from biped.studies.policy.tape import Tape, replay

NEAR, ALONG = 0.03, 0.9
"""[m] by which a joint may be beside the mirror image of its partner's; cosine between their axes."""
OF_SPACE = 6
"""Coordinates of a base that moves in space."""
_OF_VECTOR, _OF_TURN = np.array([1.0, -1.0, 1.0]), np.array([-1.0, 1.0, -1.0])
"""Signs by which a mirror in the plane of walking multiplies a vector, and an axis of rotation."""


class Mirror(NamedTuple):
    """The mirror image of a robot.

    Attributes:
        place: (nq,) whose coordinate each is that of.
        sign: (nq,) by which it is multiplied.
        rest: (nq,) coordinates at which the robot is its own image.
        column: (nv,) whose velocity each is that of.
        turned: (nv,) by which it is multiplied.
    """

    place: np.ndarray
    sign: np.ndarray
    rest: np.ndarray
    column: np.ndarray
    turned: np.ndarray

    def state(self, q: np.ndarray) -> np.ndarray:
        """(n, nq) mirrored coordinates."""
        return self.rest + self.sign * (q - self.rest)[:, self.place]

    def motion(self, v: np.ndarray) -> np.ndarray:
        """(n, nv) mirrored velocities."""
        return self.turned * v[:, self.column]


def mirror_of(model: mujoco.MjModel, robot: Robot) -> Mirror | None:
    """Returns the mirror image of a robot by places and axes of its joints; None if it has no such symmetry."""
    if len(robot.base_columns) < OF_SPACE or abs(robot.forward[0]) < ALONG or abs(robot.upright[2]) < ALONG:
        return None
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    place, sign = np.arange(model.nq), np.ones(model.nq)
    column, turned = np.arange(model.nv), np.ones(model.nv)
    middle = data.xpos[robot.base_number, 1]
    for j in range(model.njnt):
        q, v = model.jnt_qposadr[j], model.jnt_dofadr[j]
        if model.jnt_type[j] == mujoco.mjtJoint.mjJNT_FREE:
            sign[q : q + 7] = [1.0, -1.0, 1.0, 1.0, -1.0, 1.0, -1.0]
            turned[v : v + 6] = [*_OF_VECTOR, *_OF_TURN]
            continue
        hinge = model.jnt_type[j] == mujoco.mjtJoint.mjJNT_HINGE
        image = data.xanchor[j] * _OF_VECTOR + [0.0, 2.0 * middle, 0.0]
        axis = data.xaxis[j] * (_OF_TURN if hinge else _OF_VECTOR)
        gap = np.linalg.norm(data.xanchor - image, axis=1)
        along = data.xaxis @ axis
        gap[(model.jnt_type != model.jnt_type[j]) | (np.abs(along) < ALONG)] = np.inf
        partner = int(np.argmin(gap))
        if gap[partner] > NEAR:
            return None
        place[model.jnt_qposadr[partner]], sign[model.jnt_qposadr[partner]] = q, np.sign(along[partner])
        column[model.jnt_dofadr[partner]], turned[model.jnt_dofadr[partner]] = v, np.sign(along[partner])
    if len(set(place)) < model.nq:
        return None
    rest = model.qpos0.copy()
    rest[sign < 0.0] *= 1.0 if np.all(rest[sign < 0.0] == 0.0) else 0.0
    return Mirror(place, sign, rest, column, turned)


def likeness(run: Run, tape: Tape) -> float | None:
    """How like a policy's targets in mirrored states are to the mirror image of those on a tape of its own.

    Args:
        run: Of its card.
        tape: It.

    Returns:
        Correlation of all joints' targets about their means, 1 where they are alike; None if the robot has no symmetry.
        Means are left out: trained policies hold arms and feet as they happened to learn it.
    """
    plant = MujocoPlant(run)
    law, mirror = plant.law.law, mirror_of(plant.model, plant.robot)
    assert isinstance(law, Walker)
    if mirror is None:
        return None
    at = law.places
    number = {int(place): i for i, place in enumerate(at)}
    if any(int(mirror.place[place]) not in number for place in at):
        return None
    order = np.array([number[int(mirror.place[place])] for place in at])
    rest, sign = (mirror.rest[at], mirror.sign[at]) if law.position else (np.zeros(len(at)), mirror.sign[at])
    target = rest + sign * (tape.target - rest)[:, order]
    image = tape._replace(
        qpos=mirror.state(tape.qpos), qvel=mirror.motion(tape.qvel), command=tape.command * [1.0, -1.0, -1.0],
        target=target, action=law.action_of(target),
    )  # fmt: skip
    return _correlation(np.array(replay(plant, image, opposite=True).targets), target)


def _correlation(first: np.ndarray, second: np.ndarray) -> float:
    """The correlation of all columns about their means; 0 of numbers that are too large or of none that change."""
    largest = np.max(np.abs([first, second]))  # numbers near the largest have no squares
    if not 0.0 < largest < np.inf:
        return 0.0
    first, second = (one - one.mean(axis=0) for one in (first / largest, second / largest))
    return float((first * second).sum() / max(np.sqrt((first**2).sum() * (second**2).sum()), 1e-24))
