"""Families of gaits: gains between speeds."""

from __future__ import annotations

import msgspec
import pytest

from biped.base.errors import InputError
from biped.ensemble.plan import Plan
from biped.scenario.gains import Gains, Pace
from biped.scenario.gait import read_gains
from biped.scenario.reading import read_scenario

FAMILY = """
extends = "fast"
[[speeds]]
at = 1.0
theta_b = 70.0
k_d2 = [900.0, 70.0, 70.0, 0.0]
[[speeds]]
at = 0.5
theta_b = 80.0
k_d2 = [600.0, 70.0, 70.0, 0.0]
"""


def test_family_interpolates_between_speeds(tmp_path):
    path = tmp_path / "family.toml"
    path.write_text(FAMILY, encoding="utf-8")
    fast = read_gains(path, Gains())
    assert fast.theta_b == 87.5  # without a speed the tables have no effect
    gains = read_gains(path, Gains(speed=0.6))
    assert gains.theta_b == pytest.approx(78.0)
    assert gains.k_d2 == pytest.approx((660.0, 70.0, 70.0, 0.0))
    assert gains.k_d1 == fast.k_d1
    assert read_gains(path, Gains(speed=0.6, theta_b=75.0)).theta_b == 75.0
    assert read_gains(path, Gains(speed=1.0)).theta_b == 70.0


PACED = FAMILY.replace(
    "[[speeds]]", "[[speeds]]\npace = { speed = 1.0, slope = 0.0, side = 0.0, swing = 0.2, stance = 0.1 }", 1
)
PACED += "pace = { speed = 0.5, slope = 2.0, side = 0.0, swing = 0.1, stance = 0.1 }\n"


def test_a_pace_is_interpolated_too(tmp_path):
    path = tmp_path / "family.toml"
    path.write_text(PACED, encoding="utf-8")
    pace = read_gains(path, Gains(speed=0.6)).pace
    assert isinstance(pace, Pace)
    assert (pace.speed, pace.slope, pace.side) == pytest.approx((0.6, 1.6, 0.0))
    assert (pace.swing, pace.stance) == pytest.approx((0.12, 0.1))
    assert (pace.lean, pace.knee, pace.ankle) == (None, None, None)
    path.write_text(PACED.replace("swing = 0.2,", "swing = 0.2, lean = 2.0,"), encoding="utf-8")
    pace = read_gains(path, Gains(speed=0.6)).pace
    assert pace is not None
    assert pace.lean == pytest.approx(0.4)  # at 0.5 m/s there is none
    assert pace.knee is None


@pytest.mark.parametrize(
    ("text", "speed", "words"),
    [
        (FAMILY, 1.2, ["gains.speed", "0.5 … 1 m/s", "1.2"]),
        ('extends = "fast"', 0.8, ["at least two", "gains.speed = 0.8"]),
        (FAMILY.replace("at = 0.5", "at = 1.0"), 1.0, ["different speeds"]),
        (FAMILY.replace("theta_b = 80.0", ""), 0.7, ["theta_b at 0.5"]),
        (PACED.replace("slope = 2.0, ", ""), 0.7, ["pace at 0.5", "all of it"]),
        (FAMILY.replace("at = 0.5", ""), 0.7, ["speeds", "at"]),
    ],
)
def test_family_mistakes_are_named(tmp_path, text, speed, words):
    path = tmp_path / "family.toml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError) as error:
        read_gains(path, Gains(speed=speed))
    for word in [*words, "family.toml"]:
        assert word in str(error.value)


def test_family_is_swept_like_any_key(tmp_path):
    path = tmp_path / "family.toml"
    path.write_text(FAMILY, encoding="utf-8")
    scenario = read_scenario("level_fast", [f"controller={path}", 'sweep={"gains.speed"=[0.5,1.0]}'])
    plan = Plan(scenario)
    assert [plan.run(i).gains.theta_b for i in range(2)] == [80.0, 70.0]
    assert msgspec.structs.replace(plan.run(0).gains, theta_b=0.0) != plan.run(1).gains
