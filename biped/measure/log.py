"""The log of a run of any robot: arrays with names, shapes and units, one row per control tick, and their facts.

The robot says which columns are logged (`biped.robot.columns`).
"""

import json
import math
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Self

import msgspec
import numpy as np

from biped.robot.columns import UNITS, Columns, columns_of, width_of
from biped.robot.ground import LEVEL, Profile, gravity
from biped.robot.planar.topology import BASE
from biped.robot.planar.tree import Tree
from biped.robot.robot import Robot, seven_links
from biped.scenario.world import Seat


@dataclass(frozen=True, eq=False)
class Log:
    """The columns that a run logged, and the facts that belong to them.

    Attributes:
        log: (n, width + signals) one row per control tick; see the properties.
        tick: [s] between rows.
        slope: [degrees].
        generalized: Whether the law's forces were no torques of actuators.
        torque_limit: (nu,) limits of the actuators [N m].
        pushes: Pushes as (start [s], end [s], forward [N], up [N], body), those that change in pieces; in space
            forward, to the left and up.
        end: `completed`, `fell`, `diverged` or `raised` (a law of the user's own failed).
        cause: How it ended, in words; empty if completed.
        warnings: The engine's warnings, name to count.
        robot: What walked, with its true lengths and masses.
        sampled: Whether forces are those of one of several steps or stages in each tick, not the mean of all.
        inferred: (n, 4) what an estimator made of the torso: pitch [rad], its rate [rad/s], whether it rests on the
            gyro, and whether that was clipped (`biped.control.planar.estimator`); None without one.
        signal_names: Of what a law of the user's own logged.
        traceback: Where a law of the user's own raised; empty if it did not.
        ground: The line of the ground's height along the way, the same all along y.
        changes: When changes of the scenario began [s].
        seat: What it could sit on; None without a seat.
        seat_force: (n, 3) of the seat on the pelvis in the step after each row: along the ground and normal to it [N],
            and its moment about the torso's origin [N m]; None likewise, and of a run that was kept packed.
        outside: (n, 9) angular momentum about the centre of mass [N m s]; force [N] and moment about it [N m], in the
            step after each row, of all that may act from outside: ground and declared pushes, and a law's forces on
            the base where the scenario asks for generalized ones. None of seven links, where it is derived, and of a
            run that was kept packed or by an earlier version.
        side_slope: [degrees].
        gravity: [m/s²] in the ground's frame, which everything is in; default: of the slope.
        account: (n,) [J] work of everything but gravity and springs in the tick after each row, as an engine summed it
            over the several steps that it takes in a tick; None: it follows from the rows.
    """

    log: np.ndarray
    tick: float
    slope: float
    generalized: bool
    torque_limit: tuple[float, ...]
    pushes: tuple[tuple[Any, ...], ...]
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
    outside: np.ndarray | None = None
    side_slope: float = 0.0
    gravity: tuple[float, ...] = ()
    account: np.ndarray | None = None

    def __post_init__(self):
        if not self.gravity:
            along, normal = gravity(self.slope)
            object.__setattr__(self, "gravity", (along, 0.0, normal))

    def __len__(self) -> int:
        return len(self.log)

    @cached_property
    def columns(self) -> Columns:
        """First column of each quantity that is logged, and its shape."""
        return columns_of(self.robot)

    @property
    def width(self) -> int:
        """Columns of the log, a law's own signals aside."""
        return width_of(self.robot)

    @property
    def units(self) -> dict[str, str]:
        """Unit of each array by its name."""
        return UNITS

    def column(self, name: str) -> np.ndarray:
        """A logged quantity as an array (n, *shape); a view."""
        first, shape = self.columns[name]
        if not shape:
            return self.log[:, first]
        return self.log[:, first : first + math.prod(shape)].reshape(len(self.log), *shape)

    @property
    def time(self) -> np.ndarray:
        """(n,) [s]."""
        return self.column("time")

    @property
    def q(self) -> np.ndarray:
        """(n, nq) coordinates [m, rad], of the names `robot.q_names`."""
        return self.column("q")

    @property
    def v(self) -> np.ndarray:
        """(n, nv) velocities [m/s, rad/s], of the names `robot.v_names`."""
        return self.column("v")

    @property
    def u(self) -> np.ndarray:
        """(n, nu) torques [N m] of the actuators at their joints, in the step after each row."""
        return self.column("u")

    @property
    def rate(self) -> np.ndarray:
        """(n, nu) [rad/s] of the driven joints."""
        return self.v[:, self.robot.columns]

    @property
    def signals(self) -> dict[str, np.ndarray]:
        """Signals of a law of the user's own: name to (n,), nan where it said nothing."""
        return {name: self.log[:, self.width + i] for i, name in enumerate(self.signal_names)}

    @property
    def sound(self) -> np.ndarray:
        """(n,) whether every number of a row is finite, a law's own signals aside."""
        return np.all(np.isfinite(self.log[:, : self.width]), axis=1)

    # Of seven links and their law.

    @property
    def tree(self) -> Tree:
        """Lengths and masses of seven links.

        Raises:
            InputError: It is another robot.
        """
        return seven_links(self.robot).tree

    @property
    def applied(self) -> np.ndarray:
        """(n, 9) generalized forces that acted on seven links: Q_d itself, or the joint torques."""
        if self.generalized:
            return self.Q_d
        return np.hstack([np.zeros((len(self), BASE)), self.u])

    @property
    def Q_d(self) -> np.ndarray:
        """(n, 9) desired generalized forces of seven links in joint coordinates [N, N m]."""
        return self.column("Q_d")

    @property
    def phase(self) -> np.ndarray:
        """(n, 2) leg states 1 … 4 that the law of seven links believed in, right and left."""
        return self.column("phase")

    @property
    def believed_states(self) -> np.ndarray | None:
        """(n, 2) leg states 1 … 4 that the law believed in, of one that logs them as columns or as signals."""
        if "phase" in self.columns:
            return self.phase
        names = [f"{leg}_state" for leg in self.robot.legs]
        if not all(name in self.signal_names for name in names):
            return None
        return np.stack([self.signals[name] for name in names], axis=1)

    @property
    def believed(self) -> np.ndarray:
        """(n, 4) contacts that these follow (0 or 1): right toe, right heel, left toe, left heel."""
        return self.column("believed")

    @property
    def active(self) -> np.ndarray:
        """(n, 6) constraints in A after the release test (0 or 1): the four points, right and left knee."""
        return self.column("active")

    @property
    def height(self) -> np.ndarray:
        """(n, 4) [m] heights of the points as the law sensed them."""
        return self.column("height")

    @property
    def stop(self) -> np.ndarray:
        """(n, 2) [N m] torques of the knee stops, right and left."""
        return self.column("stop")

    def rows(self, which: slice | np.ndarray, **changes: Any) -> Self:
        """Some rows as a trajectory of its own, with other attributes changed."""
        inferred = None if self.inferred is None else self.inferred[which]
        seat_force = None if self.seat_force is None else self.seat_force[which]
        account = None if self.account is None else self.account[which]
        outside = None if self.outside is None else self.outside[which]
        parts = {"inferred": inferred, "seat_force": seat_force, "account": account, "outside": outside}
        return replace(self, log=self.log[which], **parts, **changes)

    def last(self, seconds: float) -> Self:
        """The end of the run as a trajectory of its own; times stay those of the run."""
        return self.rows(slice(-max(1, round(seconds / self.tick)), None))

    @property
    def about(self) -> dict[str, Any]:
        """All but the arrays, as JSON can hold it; what few runs have, only of those that have it."""
        return {
            "tick": self.tick, "slope": self.slope, "side_slope": self.side_slope, "gravity": self.gravity,
            "generalized": self.generalized, "torque_limit": self.torque_limit, "pushes": self.pushes,
            "end": self.end, "cause": self.cause, "warnings": self.warnings, "sampled": self.sampled,
            "signal_names": self.signal_names, "traceback": self.traceback,
            "robot": msgspec.to_builtins(self.robot),
            **({"changes": self.changes} if self.changes else {}),
            **self.ground.as_dict,
            **({} if self.seat is None else {"seat": msgspec.to_builtins(self.seat)}),
        }  # fmt: skip

    def save(self, path: Path) -> None:
        """Writes the arrays by name, and all else as JSON, into one npz file; the same bytes for the same run."""
        arrays: dict[str, Any] = {name: self.column(name) for name in self.columns}
        if self.inferred is not None:
            arrays["inferred"] = self.inferred
        if self.seat is not None:
            arrays["seat_force"] = self.seat_force
        if self.account is not None:
            arrays["account"] = self.account
        if self.outside is not None:
            arrays["outside"] = self.outside
        if self.signal_names:
            arrays["signals"] = self.log[:, self.width :]
        with open(path, "wb") as file:
            np.savez(file, about=np.array(json.dumps(self.about)), **arrays)
