"""The trajectory of a run of any robot: arrays with names, shapes and units, one row per control tick.

The robot says which columns are logged (`biped.measure.columns`). What is true of places, forces and energy exists for
every robot: logged where its plant knows it, otherwise computed once from coordinates and velocities.
"""

from __future__ import annotations

import json
import math
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import msgspec
import numpy as np

from biped.measure.columns import UNITS, Columns, columns_of, width_of
from biped.measure.contact import Strike, feet_down, strikes_of
from biped.measure.planar import Derived, Forces, derive
from biped.robot.gravity import GRAVITY, gravity
from biped.robot.ground import LEVEL, Profile
from biped.robot.planar.topology import BASE, CHAINS, PITCH
from biped.robot.planar.tree import Tree, motion
from biped.robot.robot import Robot, seven_links
from biped.scenario.ground import Seat

if TYPE_CHECKING:
    import mujoco


@dataclass(frozen=True, eq=False)
class Trajectory:
    """One run.

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

    # What is true, of every robot.

    @cached_property
    def derived(self) -> Derived:
        """True columns of seven links, which are not logged."""
        slope = math.radians(self.slope)
        c, s = math.cos(slope), math.sin(slope)
        pushes = [
            (round(start / self.tick), round(end / self.tick), force[0] * c + force[-1] * s,
             force[-1] * c - force[0] * s, self.robot.bodies.index(body))
            for start, end, *force, body in self.pushes if body in self.robot.bodies
        ]  # fmt: skip
        seat = np.empty((0, 3)) if self.seat_force is None else self.seat_force
        acting = Forces(self.generalized, gravity(self.slope), np.array(pushes, dtype=float).reshape(-1, 5), seat)
        return derive(self.log, self.tick, self.tree, acting)

    def _true(self, name: str) -> np.ndarray:
        """A true quantity: logged, or derived in the plane."""
        return self.column(name) if name in self.columns else getattr(self.derived, name)

    @cached_property
    def point(self) -> np.ndarray:
        """(n, P, 3) [m] contact points."""
        return self._true("point")

    @cached_property
    def force(self) -> np.ndarray:
        """(n, P, 3) [N] ground forces on them in the step after each row: along the ground, to the left, normal."""
        return self.column("force") if self.robot.seven_links is None else self.derived.force

    @cached_property
    def contact(self) -> np.ndarray:
        """(n, P) whether they touch the ground (0 or 1)."""
        return self.column("contact") if "contact" in self.columns else (self.above <= 0.0).astype(float)

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

    @cached_property
    def ground_force(self) -> np.ndarray:
        """(n, 3) [N] force of the ground on all of the robot, feet or not, in the steps after each row."""
        return self.column("ground_force") if "ground_force" in self.columns else np.einsum("ijk->ik", self.force)

    @cached_property
    def base(self) -> np.ndarray:
        """(n, 7) place [m] and orientation (quaternion, w first) of the base."""
        if "base" in self.columns:
            return self.column("base")
        out, half = np.zeros((len(self), 7)), 0.5 * self.q[:, PITCH]
        out[:, 0], out[:, 2], out[:, 3], out[:, 5] = self.q[:, 0], self.q[:, 1], np.cos(half), -np.sin(half)
        return out

    @cached_property
    def figure(self) -> np.ndarray:
        """(n, 7, 3) [m] hip, knee and ankle of each leg, and the trunk's upper end."""
        if "figure" in self.columns:
            return self.column("figure")
        pose = motion(self.tree, self.q, self.v)
        joints = pose.joint[:, [link for chain in CHAINS for link in chain[1:]]]
        c, s = np.cos(self.q[:, PITCH]), np.sin(self.q[:, PITCH])
        x, _, z = self.robot.top
        top = pose.joint[:, 0] + np.stack([c * x - s * z, s * x + c * z], axis=1)
        return _in_space(np.concatenate([joints, top[:, None]], axis=1))

    @cached_property
    def spin(self) -> np.ndarray | None:
        """(n, 3) [N m s] angular momentum about the centre of mass; None where it is not known."""
        return None if (known := self._outside) is None else known[:, :3]

    @cached_property
    def wrench(self) -> np.ndarray | None:
        """(n, 6) [N, N m] of all that may act from outside but gravity, in the steps after each row; see `outside`."""
        return None if (known := self._outside) is None else known[:, 3:]

    @property
    def _outside(self) -> np.ndarray | None:
        return self.outside if "com" in self.columns else self.derived.outside

    @property
    def x(self) -> np.ndarray:
        """(n,) [m] of the base, along the ground."""
        return self.q[:, 0] if self.robot.seven_links is not None else self.base[:, 0]

    @property
    def forward_speed(self) -> np.ndarray:
        """(n,) [m/s] of the base, along the ground."""
        return self.v[:, self.robot.base_columns[0]]

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
    def lean(self) -> np.ndarray:
        """(n,) [rad] of the base from the vertical, forward positive."""
        if self.robot.seven_links is not None:
            return -self.q[:, PITCH] - math.radians(self.slope)
        up = -np.array(self.gravity) / np.linalg.norm(self.gravity)
        forward = np.array([1.0, 0.0, 0.0]) - up[0] * up
        axis = self.turn @ np.array(self.robot.upright)
        return np.arctan2(axis @ forward / np.linalg.norm(forward), axis @ up)

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
        if self.robot.seven_links is not None:
            return self.derived.foot_force.T
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

    # What the law of seven links believed, and what acted on them.

    @property
    def tree(self) -> Tree:
        """Lengths and masses of seven links.

        Raises:
            InputError: It is another robot.
        """
        return seven_links(self.robot).tree

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

    @property
    def applied(self) -> np.ndarray:
        """(n, 9) generalized forces that acted on seven links: Q_d itself, or the joint torques."""
        if self.generalized:
            return self.Q_d
        return np.hstack([np.zeros((len(self), BASE)), self.u])

    def qpos(self, model: mujoco.MjModel) -> np.ndarray:
        """(n, nq) coordinates as a MuJoCo model of the robot has them."""
        if self.robot.seven_links is None:
            return self.q
        from biped.robot.planar.order import order_of

        out = np.empty_like(self.q)
        out[:, order_of(model, self.robot.seven_links).joints] = self.q
        return out

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


def _in_space(planar: np.ndarray) -> np.ndarray:
    """(…, 3) of vectors (…, 2) in the plane, with 0 to the left."""
    out = np.zeros((*planar.shape[:-1], 3))
    out[..., 0], out[..., 2] = planar[..., 0], planar[..., 1]
    return out
