"""One tick of seven links in compiled loops: the law decides, the fall is judged, the actuators move."""

import math

import numpy as np

from biped.base.jit import inner_kernel, kernel
from biped.control.planar.loop import actuate, decide
from biped.engines.fall import GOING, LOW, NOT_FINITE, TILTED
from biped.robot.ground import GROUND, height_below, set_ground
from biped.robot.planar.topology import NQ, PITCH, TORSO, X, Z
from biped.robot.planar.tree import Tree
from biped.robot.run import Run

FALL = np.dtype(
    [("least", "f8"), ("tilt", "f8"), ("slope", "f8"), ("com", "f8", 2), ("ground", GROUND)],
    align=True,
)
"""Bounds of a fall: [m] height of the torso's centre of mass, [rad] of its lean from the vertical; the slope [rad], and
where [m] in the torso's frame its centre of mass is."""


def fall_of(run: Run, tree: Tree) -> np.ndarray:
    """The bounds (1,) of a fall of a run.

    Args:
        run: The run.
        tree: Lengths and masses of the biped that walks.
    """
    s, out = run.scenario, np.zeros(1, FALL)
    bounds, profile, (along, up) = out[0], run.profile, tree.com[TORSO]
    set_ground(bounds["ground"], profile)
    bounds["tilt"], bounds["slope"], bounds["com"] = np.radians(s.fall.tilt), np.radians(s.ground.slope), (along, up)
    cos, sin = math.cos(run.q[PITCH]), math.sin(run.q[PITCH])
    height = run.q[Z] + sin * along + cos * up - float(profile.height(run.q[X] + cos * along - sin * up))
    bounds["least"] = s.fall.height * height
    return out


@inner_kernel
def _height(bounds, q):
    """Height [m] of the torso's centre of mass above the ground, normal to it."""
    x, z = q[X], q[Z]
    along, up = bounds["com"][0], bounds["com"][1]
    if along != 0.0 or up != 0.0:
        c, s = math.cos(q[PITCH]), math.sin(q[PITCH])
        x, z = x + c * along - s * up, z + s * along + c * up
    return z - height_below(bounds["ground"], x)


@kernel
def judge(fall, q, v):
    """Judges the true state: GOING, LOW, TILTED or NOT_FINITE.

    Args:
        fall: (1,) `FALL`.
        q: (9,) true joint coordinates [m, rad].
        v: (9,) true joint velocities.
    """
    bounds = fall[0]
    for j in range(NQ):
        if not (math.isfinite(q[j]) and math.isfinite(v[j])):
            return NOT_FINITE
    if _height(bounds, q) < bounds["least"]:
        return LOW
    if abs(q[PITCH] + bounds["slope"]) > bounds["tilt"]:
        return TILTED
    return GOING


@inner_kernel
def tick(control, fall, q, v, applied, log, k):
    """Decides at tick k, judges the state, and moves the actuators if the run goes on.

    Args:
        control: `biped.control.planar.loop.Control`.
        fall: (1,) `FALL`.
        q: (9,) true joint coordinates [m, rad].
        v: (9,) true joint velocities.
        applied: (6,) joint torques or (9,) generalized forces that act in the coming steps, overwritten.
        log: (n, WIDTH) log, row k is written but for its ground forces.
        k: Number of the tick.

    Returns:
        GOING, LOW, TILTED or NOT_FINITE.
    """
    status = decide(control, q, v, log, k)
    if status == GOING:
        status = judge(fall, q, v)
    if status == GOING:
        actuate(control, q, v, applied, log, k)
    return status
