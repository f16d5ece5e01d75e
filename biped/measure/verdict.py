"""The verdict on a run's numbers: sentinels say whether they are sound, doubtful or diverged.

It stands beside what became of the run and does not replace it: a run that fell with doubtful numbers fell. Numbers are
*diverged* if a link became faster than any fall can make it, or if energy or momentum is out of all proportion; they
are *doubtful* if a sentinel only says that something is wrong. Both engines' runs are judged alike, from the trajectory
alone.

What sound runs show (2,100 of the shipped scenarios, all regression runs, and the gaits at home): energy within 0.55 %,
momentum within 0.13 %, links up to 18 m/s and 57 rad/s in falls (the human's bounds are 38 m/s and 290 rad/s), 1.4 % of
ticks chattering. Where forces are `sampled`: energy within 3.6 %, momentum within 5 %.
"""

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from biped.measure.momentum import LONG, SHORT, Unexplained
from biped.measure.pushes import declared
from biped.measure.trajectory import Trajectory
from biped.robot.ground import gravity
from biped.robot.planar.tree import motion

ENERGY = 0.01
"""Energy residual beyond which a run is doubtful."""
MOMENTUM = 0.01
"""Momentum residual beyond which a run is doubtful."""
SAMPLED = 10.0
"""These two bounds are this much wider where the logged force is that of one physics step of several."""
DIVERGED = 10.0
"""A residual that is this many times its bound is no inaccuracy: the run diverged."""
HELD = (0.01, 0.003)
"""Mean force, of the weight, moment, of the weight at a leg's length, and speed, of √(g l), that nothing explains,
beyond which a run is doubtful: over any 0.2 s and over any 2 s."""
HELD_SAMPLED = (0.6, 0.09)
"""The same of force and moment where forces are sampled: sound runs at 500 Hz show up to 0.31 and 0.025."""
NOWHERE = 0.05
"""Energy that nobody put in beyond which a run is doubtful."""
CHATTERING = 0.1
"""Share of ticks in which contacts may chatter at home."""


HELD_WORDS = "something else holds or drives it"
"""How the doubt about a run begins whose momentum gravity, ground and pushes do not explain."""

CHANGED = "changed by its law: "
"""How warnings begin of what a law changed in the simulator behind what it is given."""

GIVEN_UP = "given_up_ticks"
"""The warning that counts ticks in which a law gave up a problem that it had to solve."""

SOUND, DOUBTFUL, DIVERGENT = "sound", "doubtful", "diverged"
"""The verdicts."""


class Verdict(NamedTuple):
    """Whether the numbers of a run can be believed.

    Attributes:
        verdict: `sound`, `doubtful` or `diverged`.
        doubt: Which sentinels failed, when and by how much; empty where the numbers are sound, or where the run's own
            `cause` says how they blew up.
    """

    verdict: str
    doubt: str


class Most(NamedTuple):
    """Constants that bound the speeds of links.

    Attributes:
        level: [J] energy of the start and of the whole fall to the ground from where it stood.
        downhill: [N] energy per metre forward.
        pushed: [sqrt J] what all pushes add to the root of the energy.
        least_mass: [kg] of a link.
        least_inertia: [kg m²] of a link.
    """

    level: float
    downhill: float
    pushed: float
    least_mass: float
    least_inertia: float


def most(t: Trajectory) -> Most:
    """How fast a link can be: faster than any fall can make it is what blew up.

    That is the speed of the lightest link (or its turning, for the one of least inertia) with all the energy in it that
    the biped has: of its start, of the whole fall to the ground, downhill from where it stood, and of all pushes. A
    push's impulse J on a body of mass m adds at most J / sqrt(2 m) to the root of the energy, reached when the body is
    free. What the actuators do is not counted: it is what a controller that blows up has.
    """
    mass, inertia = t.tree.mass, t.tree.inertia
    start = motion(t.tree, t.q[0], t.v[0])
    first = 0.5 * float((mass * (start.com_velocity**2).sum(axis=-1)).sum() + (inertia * start.rate**2).sum())
    along, normal = gravity(t.slope)
    total = float(mass.sum())
    height = max(float(mass @ start.com[:, 1]) / total, t.tree.leg)
    if not t.ground.level:
        height -= min(0.0, float(t.ground.z.min()))
    body = {link: float(m) for link, m in zip(t.robot.bodies, mass, strict=True)}
    pushed = sum(
        (push.end - push.start) * math.hypot(*push.force) / math.sqrt(2.0 * body.get(push.body, float(mass.min())))
        for push in declared(t)
    )
    return Most(first - total * normal * height, total * along, pushed, float(mass.min()), float(inertia.min()))


