"""Bodies, joints and forces of mechanisms in the plane or in space, and the system they make."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from biped.base.errors import InputError
from biped.dynamics.bodies import tables
from biped.dynamics.bodies.affine import ONE, Affine, Row, inner, linear, plus, scaled
from biped.dynamics.system import ConstrainedSystem
from biped.dynamics.trajectory import Solution


class Body(NamedTuple):
    """A body of a mechanism.

    Attributes:
        name: Its name.
        first: Its first coordinate: its origin, then its axes; negative: the ground.
    """

    name: str
    first: int


GROUND = Body("ground", -1)
"""The body that does not move; points and directions on it are the world's."""


class Joint(NamedTuple):
    """A joint of a mechanism: which bodies it ties, where on the second, and its rows of Φ."""

    name: str
    one: Body
    two: Body
    point: tuple[float, ...]
    rows: range


class Mechanism:
    """Bodies in natural coordinates (origin and axes): M constant, every constraint quadratic.

    Attributes:
        name: Name in messages.
        bodies: In the order they were added.
        joints: In the order they were added.
    """

    dimensions = 0
    coordinates = 0

    def __init__(self, gravity: Sequence[float], name: str) -> None:
        """A mechanism without bodies; gravity [m/s²] in the world's axes."""
        self.name = name
        self.gravity = self._numbers("gravity", gravity)
        self.bodies: list[Body] = []
        self.joints: list[Joint] = []
        self._q: list[float] = []
        self._v: list[float] = []
        self._rows: list[Row] = []
        self._mass: list[tuple[float, ...]] = []
        self._steady: list[tuple[float, ...]] = []
        self._springs: list[tuple[float, ...]] = []
        self._spans: list[tuple[float, ...]] = []
        self._torques: list[tuple[float, ...]] = []
        self._forces = ["gravity"]
        self._system: ConstrainedSystem | None = None

    @property
    def q(self) -> np.ndarray:
        """(n,) coordinates of the bodies as placed."""
        return np.array(self._q)

    @property
    def v(self) -> np.ndarray:
        """(n,) velocities of the bodies as placed."""
        return np.array(self._v)

    @property
    def system(self) -> ConstrainedSystem:
        """The system to integrate; the work of its forces is in the results, gravity's first.

        Raises:
            InputError: There is no body.
        """
        if not self.bodies:
            raise InputError(f"{self.name}: needs at least one body")
        if self._system is None:
            rows = [(r, *place, a) for r, row in enumerate(self._rows) for place, a in sorted(row.items())]
            packed = tables.pack([self._mass, rows, self._steady, self._springs, self._spans, self._torques])
            self._system = ConstrainedSystem(
                n=len(self._q),
                m=len(self._rows),
                mass=tables.mass,
                force=tables.force,
                phi=tables.phi,
                A=tables.A,
                b_v=tables.b_v,
                potential=tables.potential,
                power=tables.power,
                params=packed,
                powers=tuple(self._forces),
                name=self.name,
            )
        return self._system

    def rod(self, name: str, one: Body, point: ArrayLike, two: Body, other: ArrayLike) -> Joint:
        """A massless rod between a point of one body and one of another, as long as they are placed apart."""
        d = self._between(one, point, two, other)
        length = float(np.linalg.norm(self._values(d)))
        if not length > 0.0:
            raise InputError(f"{self.name}: rod {name} has no length")
        return self._join(name, one, two, other, [scaled(inner(d, d, -(length**2)), 0.5 / length)])

    def spring(
        self, name: str, one: Body, point: ArrayLike, two: Body, other: ArrayLike, *, stiffness: float, rest: float
    ) -> None:
        """A massless spring [N/m] of a length at rest [m] between a point of one body and one of another."""
        number, first = self._force(name), len(self._spans)
        stiffness, rest = self._number("stiffness", stiffness), self._number("rest", rest)
        for i, x in enumerate(self._between(one, point, two, other)):
            self._spans += [(i, j, a) for j, a in x.items()]
        self._springs.append((number, stiffness, rest, first, len(self._spans)))

    def push(self, name: str, body: Body, point: ArrayLike, force: ArrayLike) -> None:
        """A force [N], constant in the world's axes, on a point of a body."""
        self._act(self._force(name), self._place(body, point), self._numbers("force", force))

    def position(self, q: np.ndarray, body: Body, point: ArrayLike) -> np.ndarray:
        """(K, 2 or 3) [m] where a point of a body is, in the states q (K, n)."""
        q = np.atleast_2d(q)
        return np.stack([sum(a * (q[:, j] if j >= 0 else 1.0) for j, a in x.items()) + np.zeros(len(q))
                         for x in self._place(body, point)], axis=1)  # fmt: skip

    def joint_forces(self, motion: Solution, joint: Joint) -> tuple[np.ndarray, np.ndarray]:
        """Forces of a joint on the first of its bodies, at the samples of a motion.

        Redundant joints share their load as `reactions` says.

        Returns:
            Force (K, 2 or 3) [N] in the world's axes, and moment about the joint's point on its second body, (K,)
            in the plane, (K, 3) in space [N m].
        """
        if not any(joint is mine for mine in self.joints):
            raise InputError(f"{self.name}: {getattr(joint, 'name', joint)} is not a joint of this mechanism")
        if (motion.system.n, motion.system.m) != (self.system.n, self.system.m):
            raise InputError(f"{self.name}: the motion is that of {motion.system.name}")
        body, sign = (joint.one, 1.0) if joint.one.first >= 0 else (joint.two, -1.0)
        own = slice(body.first, body.first + self.coordinates)
        load = np.zeros((len(motion.t), self.coordinates))
        for k in range(len(motion.t)):
            rows = self.system.evaluate(motion.t[k], motion.q[k], motion.v[k]).A[joint.rows, own]
            load[k] = sign * motion.multipliers[k, joint.rows] @ rows
        state = motion.q[:, own]
        arm = state[:, : self.dimensions] - self.position(motion.q, joint.two, joint.point)
        return load[:, : self.dimensions], self._moment(state, load, arm)

    def _moment(self, state: np.ndarray, load: np.ndarray, arm: np.ndarray) -> np.ndarray:
        raise NotImplementedError

    def _place(self, body: Body, point: ArrayLike) -> list[Affine]:
        raise NotImplementedError

    def _known(self, body: Body) -> Body:
        """Refuse a body that is not one of this mechanism."""
        if body is not GROUND and not any(body is mine for mine in self.bodies):
            raise InputError(f"{self.name}: {getattr(body, 'name', body)} is not a body of this mechanism")
        return body

    def _turned(self, body: Body, direction: np.ndarray) -> list[Affine]:
        """A direction that is fixed to a body."""
        origin = self._place(body, np.zeros(self.dimensions))
        return [plus(x, o, -1.0) for x, o in zip(self._place(body, direction), origin, strict=True)]

    def _between(self, one: Body, point: ArrayLike, two: Body, other: ArrayLike) -> list[Affine]:
        """From the point of two to the point of one."""
        ends = zip(self._place(one, point), self._place(two, other), strict=True)
        return [plus(x, y, -1.0) for x, y in ends]

    def _together(self, one: Body, point: ArrayLike, two: Body, other: ArrayLike) -> list[Row]:
        """Rows that hold two points together."""
        return [linear(x) for x in self._between(one, point, two, other)]

    def _values(self, x: Sequence[Affine]) -> np.ndarray:
        """Values of sums as the bodies are placed."""
        return np.array([sum(a * (self._q[j] if j != ONE else 1.0) for j, a in sums.items()) for sums in x])

    def _add(self, name: str, q: np.ndarray, v: np.ndarray, M: np.ndarray, rigid: list[Row]) -> Body:
        """Take over a body of mass matrix M with its start and the rows that keep it rigid."""
        if any(body.name == name for body in self.bodies):
            raise InputError(f"{self.name}: two bodies called {name}")
        body = Body(name, len(self._q))
        self._q += q.tolist()
        self._v += v.tolist()
        self._mass += [
            (body.first + int(i), body.first + int(j), float(M[i, j])) for i, j in zip(*np.nonzero(M), strict=True)
        ]
        self._rows += rigid
        self.bodies.append(body)
        self._system = None
        return body

    def _join(self, name: str, one: Body, two: Body, point: ArrayLike, rows: list[Row]) -> Joint:
        if one == two:
            raise InputError(f"{self.name}: joint {name} ties {one.name} to itself")
        if any(joint.name == name for joint in self.joints):
            raise InputError(f"{self.name}: two joints called {name}")
        first = len(self._rows)
        self._rows += rows
        at = tuple(self._numbers("point", point).tolist())
        joint = Joint(name, one, two, at, range(first, len(self._rows)))
        self.joints.append(joint)
        self._system = None
        return joint

    def _force(self, name: str) -> int:
        """The number of a new force."""
        if name in self._forces:
            raise InputError(f"{self.name}: two forces called {name}")
        self._forces.append(name)
        self._system = None
        return len(self._forces) - 1

    def _act(self, number: int, place: Sequence[Affine], force: np.ndarray) -> None:
        """A constant force on a point."""
        for x, f in zip(place, force, strict=True):
            self._steady += [(number, j, a * f) for j, a in x.items() if j != ONE and f != 0.0]

    def _numbers(self, what: str, x: ArrayLike) -> np.ndarray:
        try:
            found = np.array(x, dtype=float)
        except (TypeError, ValueError):
            found = np.zeros(0)
        if found.shape != (self.dimensions,) or not np.isfinite(found).all():
            raise InputError(f"{self.name}: {what} must have {self.dimensions} finite numbers, not {x}")
        return found

    def _number(self, what: str, x: float, positive: bool = False) -> float:
        if isinstance(x, bool) or not isinstance(x, (int, float, np.integer, np.floating)) or not np.isfinite(x):
            raise InputError(f"{self.name}: {what} must be finite numbers, not {x}")
        if positive and not x > 0.0:
            raise InputError(f"{self.name}: {what} must be positive, not {x}")
        return float(x)
