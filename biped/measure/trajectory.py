"""The trajectory of a run of any robot: what is true of it, whatever its law believed.

True places, forces and energy exist for every robot: its plant logs them, or they follow from coordinates and
velocities (`biped.measure.seven_links`).
"""

from __future__ import annotations

from functools import cached_property, partial
from typing import TYPE_CHECKING

import numpy as np

from biped.measure.contact import Strike, ends, feet_down, strikes_of
from biped.measure.log import Log
from biped.robot.ground import GRAVITY
from biped.robot.planar.topology import ENDS, LEGS, SEGMENTS

if TYPE_CHECKING:
    import mujoco


class Trajectory(Log):
    """One run."""

    def _true(self, name: str) -> np.ndarray:
        """A true quantity: logged, unless it follows from what is."""
        return self.column(name)

    @property
    def _outside(self) -> np.ndarray | None:
        return self.outside

    @cached_property
    def point(self) -> np.ndarray:
        """(n, P, 3) [m] contact points."""
        return self._true("point")

    @cached_property
    def force(self) -> np.ndarray:
        """(n, P, 3) [N] ground forces on them in the step after each row: along the ground, to the left, normal."""
        return self._true("force")

    @cached_property
    def contact(self) -> np.ndarray:
        """(n, P) whether they touch the ground (0 or 1)."""
        return self.column("contact")

    @cached_property
    def com(self) -> np.ndarray:
        """(n, 3) [m] centre of mass of the whole robot."""
        return self._true("com")

    @cached_property
    def com_velocity(self) -> np.ndarray:
        """(n, 3) [m/s]."""
        return self._true("com_velocity")

    @cached_property
    def energy(self) -> np.ndarray:
        """(n,) [J] kinetic and potential."""
        return self._true("energy")

    @cached_property
    def work(self) -> np.ndarray:
        """(n,) [J] of everything but gravity and springs in the steps after each row."""
        return self._true("work") if self.account is None else self.account

    @cached_property
    def input_work(self) -> np.ndarray:
        """(n,) [J] of actuators and pushes in the steps after each row."""
        return self._true("given")

    @property
    def spent(self) -> np.ndarray:
        """(n,) [J] that actuators and pushes gave or took, likewise."""
        return np.abs(self.input_work)

    @property
    def has_torques(self) -> bool:
        """Whether the torques of the actuators are known: laws with forces of their own log none."""
        return not self.generalized

    @property
    def net_power(self) -> np.ndarray:
        """(n - 1,) [W] mean sum of the powers of all that the law does, and of pushes where it drives no joints."""
        if self.generalized:
            return self.input_work[:-1] / self.tick
        return mean_powers(self.u, self.rate).sum(axis=1)

    @cached_property
    def ground_force(self) -> np.ndarray:
        """(n, 3) [N] force of the ground on all of the robot, feet or not, in the steps after each row."""
        return self.column("ground_force")

    @cached_property
    def base(self) -> np.ndarray:
        """(n, 7) place [m] and orientation (quaternion, w first) of the base."""
        return self.column("base")

    @cached_property
    def figure(self) -> np.ndarray:
        """(n, 7, 3) [m] hip, knee and ankle of each leg, and the trunk's upper end."""
        return self.column("figure")

    @cached_property
    def spin(self) -> np.ndarray | None:
        """(n, 3) [N m s] angular momentum about the centre of mass; None where it is not known."""
        return None if (known := self._outside) is None else known[:, :3]

    @cached_property
    def wrench(self) -> np.ndarray | None:
        """(n, 6) [N, N m] of all that may act from outside but gravity, in the steps after each row; see `outside`."""
        return None if (known := self._outside) is None else known[:, 3:]

    @property
    def x(self) -> np.ndarray:
        """(n,) [m] of the base, along the ground."""
        return self.base[:, 0]

    @property
    def y(self) -> np.ndarray:
        """(n,) [m] of the base, to the left."""
        return self.base[:, 1]

    @property
    def forward_speed(self) -> np.ndarray:
        """(n,) [m/s] of the base, along the course."""
        level = list(self.robot.moving_columns[:-1])
        return np.einsum("ij,ij->i", self.way[:, : len(level)], self.v[:, level])

    @cached_property
    def turn(self) -> np.ndarray:
        """(n, 3, 3) axes of the base, as columns."""
        w, x, y, z = self.base[:, 3:].T
        return np.stack(
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y),
             2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
             2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)], axis=1,
        ).reshape(-1, 3, 3)  # fmt: skip

    @cached_property
    def heading(self) -> np.ndarray:
        """(n,) [rad] of the base, to the left positive, without jumps; 0 in the plane."""
        return self.robot.heading(self.turn)

    @cached_property
    def course(self) -> np.ndarray:
        """(n,) [rad] headings without the turning to and fro of each stride: means over the stride around each row.

        (Feet are a step apart: seen from a torso that has turned by 7°, they are 7 cm further apart than they are.)
        """
        steps = [row for row, _ in self.strikes]
        stride = 2 * round(float(np.median(np.diff(steps)))) if len(steps) > 2 else 1
        stride = min(max(stride, 1), len(self))
        total = np.concatenate([[0.0], np.cumsum(self.heading)])
        first = np.clip(np.arange(len(self)) - stride // 2, 0, len(self) - stride)
        return (total[first + stride] - total[first]) / stride

    @cached_property
    def way(self) -> np.ndarray:
        """(n, 3) unit vectors along the ground in the direction of the course."""
        return np.stack([np.cos(self.course), np.sin(self.course), np.zeros(len(self))], axis=1)

    @cached_property
    def aside(self) -> np.ndarray:
        """(n, 2) unit vectors along the ground to the left of the course."""
        return np.stack([-self.way[:, 1], self.way[:, 0]], axis=1)

    @cached_property
    def lean(self) -> np.ndarray:
        """(n,) [rad] of the base from the vertical, positive in the direction of the course."""
        up = -np.array(self.gravity) / np.linalg.norm(self.gravity)
        forward = self.way - (self.way @ up)[:, None] * up
        axis = self.turn @ np.array(self.robot.upright)
        ahead = np.einsum("ij,ij->i", axis, forward) / np.linalg.norm(forward, axis=1)
        return np.arctan2(ahead, axis @ up)

    @cached_property
    def tilt(self) -> np.ndarray:
        """(n,) [rad] of the base from the vertical, whichever way it leans."""
        up = -np.array(self.gravity) / np.linalg.norm(self.gravity)
        return np.arccos(np.clip(self.turn @ np.array(self.robot.upright) @ up, -1.0, 1.0))

    @cached_property
    def above(self) -> np.ndarray:
        """(n, P) [m] of the contact points above the ground below them."""
        height = self.point[:, :, 2]
        return height if self.ground.level else height - self.ground.height(self.point[:, :, 0])

    @property
    def com_above(self) -> np.ndarray:
        """(n,) [m] of the centre of mass above the ground below it."""
        height = self.com[:, 2]
        return height if self.ground.level else height - self.ground.height(self.com[:, 0])

    @property
    def mass(self) -> float:
        """[kg] of the whole robot."""
        return self.robot.mass

    @property
    def flat(self) -> bool:
        """Whether it walked on level ground: no slope, no tiles, no steps."""
        return self.slope == 0.0 and self.side_slope == 0.0 and self.ground.level

    @cached_property
    def foot_force(self) -> np.ndarray:
        """(n, 2) [N] normal force of the ground under each foot."""
        normal, feet = self.force[:, :, 2], self.robot.of_foot
        return np.stack([normal[:, feet == foot].sum(axis=1) for foot in range(len(self.robot.feet))], axis=1)

    @cached_property
    def down(self) -> np.ndarray:
        """(n, 2) whether each foot is on the ground, by the ground's force (`biped.measure.contact`)."""
        return feet_down(self.foot_force, self.mass * GRAVITY, self.tick)

    @cached_property
    def strikes(self) -> list[Strike]:
        """Foot strikes (row, foot) of the whole run, in time order."""
        return strikes_of(self.down, self.tick)

    def strikes_in(self, span: slice) -> list[Strike]:
        """Foot strikes (row, foot) within a span of rows; rows are those of the run."""
        return [strike for strike in self.strikes if span.start <= strike[0] < span.stop]

    # Of the links and joints, as far as they are known.

    @property
    def link_speed(self) -> np.ndarray | None:
        """(2, n) [m²/s², rad²/s²] largest square of a link's speed and of its turning; None if links are not known."""
        return None

    @property
    def moving_energy(self) -> np.ndarray:
        """(n,) [J] kinetic energy of the links' centres of mass; where they are not known, of the whole mass."""
        return 0.5 * self.mass * np.einsum("ij,ij->i", self.com_velocity, self.com_velocity)

    @property
    def joint_angles(self) -> np.ndarray:
        """(n, 6) [rad] of hip, knee and ankle as seen from the side of the course; right, then left."""
        seen = partial(_from_the_side, self.way)
        trunk = seen((self.turn @ np.array(self.robot.upright))[:, None])[:, 0]
        return joint_angles(seen(self.figure), seen(ends(self.robot, self.point)), _slant(trunk))

    @property
    def joint_rates(self) -> np.ndarray:
        """(n, 6) [rad/s] of the joint angles."""
        angles = self.joint_angles
        return np.gradient(angles, self.tick, axis=0) if len(self) > 1 else np.zeros_like(angles)

    @property
    def joint_torques(self) -> np.ndarray:
        """(n, 6) [N m] that act on the joint angles: of the drives that turn hip, knee and ankle in the way's plane."""
        out = np.zeros((len(self), LEGS * SEGMENTS))
        for joint, drive in self.robot.pitching_drives if self.has_torques else ():
            out[:, joint] = self.robot.drives[drive].turns * self.u[:, drive]
        return out

    def qpos(self, model: mujoco.MjModel) -> np.ndarray:
        """(n, nq) coordinates as a MuJoCo model of the robot has them."""
        return self.q


def mean_powers(forces: np.ndarray, rates: np.ndarray) -> np.ndarray:
    """(n - 1, k) [W] of forces and rates (n, k) from each row to the next: at the mean of the rates before and after.

    This is what changes the kinetic energy in a step.
    """
    return forces[:-1] * 0.5 * (rates[:-1] + rates[1:])


def joint_angles(joint: np.ndarray, point: np.ndarray, trunk: np.ndarray) -> np.ndarray:
    """(n, 6) [rad] of hip, knee and ankle as seen from the side; right, then left.

    They are the thesis's: hip θ1 − θ, knee θ2 − θ1 and ankle θ3 − θ2 + π/2, anticlockwise seen from the right. Those
    of seven links are their coordinates; of other robots they are between trunk, thigh, shank and foot.

    Args:
        joint: (n, 7, 2) [m] ahead and up: hip, knee and ankle of each leg, and the trunk's upper end.
        point: (n, 4, 2) [m] toe and heel of each foot.
        trunk: (n,) [rad] of the trunk from the ground's normal, anticlockwise.
    """
    out = np.empty((len(joint), LEGS * SEGMENTS))
    for leg in range(LEGS):
        first = SEGMENTS * leg
        hip, knee, ankle = (joint[:, first + i] for i in range(SEGMENTS))
        toe, heel = point[:, ENDS * leg], point[:, ENDS * leg + 1]
        thigh, shank = _slant(hip - knee), _slant(knee - ankle)
        foot = np.unwrap(np.arctan2((toe - heel)[:, 1], (toe - heel)[:, 0]))
        out[:, first], out[:, first + 1], out[:, first + 2] = thigh - trunk, shank - thigh, foot - shank
    return out


def _from_the_side(way: np.ndarray, places: np.ndarray) -> np.ndarray:
    """(n, k, 2) ahead along the way (n, 3), and up, of places or directions (n, k, 3)."""
    return np.stack([np.einsum("ijk,ik->ij", places, way), places[..., 2]], axis=2)


def _slant(along: np.ndarray) -> np.ndarray:
    """(n,) [rad] of vectors (n, 2) from upright, anticlockwise positive."""
    return np.unwrap(np.arctan2(-along[:, 0], along[:, 1]))
