"""A gait's Poincaré section, just before the right heel strikes, and its return map through an engine.

The section is where the right heel, at the end of a swing, comes down through a height 1 mm above the one at which the
controller takes it to touch: q and v are smooth there and the leg states are about to follow from them. The state on
it is (q, v) without the torso's x, in natural units: lengths in leg lengths l, angles in rad, time in sqrt(l / g).

A run that is started on the section begins a control tick there, believes at once what it senses and starts MuJoCo's
solver cold: that makes the return map a function of (q, v) alone. With hold times of zero, as in the generalized
scenarios, (q, v) is all there is to know anyway, but for where in a tick the section is crossed; with hold times, what
the controller remembers of a contact change less than a hold time ago is lost by such a start.

A walker cannot have every disturbance of a section state. A point that stands on the ground keeps its height and
velocity, a knee at its stop keeps angle and rate, and the right heel stays on the section: a foot pressed into the
ground would be answered by a force that no disturbance of a walker makes, and a state off the section is no section
state. What is left are the directions in which states differ.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple

import msgspec
import numpy as np

from biped.base.errors import RunError
from biped.ensemble.campaign import simulate_planar
from biped.measure.trajectory import Trajectory
from biped.robot.ground import GRAVITY
from biped.robot.planar.topology import HEEL, KNEE, N_POINTS, NQ, PITCH, X, Z
from biped.robot.planar.tree import ABSOLUTE_FROM_JOINT, Tree, motion
from biped.robot.run import Run
from biped.scenario.keys import Window

ABOVE = 0.001
"""[m] of the section above the height at which contacts are sensed."""

_RIGHT = 0
RIGHT_HEEL = HEEL[_RIGHT]
# [s] between a crossing and the foot strike that it belongs to, at most.
_NEAR = 0.2
# Strides that a return may take: most take one, a stumble takes longer.
_PATIENCE = (1.3, 2.6)


class Crossings(NamedTuple):
    """Where a run crossed the section.

    Attributes:
        time: (m,) [s].
        q: (m, 9) joint coordinates [m, rad].
        v: (m, 9) joint velocities [m/s, rad/s].
    """

    time: np.ndarray
    q: np.ndarray
    v: np.ndarray


def crossings(t: Trajectory, height: float) -> Crossings:
    """Every crossing of the section in a run, interpolated linearly between control ticks.

    Args:
        t: The run.
        height: [m] of the section.
    """
    heel = t.height[:, RIGHT_HEEL]
    down = np.flatnonzero((heel[:-1] >= height) & (heel[1:] < height))
    rows = []
    for strike, leg in t.strikes:
        if leg == _RIGHT and down.size:
            # The heel may land a little before or after the foot bears load, or after the toe.
            nearest = down[np.argmin(np.abs(down - strike))]
            if abs(nearest - strike) * t.tick < _NEAR and nearest not in rows:
                rows.append(nearest)
    k = np.array(rows, dtype=int)
    s = (height - heel[k]) / (heel[k + 1] - heel[k])
    q = t.q[k] + s[:, None] * (t.q[k + 1] - t.q[k])
    v = t.v[k] + s[:, None] * (t.v[k + 1] - t.v[k])
    return Crossings(t.time[k] + s * t.tick, q, v)


class PoincareSection:
    """The section of one run's gait.

    Args:
        run: A concrete run; its duration and start are replaced.
        tree: Lengths of the biped that walks.

    Attributes:
        run: The run.
        tree: The lengths.
        height: [m] of the right heel on the section.
        unit: (18,) natural units of (q, v).
    """

    def __init__(self, run: Run, tree: Tree):
        self.run, self.tree = run, tree
        self.height = run.scenario.sensing.contact_height + ABOVE
        length = np.array([tree.leg] * 2 + [1.0] * 7)
        self.unit = np.concatenate([length, length / math.sqrt(tree.leg / GRAVITY)])

    def states(self, c: Crossings) -> np.ndarray:
        """Section states (m, 17) in natural units of crossings."""
        return (np.hstack([c.q, c.v]) / self.unit)[:, 1:]

    def whole(self, z: np.ndarray) -> np.ndarray:
        """(q, v) (…, 18) in SI units of section states (…, 17), at x = 0."""
        return np.concatenate([np.zeros((*z.shape[:-1], 1)), z], axis=-1) * self.unit

    def walk(self, z: np.ndarray, seconds: float) -> tuple[Trajectory, np.ndarray]:
        """Walks on from a section state z (17,); returns the run and the states (m, 17) at its later crossings."""
        start = self.whole(z)
        # The section ahead of a start is that start: only what comes after a swing counts, which strikes see to, since
        # a swing that began before the run has no 0.05 s of air yet.
        s = msgspec.structs.replace(self.run.scenario, duration=seconds, window=Window(), push=(), change=())
        t = simulate_planar(replace(self.run, q=start[:9], v=start[9:], scenario=s))
        return t, self.states(crossings(t, self.height))

    def returned(self, z: np.ndarray, stride: float) -> np.ndarray:
        """The return map P: the section state (17,) one return after z (17,).

        Args:
            z: A section state.
            stride: [s] about as long as a stride takes.

        Raises:
            RunError: The walker does not return.
        """
        for patience in _PATIENCE:
            t, after = self.walk(z, patience * stride)
            if len(after):
                return after[0]
        raise RunError(f"no return to the section: {t.cause or 'the walker no longer strides'}")


Mapped = Callable[[Callable, Sequence], list]
"""Carries a function of many items out (`biped.ensemble.executor`)."""


class Steady(NamedTuple):
    """A gait's own strides.

    Attributes:
        section: Where they are cut.
        states: (m, 17) section states.
        periods: (p,) [s].
        fell: Walks that fell, of `walks`.
        walks: Walks.
    """

    section: PoincareSection
    states: np.ndarray
    periods: np.ndarray
    fell: int
    walks: int

    @property
    def stride(self) -> float:
        """[s] mean time of a stride."""
        return float(self.periods.mean())


LEAN, SPEED = PITCH, NQ + X
"""Torso's angle and forward velocity among the 18 absolute coordinates and velocities."""

