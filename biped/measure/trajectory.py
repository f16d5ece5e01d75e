"""What a run leaves behind: arrays with names, shapes and units, one row per control tick."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import msgspec
import numpy as np

from biped.base.typed import convert
from biped.measure.columns import COLUMNS, UNITS, WIDTH
from biped.measure.logged import Columns, Logged
from biped.robot.ground import LEVEL, Profile, profile_from
from biped.robot.load import robot_from
from biped.robot.planar.topology import BASE, ENDS, LEGS
from biped.robot.planar.tree import Tree
from biped.robot.robot import Robot, seven_links
from biped.scenario.ground import Seat

if TYPE_CHECKING:
    import mujoco

_LAST = ("seat", "signal_names", "traceback", "changes", "ground")
"""Of `Trajectory.about`: what npz files have behind all else, in this order, and only where there is anything."""


@dataclass(frozen=True, eq=False)
class Trajectory(Logged):
    """One run.

    Attributes:
        log: (n, WIDTH + signals) one row per control tick; see the properties.
        tick: [s] between rows.
        tree: Lengths and masses of the true model.
        slope: [degrees].
        generalized: Whether Q_d itself moved the biped.
        torque_limit: Limits of the six joint torques [N m].
        pushes: Pushes as (start [s], end [s], forward [N], up [N], body), those that change in pieces.
        end: `completed`, `fell`, `diverged` or `raised` (a law of the user's own failed).
        cause: How it ended, in words; empty if completed.
        warnings: The engine's warnings, name to count.
        robot: What walked.
        sampled: Whether `force` is that of one of several steps or stages in each tick, not the mean of all.
        inferred: (n, 4) what an estimator made of the torso: pitch [rad], its rate [rad/s], whether it rests on the
            gyro, and whether that was clipped (`biped.control.planar.estimator`); None without one.
        signal_names: Of what a law of the user's own logged.
        traceback: Where a law of the user's own raised; empty if it did not.
        ground: Heights of the ground along the slope.
        changes: When changes of the scenario began [s].
        seat: What it could sit on; None without a seat.
        seat_force: (n, 3) of the seat on the pelvis in the step after each row: along the ground and normal to it [N],
            and its moment about the torso's origin [N m]; None likewise, and of a run that was kept packed.
    """

    log: np.ndarray
    tick: float
    tree: Tree
    slope: float
    generalized: bool
    torque_limit: tuple[float, ...]
    pushes: tuple[tuple[float, float, float, float, str], ...]
    end: str
    cause: str
    warnings: dict[str, int]
    robot: Robot
    sampled: bool = False
    inferred: np.ndarray | None = None
    signal_names: tuple[str, ...] = ()
    traceback: str = ""
    ground: Profile = LEVEL
    changes: tuple[float, ...] = ()
    seat: Seat | None = None
    seat_force: np.ndarray | None = None

    @property
    def columns(self) -> Columns:
        """First column of each quantity, and its shape; the same for all runs."""
        return COLUMNS

    @property
    def width(self) -> int:
        """Columns of the log, a law's own signals aside."""
        return WIDTH

    @property
    def units(self) -> dict[str, str]:
        """Unit of each array by its name; vectors of coordinates: torso x, z, pitch, then the joints."""
        return UNITS

    @property
    def q(self) -> np.ndarray:
        """(n, 9) joint coordinates [m, rad]."""
        return self.column("q")

    @property
    def v(self) -> np.ndarray:
        """(n, 9) joint velocities [m/s, rad/s]."""
        return self.column("v")

    @property
    def u(self) -> np.ndarray:
        """(n, 6) joint torques [N m] hip, knee, ankle; right, then left."""
        return self.column("u")

    @property
    def Q_d(self) -> np.ndarray:
        """(n, 9) desired generalized forces in joint coordinates [N, N m]."""
        return self.column("Q_d")

    @property
    def phase(self) -> np.ndarray:
        """(n, 2) leg states 1 … 4, right and left."""
        return self.column("phase")

    @property
    def believed(self) -> np.ndarray:
        """(n, 4) contacts that the leg states follow (0 or 1): right toe, right heel, left toe, left heel."""
        return self.column("believed")

    @property
    def active(self) -> np.ndarray:
        """(n, 6) constraints in A after the release test (0 or 1): the four points, right and left knee."""
        return self.column("active")

    @property
    def height(self) -> np.ndarray:
        """(n, 4) [m] heights of the points as the controller sees them."""
        return self.column("height")

    @property
    def force(self) -> np.ndarray:
        """(n, 4, 2) [N] ground forces on the points (forward along the ground, normal) in the step after each row."""
        return self.column("force")

    @property
    def stop(self) -> np.ndarray:
        """(n, 2) [N m] torques of the knee stops, right and left."""
        return self.column("stop")

    @property
    def mass(self) -> float:
        """[kg] of the whole biped."""
        return float(self.tree.mass.sum())

    @property
    def foot_force(self) -> np.ndarray:
        """(n, 2) [N] normal force of the ground under the right and the left foot."""
        return self.force[:, :, 1].reshape(-1, LEGS, ENDS).sum(axis=2)

    @property
    def flat(self) -> bool:
        """Whether it walked on level ground: no slope, no tiles, no steps."""
        return self.slope == 0.0 and self.ground.level

    @property
    def applied(self) -> np.ndarray:
        """(n, 9) generalized forces that acted: Q_d itself, or the joint torques."""
        if self.generalized:
            return self.Q_d
        return np.hstack([np.zeros((len(self), BASE)), self.u])

    @property
    def x(self) -> np.ndarray:
        """(n,) [m] of the torso, along the ground."""
        return self.q[:, 0]

    def qpos(self, model: mujoco.MjModel) -> np.ndarray:
        """(n, 9) coordinates as a MuJoCo model of the robot has them."""
        from biped.robot.planar.order import order_of

        out = np.empty_like(self.q)
        out[:, order_of(model, seven_links(self.robot)).joints] = self.q
        return out

    def rows(self, which: slice | np.ndarray, **changes: Any) -> Self:
        """Some rows as a trajectory of its own, with other attributes changed."""
        inferred = None if self.inferred is None else self.inferred[which]
        seat_force = None if self.seat_force is None else self.seat_force[which]
        return replace(self, log=self.log[which], inferred=inferred, seat_force=seat_force, **changes)

    @property
    def about(self) -> dict[str, Any]:
        """All but the arrays, as JSON can hold it; what few runs have, only of those that have it."""
        return {
            "tick": self.tick, "slope": self.slope, "generalized": self.generalized,
            "torque_limit": self.torque_limit, "pushes": self.pushes,
            "end": self.end, "cause": self.cause, "warnings": self.warnings, "sampled": self.sampled,
            "signal_names": self.signal_names, "traceback": self.traceback,
            "robot": msgspec.to_builtins(self.robot),
            "tree": {name: value.tolist() for name, value in self.tree._asdict().items()},
            **({"changes": self.changes} if self.changes else {}),
            **self.ground.as_dict,
            **({} if self.seat is None else {"seat": msgspec.to_builtins(self.seat)}),
        }  # fmt: skip

    def save(self, path: Path) -> None:
        """Writes the arrays by name, and all else as JSON, into one npz file; the same bytes for the same run."""
        arrays: dict[str, Any] = {name: self.column(name) for name in COLUMNS}
        if self.inferred is not None:
            arrays["inferred"] = self.inferred
        if self.seat is not None:
            arrays["seat_force"] = self.seat_force
        if self.signal_names:
            arrays["signals"] = self.log[:, WIDTH:]
        about = self.about
        last = {name: about.pop(name, None) for name in _LAST}
        about |= {name: value for name, value in last.items() if value}
        with open(path, "wb") as file:
            np.savez(file, about=np.array(json.dumps(about)), **arrays)


def made_of(
    about: dict[str, Any], log: np.ndarray, inferred: np.ndarray | None = None, seat_force: np.ndarray | None = None
) -> Trajectory:
    """The trajectory that `Trajectory.about` and its arrays say.

    Raises:
        KeyError: Something is missing.
        TypeError: Something is there that is nothing of a trajectory's.
        ValueError: They do not fit.
    """
    about = dict(about)
    about["robot"] = robot_from(about.get("robot"), about["tree"])
    about["tree"] = Tree(**{name: np.array(value, dtype=float) for name, value in about["tree"].items()})
    about["torque_limit"] = tuple(about["torque_limit"])
    about["signal_names"] = tuple(about.get("signal_names", ()))
    about["pushes"] = tuple(tuple(push) for push in about["pushes"])
    about["changes"] = tuple(about.get("changes", ()))
    about["ground"] = profile_from(about.get("ground"))
    about["seat"] = convert(about["seat"], Seat) if "seat" in about else None
    found = Trajectory(log=log, inferred=inferred, seat_force=seat_force, **about)
    shape = (len(log), WIDTH + len(found.signal_names))
    if log.shape != shape or log.dtype != np.float64 or len(log) == 0 or not found.tick > 0.0:
        raise ValueError(f"arrays of {log.shape}, {log.dtype}")
    return found


def loaded(about: dict[str, Any], arrays: Mapping[str, np.ndarray]) -> Trajectory:
    """The trajectory that `save` wrote.

    Raises:
        KeyError: Something is missing.
        ValueError: They do not fit.
    """
    n = len(arrays["time"])
    names = (*COLUMNS, *(("signals",) if "signal_names" in about else ()))
    log = np.hstack([arrays[name].reshape(n, -1) for name in names])
    inferred = np.array(arrays["inferred"], dtype=float).reshape(n, 4) if "inferred" in arrays else None
    seat_force = np.array(arrays["seat_force"], dtype=float).reshape(n, 3) if "seat" in about else None
    return made_of(about, log, inferred, seat_force)
