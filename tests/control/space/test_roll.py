"""Falling sideways: what becomes of a sideways velocity from step to step, with foot placement and without."""

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
KICK = 0.06
"""[m/s] A walk kicked by 0.01 is lost in its own chaos after one step."""
STRIKES, LATE = range(-9, -3), (40, 200, 420)
"""Of a steady walk, and ticks after each: when it is kicked."""
STEPS = 2


def plan_of(*changes: str) -> Plan:
    return Plan(read_scenario("spatial/own", ["start.jitter=0.0", *changes]))


def at_strikes(t: Trajectory) -> list[np.ndarray]:
    """At each foot strike (place, velocity) of the centre of mass, sideways from the foot that strikes, outward."""
    feet = foot_places(t)
    return [
        SIDE[foot] * np.array([t.com[row, 1] - feet[row, foot, 1], t.com_velocity[row, 1]]) for row, foot in t.strikes
    ]


def deviations(*changes: str) -> np.ndarray:
    """(moments, 1 + STEPS) [m/s] by which walks that are kicked to the left and to the right differ at their strikes.

    The distance of places counts as a velocity: times the frequency sqrt(g / height) with which a walker falls.
    """
    steady = simulate(plan_of("duration=12.0").run(0))
    assert steady.end == "completed"
    scale = np.array([np.sqrt(9.81 / steady.com[:, 2].mean()), 1.0])
    plan = plan_of("duration=3.2", *changes)

    def walk(row: int, kick: float) -> np.ndarray:
        v = steady.v[row].copy()
        v[1] += kick
        found = at_strikes(simulate(replace(plan.run(0), q=steady.q[row].copy(), v=v)))
        return np.array([*found, *[np.full(2, np.nan)] * STEPS][: 1 + STEPS])  # after a fall, no more strikes

    rows = [steady.strikes[strike][0] + late for strike in STRIKES for late in LATE]
    left, right = (np.array([walk(row, kick) for row in rows]) for kick in (KICK, -KICK))
    return np.linalg.norm(scale * (left - right), axis=2)


@pytest.mark.slow
def test_foot_placement_holds_the_roll_mode():
    placed = np.median(deviations(), axis=0)  # none falls
    gone = np.nanmedian(deviations("gains.frontal.placement={position=0.0,velocity=0.0}"), axis=0)
    print("differences at strikes:", np.round(placed, 3), "with placement,", np.round(gone, 3), "without")
    assert placed[-1] < 0.5 * placed[0]
    assert gone[-1] > 2.0 * gone[0]
