"""Whether a run's numbers can be believed: its sentinels, and what they make of its end.

A run that completed or fell is *diverged* instead if a link became faster than any fall can make it, or if energy or
momentum is out of all proportion; it is *doubtful* if a sentinel only says that something is wrong. Both engines'
runs are judged alike, from the trajectory alone.

What sound runs show (2,100 of the shipped scenarios, all regression runs, and the gaits at home): energy within 0.55 %,
momentum within 0.13 %, links up to 18 m/s and 57 rad/s in falls (the human's bounds are 38 m/s and 290 rad/s), 1.4 % of
ticks chattering. Where forces are `sampled`: energy within 3.6 %, momentum within 5 %.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from biped.measure.trajectory import Trajectory
from biped.robot.model import gravity
from biped.robot.tree import Motion

ENERGY = 0.01
"""Energy residual beyond which a run is doubtful."""
MOMENTUM = 0.01
"""Momentum residual beyond which a run is doubtful."""
SAMPLED = 10.0
"""These two bounds are this much wider where the logged force is that of one physics step of several."""
DIVERGED = 10.0
"""A residual that is this many times its bound is no inaccuracy: the run diverged."""
NOWHERE = 0.05
"""Energy that nobody put in beyond which a run is doubtful."""
LEAST_TIME = 0.1
"""[s] of weight that the momentum residual is relative to at least: a fall in the second tick has no impulse yet."""
CHATTERING = 0.1
"""Share of ticks in which contacts may chatter at home."""


class Ending(NamedTuple):
    """How a run ended.

    Attributes:
        end: `completed`, `fell`, `diverged` or `doubtful`.
        cause: In words; empty if completed.
    """

    end: str
    cause: str


class TooFast(NamedTuple):
    """Where a run blew up.

    Attributes:
        row: The first row in which a link is too fast.
        cause: Which link, when and how fast.
    """

    row: int
    cause: str


def too_fast(t: Trajectory, whole: Motion, squared: np.ndarray) -> TooFast | None:
    """The first row in which a link is faster than any fall can make it; None if there is none.

    That is the speed of the lightest link (or its turning, for the one of least inertia) with all the energy in it that
    the biped has: of its start, of the whole fall to the ground, downhill from where it stood, and of all pushes. A
    push's impulse J on a body of mass m adds at most J / sqrt(2 m) to the root of the energy, reached when the body is
    free. What the actuators do is not counted: it is what a controller that blows up has.

    Args:
        t: The run.
        whole: How its rows move.
        squared: (n, 7) [m²/s²] squares of the speeds of the links' centres of mass.
    """
    mass, inertia = t.tree.mass, t.tree.inertia
    first = 0.5 * float((mass * (whole.com_velocity[0] ** 2).sum(axis=-1)).sum() + (inertia * whole.rate[0] ** 2).sum())
    along, normal = gravity(t.slope)
    height = max(float(mass @ whole.com[0, :, 1]) / float(mass.sum()), t.tree.leg)
    level = first - float(mass.sum()) * normal * height
    body = {link: float(m) for link, m in zip(t.robot.links, mass, strict=True)}
    pushed = sum(
        (end - start) * math.hypot(forward, up) / math.sqrt(2.0 * body.get(name, float(mass.min())))
        for start, end, forward, up, name in t.pushes
    )
    root = math.sqrt(level) + pushed
    least = root * root
    turning = max(-whole.rate.min(), whole.rate.max())
    if 0.5 * mass.min() * squared.max() <= least and 0.5 * inertia.min() * turning**2 <= least:
        return None
    downhill = float(mass.sum()) * np.maximum(0.0, along * (t.q[:, 0] - t.q[0, 0]))
    most = (np.sqrt(level + downhill) + pushed)[:, None] ** 2
    beyond = ~((0.5 * mass.min() * squared <= most) & (0.5 * inertia.min() * whole.rate**2 <= most))
    rows = beyond.any(axis=1)
    if not rows.any():
        return None
    row = int(np.argmax(rows))
    link = int(np.argmax(beyond[row]))
    reached = f"{math.sqrt(squared[row, link]):.3g} m/s, {abs(whole.rate[row, link]):.3g} rad/s"
    name = t.robot.links[link].replace("_", " ")
    return TooFast(row, f"{name} faster than any fall can make it at {t.time[row]:.3f} s: {reached}")


def momentum_residual(t: Trajectory, whole: Motion) -> float:
    """What ground forces, gravity and pushes leave unexplained of the change of momentum along the ground's normal.

    Relative to the impulse of the weight, of `LEAST_TIME` at least, or of what acted if that is more.
    """
    if len(t) < 2:
        return 0.0
    momentum = (t.tree.mass * whole.com_velocity[[0, -1], :, 1]).sum(axis=1)
    force = float(t.force[:-1, :, 1].sum())
    weight = -float(t.tree.mass.sum()) * gravity(t.slope)[1]
    push, pushed, count = 0.0, 0.0, len(t) - 1
    angle = math.radians(t.slope)
    for start, end, forward, up, _ in t.pushes:
        ticks = max(0, min(round(end / t.tick), count) - round(start / t.tick))
        up_ticks = ticks * (up * math.cos(angle) - forward * math.sin(angle))
        push, pushed = push + up_ticks, pushed + abs(up_ticks)
    off = float(momentum[1] - momentum[0]) / t.tick - (force + push - weight * count)
    return abs(off) / max(weight * max(count, LEAST_TIME / t.tick), abs(force), pushed)


def ending(t: Trajectory, numbers: Mapping[str, float]) -> Ending:
    """How a run ended, its sentinels heard.

    Args:
        t: The run as its engine ended it.
        numbers: Its `energy_residual`, `momentum_residual` and `energy_from_nowhere`.
    """
    if t.end == "diverged":
        return Ending(t.end, t.cause)
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
    ticks = t.warnings.get("chattering_steps", 0)
    if ticks > CHATTERING * len(t):
        doubtful.append(f"contacts chattering {when}: in {ticks} of {len(t)} ticks, at most {100.0 * CHATTERING:g} %")
    if not diverged and not doubtful:
        return Ending(t.end, t.cause)
    said = "; ".join([*diverged, *doubtful, *([t.cause] if t.cause else [])])
    return Ending("diverged" if diverged else "doubtful", said)