def first_too_fast(t: Trajectory) -> int | None:
    """The first row in which a link is faster than `most` allows; None if there is none, or nothing is known of links.

    A number that is none is too fast.
    """
    if t.link_speed is None:
        return None
    bound, (squared, turning) = most(t), t.link_speed
    least = math.sqrt(max(bound.level, 0.0)) + bound.pushed
    if 0.5 * max(bound.least_mass * squared.max(), bound.least_inertia * turning.max()) <= least * least:
        return None
    root = np.sqrt(bound.level + np.maximum(0.0, bound.downhill * (t.x - t.x[0]))) + bound.pushed
    slow = (0.5 * bound.least_mass * squared <= root * root) & (0.5 * bound.least_inertia * turning <= root * root)
    return None if slow.all() else int(np.argmin(slow))


def too_fast(t: Trajectory, row: int) -> str:
    """Which link is too fast in a row that is beyond `most`, when, and how fast."""
    bound, moved = most(t), motion(t.tree, t.q[row], t.v[row])
    squared = (moved.com_velocity**2).sum(axis=-1)
    energy = np.array([bound.least_mass * squared, bound.least_inertia * moved.rate**2])
    root = math.sqrt(bound.level + max(0.0, bound.downhill * (t.q[row, 0] - t.q[0, 0]))) + bound.pushed
    link = int(np.argmax((~(0.5 * energy <= root * root)).any(axis=0)))
    reached = f"{math.sqrt(squared[link]):.3g} m/s, {abs(moved.rate[link]):.3g} rad/s"
    name = t.robot.bodies[link].replace("_", " ")
    return f"{name} faster than any fall can make it at {t.time[row]:.3f} s: {reached}"


def verdict_on(t: Trajectory, numbers: Mapping[str, float], left: Unexplained) -> Verdict:
    """The verdict on the numbers of a run.

    Args:
        t: The run as its engine ended it.
        numbers: Its `energy_residual`, `momentum_residual` and `energy_from_nowhere`.
        left: What nothing explains of its momentum.
    """
    if t.end == "diverged":
        return Verdict(DIVERGENT, "")
    wide = SAMPLED if t.sampled else 1.0
    when = f"at {t.time[-1]:.3f} s"
    diverged, doubtful = [], []
    for name, words, bound in (
        ("energy_residual", "energy not accounted for", ENERGY * wide),
        ("momentum_residual", "momentum not accounted for", MOMENTUM * wide),
        ("energy_from_nowhere", "energy from nowhere", NOWHERE),
    ):
        value = numbers[name]
        if not value <= bound:  # nan fails
            (doubtful if value <= DIVERGED * bound else diverged).append(
                f"{words} {when}: {100.0 * value:.3g} %, at most {100.0 * bound:g} %"
            )
    if held := _held(left, HELD_SAMPLED if t.sampled else HELD):
        doubtful.append(held)
    if changed := [name.removeprefix(CHANGED) for name in t.warnings if name.startswith(CHANGED)]:
        doubtful.append(f"its law changed the simulator {when}: {', '.join(changed)}")
    ticks = t.warnings.get("chattering_steps", 0)
    if ticks > CHATTERING * len(t):
        doubtful.append(f"contacts chattering {when}: in {ticks} of {len(t)} ticks, at most {100.0 * CHATTERING:g} %")
    if ticks := t.warnings.get(GIVEN_UP, 0):
        doubtful.append(f"its law gave up {when}: in {ticks} of {len(t)} ticks its torques are no solution, at most 0")
    if not diverged and not doubtful:
        return Verdict(SOUND, "")
    return Verdict(DIVERGENT if diverged else DOUBTFUL, "; ".join([*diverged, *doubtful]))


def unsolved(ticks: int) -> dict[str, int]:
    """The warning of a run in which a law gave up a problem in so many ticks; nothing where there are none."""
    return {GIVEN_UP: ticks} if ticks else {}


def _held(left: Unexplained, bounds: tuple[float, float]) -> str:
    """The force, moment and speed that something else gives a robot, in words; empty if nothing does."""
    found = []
    for means, unit, beyond, most in ((left.force, "N", "", bounds), (left.moment, "N m", "", bounds),
                                      (left.speed, "m/s", " beyond its velocity", HELD)):  # fmt: skip
        for mean, bound, seconds in zip(means, most, (SHORT, LONG), strict=True):
            if not mean.share <= bound:  # nan fails
                found.append(f"{mean.size:.3g} {unit} {mean.way}{beyond} at {mean.when:.3f} s, the mean over "
                             f"{seconds:g} s: {100.0 * mean.share:.3g} %, at most {100.0 * bound:g} %")  # fmt: skip
                break
    return f"{HELD_WORDS}: {' and '.join(found)}" if found else ""
