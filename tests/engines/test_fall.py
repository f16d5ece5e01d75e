"""A fall is judged by the true state against gravity, whatever the law senses or measures angles from."""

from __future__ import annotations

import numpy as np
import pytest

from biped.engines.loop import fall_words
from biped.ensemble.campaign import simulate
from biped.ensemble.plan import Plan
from biped.scenario.reading import read_scenario
from tests.engines.test_mujoco import stood

SHORT = ("duration=3.0", "window.start=1.0", "window.end=3.0", "expect={}")
SLOPE = ("ground.slope=10.0", "ground.angles='slope'", "fall.tilt=30.0")


def push(force: float) -> str:
    return f"push=[{{at=0.3,duration=0.4,force=[{force},0.0]}}]"


def beyond(t, fall) -> np.ndarray:
    """(n,) rows in which seven links have fallen: by height of the torso and its lean from the vertical."""
    height = t.q[:, 1] - t.ground.height(t.q[:, 0])
    lean = np.abs(np.degrees(t.q[:, 2]) + t.slope)
    return (height < fall.height * height[0]) | (lean > fall.tilt)


@pytest.mark.parametrize("engine", ["mujoco", "home"])
@pytest.mark.parametrize("changes", [
    (*SLOPE, push(500.0)),
    (*SLOPE, push(-500.0)),
    ("sensors.height_noise=0.2",),
    ("sensors.delay=0.02",),
    (push(-500.0), "sensors.angle_noise=0.1"),
    (push(500.0), "law='tests/engines/limp.py:Limp'"),
], ids=["uphill", "downhill", "heights", "late", "angles", "own law"])  # fmt: skip
def test_a_run_ends_in_the_first_state_that_is_a_fall(engine, changes):
    run = Plan(read_scenario("level_normal", [*SHORT, f"engine='{engine}'", *changes])).run(0)
    t = simulate(run)
    fallen = beyond(t, run.scenario.fall)
    assert not fallen[:-1].any()
    assert fallen[-1] == (t.end == "fell")
    if any("push" in change for change in changes):
        assert t.end == "fell"


def test_noise_of_measured_heights_is_no_fall():
    t = simulate(Plan(read_scenario("level_normal", [*SHORT, "sensors.height_noise=0.2"])).run(0))
    assert t.end != "fell" or t.time[-1] > 0.3, t.cause


@pytest.mark.parametrize(("slope", "force"), [(8.0, 900.0), (8.0, -900.0), (-8.0, 900.0)])
def test_any_robot_falls_by_its_lean_from_the_vertical(slope, force):
    changes = (f"ground.slope={slope}", "fall.tilt=30.0", "fall.height=0.1", "duration=2.0",
               f"push=[{{at=0.1,duration=0.3,force=[{force},0.0],body='torso'}}]")  # fmt: skip
    t = stood("walker2d", *changes)
    up = -np.array(t.gravity) / np.linalg.norm(t.gravity)
    axes = [_turned(quaternion, np.array(t.robot.upright)) for quaternion in t.base[:, 3:]]
    lean = np.degrees(np.arccos(np.clip(axes @ up, -1.0, 1.0)))
    assert t.end == "fell"
    assert lean[-1] > 30.0 >= lean[:-1].max()


def _turned(quaternion: np.ndarray, vector: np.ndarray) -> np.ndarray:
    w, r = quaternion[0], quaternion[1:]
    return vector + 2.0 * np.cross(r, np.cross(r, vector) + w * vector)


def test_words_say_where_it_fell_to():
    assert fall_words(np.array([0.3, 0.1]), 1.0) == "fell forward at 1.000 s"
    assert fall_words(np.array([-0.3, 0.1]), 1.0) == "fell backward at 1.000 s"
    assert fall_words(np.array([0.1, -0.3, 0.9]), 1.0) == "fell to the right at 1.000 s"
    assert fall_words(np.array([0.1, 0.1, 0.9]), 1.0) == "collapsed at 1.000 s"
