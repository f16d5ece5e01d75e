"""Where a model file has the parts of a biped: MuJoCo's numbers for them, in canonical order.

A file may list legs, motors and contact pairs in any order. Engines and controllers speak the canonical one
(`biped.robot.planar.topology`); where the file's is another, the MuJoCo engine gathers and scatters by these numbers.
"""

from typing import NamedTuple

import mujoco
import numpy as np

from biped.robot.planar.description import PlanarParts
from biped.robot.planar.topology import NQ, NU


class Order(NamedTuple):
    """MuJoCo's numbers of a biped's parts.

    Attributes:
        joints: (9,) of the coordinates.
        actuators: (6,) of the motors.
        points: (4,) of the contact points' geoms.
        contacts: (4,) canonical numbers of the points, in the order in which MuJoCo lists contacts.
        stops: (2,) canonical numbers of the stops, in the order in which MuJoCo lists joint limits.
        bent: (2,) [rad] the other ends of their ranges, where a leg is bent as far as it can be; by canonical number.
    """

    joints: np.ndarray
    actuators: np.ndarray
    points: np.ndarray
    contacts: np.ndarray
    stops: np.ndarray
    bent: np.ndarray

    @property
    def canonical(self) -> bool:
        """Whether coordinates and motors are in canonical order, so that MuJoCo's own arrays will do."""
        return bool((self.joints == np.arange(NQ)).all() and (self.actuators == np.arange(NU)).all())


def order_of(model: mujoco.MjModel, robot: PlanarParts) -> Order:
    """The order of a compiled model file that has passed its check."""
    joints = np.array([model.joint(joint).dofadr[0] for joint in robot.joints])
    pairs = [robot.points.index(name) for i in range(model.npair) if (name := model.pair(i).name) in robot.points]
    return Order(
        joints=joints,
        actuators=np.array([model.actuator(motor).id for motor in robot.actuators]),
        points=np.array([model.geom(point).id for point in robot.points]),
        contacts=np.array(pairs),
        stops=np.argsort([model.joint(stop).dofadr[0] for stop in robot.stops]),
        bent=np.array([model.joint(stop).range[0] for stop in robot.stops]),
    )
