"""What a run of a robot of any kind leaves behind: arrays with names, shapes and units, one row per control tick."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Self

import msgspec
import mujoco
import numpy as np

from biped.measure.logged import Logged
from biped.robot.ground import LEVEL, Profile, profile_from
from biped.robot.load import robot_from
from biped.robot.robot import Robot

KIND = "general"
"""What a file says that it is a trajectory of."""

UNITS = {
    "time": "s", "q": "m, rad", "v": "m/s, rad/s", "u": "N m", "point": "m", "force": "N", "contact": "0 or 1",
    "com": "m", "com_velocity": "m/s", "base": "m, then quaternion (w first)", "figure": "m", "ground_force": "N",
    "energy": "J", "work": "J", "given": "J",
}  # fmt: skip
"""Units of the quantities of `columns_of`."""


def columns_of(robot: Robot) -> dict[str, tuple[int, tuple[int, ...]]]:
    """First column of each quantity in the log, and its shape."""
    nq, nv, nu, points = len(robot.q_names), len(robot.v_names), len(robot.drives), len(robot.of_foot)
    shapes: dict[str, tuple[int, ...]] = {
        "time": (), "q": (nq,), "v": (nv,), "u": (nu,), "point": (points, 3), "force": (points, 3),
        "contact": (points,), "com": (3,), "com_velocity": (3,), "base": (7,), "figure": (7, 3), "ground_force": (3,),
        "energy": (), "work": (), "given": (),
    }  # fmt: skip
    out, first = {}, 0
    for name, shape in shapes.items():
        out[name] = first, shape
        first += math.prod(shape)
    return out


def width_of(robot: Robot) -> int:
    """Columns of the log, a law's own signals aside."""
    first, shape = list(columns_of(robot).values())[-1]
    return first + math.prod(shape)


