"""Mechanisms in space: a body is its origin and its three axes, twelve coordinates."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from biped.base.errors import InputError
from biped.dynamics.bodies.affine import ONE, Affine, inner, scaled
from biped.dynamics.bodies.mechanism import GROUND, Body, Joint, Mechanism

SQUARE = 1e-9
"""How far from right angles the axes of a body may be given."""


class Space(Mechanism):
    """A mechanism in space; points are given in a body's own axes [m], on the ground in the world's."""

    dimensions = 3
    coordinates = 12

    def __init__(self, *, gravity: Sequence[float] = (0.0, 0.0, -9.81), name: str = "mechanism") -> None:
        """A mechanism without bodies; gravity [m/s²]."""
        super().__init__(gravity, name)

    def body(
        self,
        name: str,
        *,
        mass: float,
        inertia: ArrayLike,
        at: ArrayLike,
        axes: ArrayLike | None = None,
        centre: ArrayLike = (0.0, 0.0, 0.0),
        spin: ArrayLike = (0.0, 0.0, 0.0),
        velocity: ArrayLike = (0.0, 0.0, 0.0),
    ) -> Body:
        """Add a body.

        Args:
            name: Its name.
            mass: [kg]
            inertia: About its centre of mass in its own axes [kg m²]: (3, 3), or the three of a diagonal one.
            at: Its origin in the world [m].
            axes: (3, 3) its axes in the world, as columns; not given: those of the world.
            centre: Its centre of mass in its own axes [m].
            spin: In the world's axes [rad/s].
            velocity: Of its origin [m/s].
        """
        mass = self._number(f"{name}: mass", mass, True)
        J = np.array(inertia, dtype=float)
        J = np.diag(J) if J.shape == (3,) else J
        if J.shape != (3, 3) or not np.isfinite(J).all() or np.abs(J - J.T).max() > SQUARE * np.abs(J).max():
            raise InputError(f"{self.name}: {name}: inertia must be 3 numbers or a symmetric matrix of 3 by 3")
        second = 0.5 * np.trace(J) * np.eye(3) - J  # ∫ l lᵀ dm
        if not np.linalg.eigvalsh(second)[0] > 0.0:
            raise InputError(
                f"{self.name}: {name}: needs an inertia with thickness: each principal one less than the others' sum"
            )
        R = np.eye(3) if axes is None else np.array(axes, dtype=float)
        if R.shape != (3, 3) or not np.abs(R.T @ R - np.eye(3)).max() < SQUARE or np.linalg.det(R) < 0.0:
            raise InputError(f"{self.name}: {name}: axes are not at right angles, of length one and right-handed")
        g = self._numbers(f"{name}: centre", centre)
        at, velocity = self._numbers(f"{name}: at", at), self._numbers(f"{name}: velocity", velocity)
        turning = np.cross(self._numbers(f"{name}: spin", spin), R.T)  # rows: velocities of the axes
        moments = np.block([[np.array([[mass]]), mass * g[None]], [mass * g[:, None], second + mass * np.outer(g, g)]])
        first = len(self._q)
        own = [[{first + 3 + 3 * i + k: 1.0} for k in range(3)] for i in range(3)]
        rigid = [scaled(inner(x, x, -1.0), 0.5) for x in own]
        rigid += [inner(own[i], own[j]) for i, j in ((0, 1), (0, 2), (1, 2))]
        q, v = np.concatenate((at, R.T.ravel())), np.concatenate((velocity, turning.ravel()))
        body = self._add(name, q, v, np.kron(moments, np.eye(3)), rigid)
        self._act(0, self._place(body, g), mass * self.gravity)
        return body

    def ball(self, name: str, one: Body, point: ArrayLike, two: Body, other: ArrayLike) -> Joint:
        """Hold a point of one body and one of another together."""
        return self._join(name, one, two, other, self._together(one, point, two, other))

    def hinge(self, name: str, one: Body, point: ArrayLike, two: Body, other: ArrayLike, axis: ArrayLike) -> Joint:
        """Hold two points together and let the bodies turn about one axis alone.

        Args:
            name: Its name.
            one: A body.
            point: Its point.
            two: Another one.
            other: Its point.
            axis: In the axes of the first body, in those of the second as it is placed; length does not matter.
        """
        u = self._numbers("axis", axis)
        if not np.abs(u).max() > 0.0:
            raise InputError(f"{self.name}: hinge {name}: axis must not be zero")
        u /= np.linalg.norm(u)
        in_world = self._values(self._turned(one, u))
        of_two = np.array([self._values(self._turned(two, e)) for e in np.eye(3)])
        turned = self._turned(two, of_two @ in_world)
        across = np.linalg.svd(u[None])[2][1:]  # two directions at right angles to u
        rows = [inner(self._turned(one, x), turned) for x in across]
        return self._join(name, one, two, other, [*self._together(one, point, two, other), *rows])

    def _place(self, body: Body, point: ArrayLike) -> list[Affine]:
        x = self._numbers("point", point)
        if self._known(body) is GROUND:
            return [{ONE: a} for a in x]
        i = body.first
        return [{i + k: 1.0, **{i + 3 + 3 * e + k: x[e] for e in range(3)}} for k in range(3)]

    def _moment(self, state: np.ndarray, load: np.ndarray, arm: np.ndarray) -> np.ndarray:
        own = sum(np.cross(state[:, i : i + 3], load[:, i : i + 3]) for i in (3, 6, 9))
        return own + np.cross(arm, load[:, :3])
