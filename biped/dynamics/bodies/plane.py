"""Mechanisms in the plane: a body is its origin and the cosine and sine of its angle, (x, y, c, s)."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from biped.base.errors import InputError
from biped.dynamics.bodies.affine import ONE, Affine, Row, inner, scaled
from biped.dynamics.bodies.mechanism import GROUND, Body, Joint, Mechanism


def _across(direction: np.ndarray) -> np.ndarray:
    return np.array([-direction[1], direction[0]])


class Plane(Mechanism):
    """A mechanism in the plane; points are given in a body's own axes [m], on the ground in the world's."""

    dimensions = 2
    coordinates = 4

    def __init__(self, *, gravity: Sequence[float] = (0.0, -9.81), name: str = "mechanism") -> None:
        """A mechanism without bodies; gravity [m/s²]."""
        super().__init__(gravity, name)

    def body(
        self,
        name: str,
        *,
        mass: float,
        inertia: float,
        at: ArrayLike,
        angle: float = 0.0,
        centre: ArrayLike = (0.0, 0.0),
        spin: float = 0.0,
        velocity: ArrayLike = (0.0, 0.0),
    ) -> Body:
        """Add a body.

        Args:
            name: Its name.
            mass: [kg]
            inertia: About its centre of mass [kg m²].
            at: Its origin in the world [m].
            angle: Of its axes [rad].
            centre: Its centre of mass in its own axes [m].
            spin: [rad/s]
            velocity: Of its origin [m/s].
        """
        mass, inertia = (self._number(f"{name}: {w}", x, True) for w, x in (("mass", mass), ("inertia", inertia)))
        angle, spin = self._number(f"{name}: angle", angle), self._number(f"{name}: spin", spin)
        g = self._numbers(f"{name}: centre", centre)
        at, velocity = self._numbers(f"{name}: at", at), self._numbers(f"{name}: velocity", velocity)
        c, s = np.cos(angle), np.sin(angle)
        M = np.diag((mass, mass, 0.0, 0.0)) + (inertia + mass * g @ g) * np.diag((0.0, 0.0, 1.0, 1.0))
        M[:2, 2:] = mass * np.array([[g[0], -g[1]], [g[1], g[0]]])
        M[2:, :2] = M[:2, 2:].T
        first = len(self._q)
        axis = [{first + 2: 1.0}, {first + 3: 1.0}]
        rigid = [scaled(inner(axis, axis, -1.0), 0.5)]
        q, v = np.array([*at, c, s]), np.array([*velocity, -spin * s, spin * c])
        body = self._add(name, q, v, M, rigid)
        self._act(0, self._place(body, g), mass * self.gravity)
        return body

    def hinge(self, name: str, one: Body, point: ArrayLike, two: Body, other: ArrayLike) -> Joint:
        """Hold a point of one body and one of another together."""
        return self._join(name, one, two, other, self._together(one, point, two, other))

    def slide(
        self,
        name: str,
        one: Body,
        point: ArrayLike,
        direction: ArrayLike,
        two: Body,
        other: ArrayLike,
        turns: bool = False,
    ) -> Joint:
        """Guide a point of the second body along a line through a point of the first.

        Args:
            name: Its name.
            one: The body with the line.
            point: A point of the line.
            direction: Of the line, in the axes of the first body; its length does not matter.
            two: The body that slides.
            other: Its point on the line.
            turns: Whether the second body is free to turn against the first; else it keeps its angle as placed.
        """
        along = self._numbers("direction", direction)
        if not np.abs(along).max() > 0.0:
            raise InputError(f"{self.name}: slide {name}: direction must not be zero")
        normal = self._turned(one, _across(along / np.linalg.norm(along)))
        rows = [inner(normal, self._between(one, point, two, other))]
        return self._join(name, one, two, other, rows if turns else [*rows, self._parallel(one, two)])

    def weld(self, name: str, one: Body, point: ArrayLike, two: Body, other: ArrayLike) -> Joint:
        """Hold two points together and the angle between two bodies as placed."""
        rows = [*self._together(one, point, two, other), self._parallel(one, two)]
        return self._join(name, one, two, other, rows)

    def torque(self, name: str, body: Body, *, torque: float, damping: float = 0.0) -> None:
        """A torque [N m] on a body, less its spin times a damping [N m s]."""
        if self._known(body) is GROUND:
            raise InputError(f"{self.name}: torque {name} needs a body that moves")
        torque, damping = self._number("torque", torque), self._number("damping", damping)
        self._torques.append((self._force(name), body.first, torque, damping))

    def angle(self, q: np.ndarray, body: Body) -> np.ndarray:
        """(K,) angle of a body [rad] in the states q (K, n), without jumps; samples less than half a turn apart."""
        q = np.atleast_2d(q)
        return np.unwrap(np.arctan2(q[:, body.first + 3], q[:, body.first + 2]))

    def _parallel(self, one: Body, two: Body) -> Row:
        """The row that keeps the angle between two bodies as placed: sine of what it is off by."""
        here = self._turned(one, np.array([1.0, 0.0]))
        x, y = self._values(here)
        axes = np.array([self._values(self._turned(two, e)) for e in np.eye(2)])
        return inner(here, self._turned(two, axes @ np.array([-y, x])))

    def _place(self, body: Body, point: ArrayLike) -> list[Affine]:
        x, y = self._numbers("point", point)
        if self._known(body) is GROUND:
            return [{ONE: x}, {ONE: y}]
        i = body.first
        return [{i: 1.0, i + 2: x, i + 3: -y}, {i + 1: 1.0, i + 3: x, i + 2: y}]

    def _moment(self, state: np.ndarray, load: np.ndarray, arm: np.ndarray) -> np.ndarray:
        own = state[:, 2] * load[:, 3] - state[:, 3] * load[:, 2]
        return own + arm[:, 0] * load[:, 1] - arm[:, 1] * load[:, 0]
