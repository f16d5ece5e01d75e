"""The trajectory of seven links in a plane, whose true places and energies follow from coordinates and forces."""

from __future__ import annotations

import math
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from biped.measure.planar import Derived, Forces, derive
from biped.measure.pushes import declared
from biped.measure.trajectory import Trajectory, mean_powers
from biped.robot.gravity import gravity
from biped.robot.planar.topology import BASE, CHAINS, PITCH, X
from biped.robot.planar.tree import motion
from biped.robot.robot import Robot, seven_links

if TYPE_CHECKING:
    import mujoco


class PlanarTrajectory(Trajectory):
    """A run of seven links in a plane."""

    @cached_property
    def derived(self) -> Derived:
        """True columns, which are not logged."""
        slope = math.radians(self.slope)
        c, s = math.cos(slope), math.sin(slope)
        pushes = [
            (round(start / self.tick), round(end / self.tick), forward * c + up * s, up * c - forward * s,
             self.robot.bodies.index(body))
            for start, end, (forward, _, up), body in declared(self) if body in self.robot.bodies
        ]  # fmt: skip
        seat = np.empty((0, 3)) if self.seat_force is None else self.seat_force
        acting = Forces(self.generalized, gravity(self.slope), np.array(pushes, dtype=float).reshape(-1, 5), seat)
        return derive(self.log, self.tick, self.tree, acting)

    def _true(self, name: str) -> np.ndarray:
        return getattr(self.derived, name)

    @property
    def _outside(self) -> np.ndarray:
        return self.derived.outside

    @cached_property
    def contact(self) -> np.ndarray:
        """(n, 4) whether the contact points touch the ground (0 or 1)."""
        return (self.above <= 0.0).astype(float)

    @cached_property
    def ground_force(self) -> np.ndarray:
        """(n, 3) [N] force of the ground on all of the robot in the steps after each row."""
        return np.einsum("ijk->ik", self.force)

    @cached_property
    def base(self) -> np.ndarray:
        """(n, 7) place [m] and orientation (quaternion, w first) of the base."""
        out, half = np.zeros((len(self), 7)), 0.5 * self.q[:, PITCH]
        out[:, 0], out[:, 2], out[:, 3], out[:, 5] = self.q[:, 0], self.q[:, 1], np.cos(half), -np.sin(half)
        return out

    @cached_property
    def figure(self) -> np.ndarray:
        """(n, 7, 3) [m] hip, knee and ankle of each leg, and the trunk's upper end."""
        pose = motion(self.tree, self.q, self.v)
        joints = pose.joint[:, [link for chain in CHAINS for link in chain[1:]]]
        c, s = np.cos(self.q[:, PITCH]), np.sin(self.q[:, PITCH])
        x, _, z = self.robot.top
        top = pose.joint[:, 0] + np.stack([c * x - s * z, s * x + c * z], axis=1)
        out = np.zeros((len(self), joints.shape[1] + 1, 3))
        out[..., [0, 2]] = np.concatenate([joints, top[:, None]], axis=1)
        return out

    @property
    def x(self) -> np.ndarray:
        """(n,) [m] of the base, along the ground."""
        return self.q[:, X]

    @property
    def y(self) -> np.ndarray:
        """(n,) [m] of the base, to the left: none."""
        return np.zeros(len(self))

    @cached_property
    def lean(self) -> np.ndarray:
        """(n,) [rad] of the base from the vertical, forward positive."""
        return -self.q[:, PITCH] - math.radians(self.slope)

    @cached_property
    def tilt(self) -> np.ndarray:
        """(n,) [rad] of the base from the vertical, whichever way it leans."""
        up, half = -np.array(self.gravity) / np.linalg.norm(self.gravity), 0.5 * self.q[:, PITCH]
        s, axis = -np.sin(half), np.zeros((len(self), 3))
        axis[:, 0], axis[:, 2] = 2 * (np.cos(half) * s), 1 - 2 * (s * s)
        return np.arccos(np.clip(axis @ up, -1.0, 1.0))

    @property
    def foot_force(self) -> np.ndarray:
        """(n, 2) [N] normal force of the ground under each foot."""
        return self.derived.foot_force.T

    @property
    def spent(self) -> np.ndarray:
        """(n,) [J] of the sum of actuators' powers and of that of pushes, either way."""
        return self.derived.spent

    @property
    def has_torques(self) -> bool:
        """Whether the torques of the actuators are known: of Q_d that acts itself, too."""
        return True

    @property
    def net_power(self) -> np.ndarray:
        """(n - 1,) [W] mean sum of the powers of all that the law does from each row to the next."""
        return mean_powers(self.applied, self.v).sum(axis=1)

    @property
    def link_speed(self) -> np.ndarray:
        """(2, n) [m²/s², rad²/s²] largest square of a link's speed and of its turning."""
        return self.derived.speed

    @property
    def moving_energy(self) -> np.ndarray:
        """(n,) [J] kinetic energy of the links' centres of mass."""
        return self.derived.moving

    @property
    def joint_angles(self) -> np.ndarray:
        """(n, 6) [rad] of hip, knee and ankle; right, then left."""
        return self.q[:, BASE:]

    @property
    def joint_rates(self) -> np.ndarray:
        """(n, 6) [rad/s] of the joint angles."""
        return self.v[:, BASE:]

    @property
    def joint_torques(self) -> np.ndarray:
        """(n, 6) [N m] that act on the joint angles."""
        return self.applied[:, BASE:]

    def qpos(self, model: mujoco.MjModel) -> np.ndarray:
        """(n, 9) coordinates as a MuJoCo model of the robot has them."""
        from biped.robot.planar.order import order_of

        out = np.empty_like(self.q)
        out[:, order_of(model, seven_links(self.robot)).joints] = self.q
        return out


def kind_of(robot: Robot) -> type[Trajectory]:
    """Returns the class of a robot's trajectories."""
    return Trajectory if robot.seven_links is None else PlanarTrajectory