# [rad] from its stop within which a knee is held.
_STRAIGHT = 0.01
_DIFFERENCE = 1e-6
_STEPS = 20
_TOLERANCE = 1e-12
_RANK = 1e-8
# Natural units of torso height that weigh as much as a radian: the torso goes where the legs carry it.
_TRAVEL = 100.0


class Kicks:
    """Disturbances of one section state.

    Args:
        section: The section.
        z: (17,) the state.

    Attributes:
        basis: (17, r) orthonormal admissible directions, natural units.
    """

    def __init__(self, section: PoincareSection, z: np.ndarray):
        self.section, self.z = section, z
        whole = section.whole(z)
        height = motion(section.tree, whole[:NQ], whole[NQ:]).point[:, 1]
        touching = height < section.run.scenario.sensing.contact_height
        self._points = [i for i in range(N_POINTS) if touching[i] and i != RIGHT_HEEL]
        self._knees = [j for j in KNEE if whole[j] > -_STRAIGHT]
        self._kept = self._values(z)
        rows = self._rows(z)
        _, s, directions = np.linalg.svd(rows)
        self.basis = directions[int((s > _RANK * s[0]).sum()) :].T

    def _values(self, z: np.ndarray) -> np.ndarray:
        """Invariants (…, m) of states (…, 17)."""
        whole = self.section.whole(z)
        moved = motion(self.section.tree, whole[..., :NQ], whole[..., NQ:])
        unit = self.section.unit
        held = [moved.point[..., RIGHT_HEEL, 1:] / unit[0]]
        held += [moved.point[..., i, 1:] / unit[0] for i in self._points]
        held += [moved.point_velocity[..., i, :] / unit[SPEED] for i in self._points]
        held += [whole[..., [j, NQ + j]] / unit[[j, NQ + j]] for j in self._knees]
        return np.concatenate(held, axis=-1)

    def _rows(self, z: np.ndarray) -> np.ndarray:
        """Derivative (m, 17) of what stays as it is."""
        e = _DIFFERENCE * np.eye(2 * NQ - 1)
        return ((self._values(z + e) - self._values(z - e)) / (2.0 * _DIFFERENCE)).T

    def along(self, direction: np.ndarray, size: float) -> np.ndarray:
        """The state moved by `size` along basis @ direction, direction (r,) of any length, and put back in place."""
        direction = self.basis @ direction
        return self._placed(self.z + size * direction / np.linalg.norm(direction), {})

    def random(self, size: float, rng: np.random.Generator) -> np.ndarray:
        """The state moved by normal numbers of standard deviation `size` in every admissible direction."""
        return self._placed(self.z + self.basis @ (size * rng.standard_normal(self.basis.shape[1])), {})

    def moved(self, lean: float, speed: float) -> np.ndarray:
        """The state with the torso leaning further forward and moving faster, all else as near as can be.

        Args:
            lean: [rad].
            speed: [m/s].

        Raises:
            RunError: The legs cannot follow.
        """
        absolute = self._absolute(self.z)
        wanted = {LEAN: absolute[LEAN] - lean, SPEED: absolute[SPEED] + speed / self.section.unit[SPEED]}
        return self._placed(self.z, wanted)

    def _absolute(self, z: np.ndarray) -> np.ndarray:
        """Absolute coordinates and velocities (18,) of a state, natural units."""
        whole = np.concatenate([[0.0], z])
        return np.concatenate([ABSOLUTE_FROM_JOINT @ whole[:NQ], ABSOLUTE_FROM_JOINT @ whole[NQ:]])

    def _placed(self, z: np.ndarray, wanted: dict[int, float]) -> np.ndarray:
        """The nearest state, by absolute angles and rates, with what is kept and what is wanted."""
        turn = np.zeros((2 * NQ, 2 * NQ))
        turn[:NQ, :NQ] = turn[NQ:, NQ:] = ABSOLUTE_FROM_JOINT
        weight = np.ones(2 * NQ)
        weight[[Z, NQ + X, NQ + Z]] = _TRAVEL
        step = (np.linalg.inv(turn) * weight)[1:, 1:]
        names = list(wanted)
        for _ in range(_STEPS):
            off = np.concatenate([self._values(z) - self._kept, self._absolute(z)[names] - list(wanted.values())])
            if np.abs(off).max() < _TOLERANCE:
                return z
            rows = np.vstack([self._rows(z), turn[names][:, 1:]])
            z = z - step @ (np.linalg.pinv(rows @ step, rcond=_RANK) @ off)
        raise RunError("the legs cannot follow this disturbance with the standing foot in place")