@dataclass(frozen=True, eq=False)
class GeneralTrajectory(Logged):
    """One run.

    Attributes:
        log: (n, width + signals) one row per control tick; see the properties.
        tick: [s] between rows.
        slope: [degrees].
        side_slope: [degrees].
        gravity: [m/s²] in the ground's frame, which everything is in.
        generalized: Whether the law's forces were no torques of actuators.
        torque_limit: [N m] of the actuators.
        pushes: Pushes as (start [s], end [s], forward [N], left [N], up [N], body), horizontally and up.
        end: `completed`, `fell`, `diverged` or `raised`.
        cause: How it ended, in words; empty if completed.
        warnings: The engine's warnings, name to count.
        robot: What walked.
        sampled: Whether forces and works are those of the end of a step that has several stages.
        signal_names: Of what a law logged.
        traceback: Where a law of the user's own raised; empty if it did not.
        ground: The line of the ground's height, the same all along y.
        changes: When changes of the scenario began [s].
    """

    log: np.ndarray
    tick: float
    slope: float
    side_slope: float
    gravity: tuple[float, float, float]
    generalized: bool
    torque_limit: tuple[float, ...]
    pushes: tuple[tuple[float, float, float, float, float, str], ...]
    end: str
    cause: str
    warnings: dict[str, int]
    robot: Robot
    sampled: bool = False
    signal_names: tuple[str, ...] = ()
    traceback: str = ""
    ground: Profile = LEVEL
    changes: tuple[float, ...] = ()

    @cached_property
    def columns(self) -> dict[str, tuple[int, tuple[int, ...]]]:
        """First column of each quantity, and its shape."""
        return columns_of(self.robot)

    @property
    def width(self) -> int:
        """Columns of the log, a law's own signals aside."""
        return width_of(self.robot)

    @property
    def units(self) -> dict[str, str]:
        """Unit of each array by its name."""
        return UNITS

    @property
    def q(self) -> np.ndarray:
        """(n, nq) coordinates, of the names `robot.q_names`."""
        return self.column("q")

    @property
    def v(self) -> np.ndarray:
        """(n, nv) velocities, of the names `robot.v_names`."""
        return self.column("v")

    @property
    def u(self) -> np.ndarray:
        """(n, nu) torques [N m] of the actuators at their joints, means of the steps after each row."""
        return self.column("u")

    @property
    def point(self) -> np.ndarray:
        """(n, P, 3) [m] contact points."""
        return self.column("point")

    @property
    def force(self) -> np.ndarray:
        """(n, P, 3) [N] ground forces on them, means of the steps after each row."""
        return self.column("force")

    @property
    def contact(self) -> np.ndarray:
        """(n, P) whether they touch the ground (0 or 1)."""
        return self.column("contact")

    @property
    def com(self) -> np.ndarray:
        """(n, 3) [m] centre of mass of the whole robot."""
        return self.column("com")

    @property
    def com_velocity(self) -> np.ndarray:
        """(n, 3) [m/s]."""
        return self.column("com_velocity")

    @property
    def base(self) -> np.ndarray:
        """(n, 7) place [m] and orientation (quaternion, w first) of the base."""
        return self.column("base")

    @property
    def figure(self) -> np.ndarray:
        """(n, 7, 3) [m] hip, knee and ankle of each leg, and the trunk's upper end."""
        return self.column("figure")

    @property
    def x(self) -> np.ndarray:
        """(n,) [m] of the base, forward."""
        return self.base[:, 0]

    @property
    def ground_force(self) -> np.ndarray:
        """(n, 3) [N] force of the ground on all of the robot, feet or not, means of the steps after each row."""
        return self.column("ground_force")

    @property
    def energy(self) -> np.ndarray:
        """(n,) [J] kinetic and potential."""
        return self.column("energy")

    @property
    def work(self) -> np.ndarray:
        """(n,) [J] of everything but gravity and springs in the steps after each row."""
        return self.column("work")

    @property
    def given(self) -> np.ndarray:
        """(n,) [J] of actuators and pushes in the steps after each row."""
        return self.column("given")

    @property
    def turn(self) -> np.ndarray:
        """(n, 3, 3) axes of the base, as columns."""
        w, x, y, z = self.base[:, 3:].T
        return np.stack(
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y),
             2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
             2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)], axis=1,
        ).reshape(-1, 3, 3)  # fmt: skip

    @property
    def mass(self) -> float:
        """[kg] of the whole robot."""
        return self.robot.mass

    @property
    def foot_force(self) -> np.ndarray:
        """(n, 2) [N] normal force of the ground under each foot."""
        feet, normal = self.robot.of_foot, self.force[:, :, 2]
        return np.stack([normal[:, feet == i].sum(axis=1) for i in range(len(self.robot.feet))], axis=1)

    @property
    def above(self) -> np.ndarray:
        """(n, P) [m] of the contact points above the ground below them."""
        point = self.point
        return point[:, :, 2] - self.ground.height(point[:, :, 0])

    @property
    def power(self) -> np.ndarray:
        """(n, nu) [W] of the actuators."""
        return self.u * self.v[:, self.robot.columns]

    def qpos(self, model: mujoco.MjModel) -> np.ndarray:
        """(n, nq) coordinates as a MuJoCo model of the robot has them."""
        return self.q

    def rows(self, which: slice | np.ndarray, **changes: Any) -> Self:
        """Some rows as a trajectory of its own, with other attributes changed."""
        return replace(self, log=self.log[which], **changes)

    @property
    def about(self) -> dict[str, Any]:
        """All but the arrays, as JSON can hold it."""
        return self.ground.as_dict | ({"changes": self.changes} if self.changes else {}) | {
            "kind": KIND, "tick": self.tick, "slope": self.slope, "side_slope": self.side_slope,
            "gravity": self.gravity, "generalized": self.generalized, "torque_limit": self.torque_limit,
            "pushes": self.pushes,
            "end": self.end, "cause": self.cause, "warnings": self.warnings, "sampled": self.sampled,
            "traceback": self.traceback,
            "signal_names": self.signal_names, "robot": msgspec.to_builtins(self.robot),
        }  # fmt: skip

    def save(self, path: Path) -> None:
        """Writes the arrays by name, and all else as JSON, into one npz file; the same bytes for the same run."""
        arrays: dict[str, Any] = {name: self.column(name) for name in self.columns}
        if self.signal_names:
            arrays["signals"] = self.log[:, self.width :]
        with open(path, "wb") as file:
            np.savez(file, about=np.array(json.dumps(self.about)), **arrays)


def made_of(about: dict[str, Any], log: np.ndarray) -> GeneralTrajectory:
    """The trajectory that `about` and its log say.

    Raises:
        ValueError: They do not fit.
    """
    about = dict(about)
    about.pop("kind")
    about["robot"] = robot_from(about["robot"])
    about["ground"] = profile_from(about.pop("ground", None))
    about["changes"] = about.get("changes", ())
    for name in ("gravity", "torque_limit", "signal_names", "changes"):
        about[name] = tuple(about[name])
    about["pushes"] = tuple(tuple(push) for push in about["pushes"])
    found = GeneralTrajectory(log=log, **about)
    if log.shape[1:] != (found.width + len(found.signal_names),) or len(log) == 0 or not found.tick > 0.0:
        raise ValueError(f"arrays of {log.shape}")
    return found


def loaded(about: dict[str, Any], arrays: Mapping[str, np.ndarray]) -> GeneralTrajectory:
    """The trajectory that `save` wrote.

    Raises:
        KeyError: An array is missing.
        ValueError: They do not fit.
    """
    robot = robot_from(about["robot"])
    n = len(arrays["time"])
    names = (*columns_of(robot), *(("signals",) if about["signal_names"] else ()))
    return made_of(about, np.hstack([np.asarray(arrays[name], dtype=float).reshape(n, -1) for name in names]))
