"""Falling sideways: what becomes of a small sideways velocity from step to step, with foot placement and without."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from biped.engines.mujoco import simulate
from biped.ensemble.plan import Plan
from biped.measure.metrics.gait import foot_places
from biped.measure.trajectory import Trajectory
from biped.scenario.reading import read_scenario

SIDE = (-1.0, 1.0)
KICK = 0.01
"""[m/s]"""


def plan_of(*changes: str) -> Plan:
    return Plan(read_scenario("spatial/own", ["start.jitter=0.0", *changes]))


def at_strikes(t: Trajectory) -> list[np.ndarray]:
    """At each foot strike (place, velocity) of the centre of mass, sideways from the foot that strikes, outward."""
    feet = foot_places(t)
    return [
        SIDE[foot] * np.array([t.com[row, 1] - feet[row, foot, 1], t.com_velocity[row, 1]]) for row, foot in t.strikes
    ]


def growth(steps: int, *changes: str) -> list[float]:
    """By what a sideways kick grows in a step of a steady walk, the mean of some steps, for three moments of the kick.

    Deviations are differences between walks kicked to the left and to the right, as velocities: of places times the
    frequency sqrt(g / height) with which a walker falls.
    """
    steady = simulate(plan_of("duration=9.0").run(0))
    assert steady.end == "completed"
    last = steady.strikes[-3][0]
    scale = np.array([np.sqrt(9.81 / steady.com[:, 2].mean()), 1.0])
    out = []
    for late in (40, 200, 420):
        row = last + late
        plan = plan_of("duration=3.2", *changes)

        def walk(kick, row=row, plan=plan):
            v = steady.v[row].copy()
            v[1] += kick
            return at_strikes(simulate(replace(plan.run(0), q=steady.q[row].copy(), v=v)))

        size = [float(np.linalg.norm(scale * (a - b))) for a, b in zip(walk(KICK), walk(-KICK), strict=False)]
        out.append((size[steps] / size[0]) ** (1.0 / steps))
    return out


@pytest.mark.slow
def test_foot_placement_holds_the_roll_mode():
    placed = growth(3)
    gone = growth(2, "gains.frontal.placement={position=0.0,velocity=0.0}")
    print("a step multiplies by", np.round(placed, 2), "with placement, by", np.round(gone, 2), "without")
    assert max(placed) < 1.0
    assert min(gone) > 1.5
