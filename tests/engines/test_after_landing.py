"""A change that waits for a footfall, of a walker in the plane: in both engines it begins when a foot has landed."""

from __future__ import annotations

import numpy as np
import pytest

from biped.ensemble.campaign import simulate
from biped.ensemble.plan import Plan
from biped.measure.trajectory import Trajectory
from biped.robot.leg_states import FIRST_IN_AIR
from biped.scenario.reading import read_scenario

AT, AFTER = 1.0, 0.1


def walk(engine: str, *changes: str) -> Trajectory:
    base = [f"engine={engine}", "duration=1.8", "randomise.runs=1", "window={}", *changes]
    return simulate(Plan(read_scenario("upright/own", base)).run(0))


@pytest.mark.parametrize("engine", ["mujoco", "home"])
def test_it_begins_some_time_after_the_next_landing(engine):
    plain = walk(engine)
    waits = walk(engine, f"change=[{{at={AT},after_landing={AFTER},gains.theta_b=80.0}}]")
    air = plain.column("phase") - 1 >= FIRST_IN_AIR
    begins = round(AT / plain.tick)
    landed = begins + 1 + np.flatnonzero((air[begins:-1] & ~air[begins + 1 :]).any(axis=1))[0]
    changed = np.flatnonzero((plain.log != waits.log).any(axis=1))[0]
    # The law sees in a tick what the tick before has found of the legs.
    assert changed == landed + 1 + round(AFTER / plain.tick)
