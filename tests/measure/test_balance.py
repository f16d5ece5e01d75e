"""Balance: where a foot must go, against the physics written down another way; support phases on made-up steps."""

from __future__ import annotations

import math

import numpy as np
import pytest

from biped.measure.indicators import (
    FL_DOUBLE,
    FL_SINGLE,
    FLIGHT,
    FR_DOUBLE,
    FR_SINGLE,
    LEAST_RUNS,
    _phases,
    balance,
    gait_events,
    of_campaign,
    of_run,
    placement_angle,
    spells,
)
from biped.measure.metrics.pushed import push_work
from tests.runs import made, mirrored

G = 9.81


def angle(mass, inertia, height, forward, up, spin) -> float:
    (found,) = placement_angle(
        mass, np.array([inertia]), np.array([height]), np.array([[forward, up]]), np.array([spin])
    )
    return float(found)


@pytest.mark.parametrize(
    ("inertia", "forward", "up", "spin"),
    [
        (10.0, 1.0, 0.0, 0.0),
        (10.0, 0.7, 0.2, -3.0),
        (25.0, 1.3, -0.3, 4.0),
        (10.0, -0.9, 0.1, 2.0),
        (1e-6, 1.5, 0.0, 0.0),
    ],
)
def test_a_foot_at_the_estimate_brings_the_biped_to_rest_over_it(inertia, forward, up, spin):
    """Angular momentum about the foot is kept at its landing, energy from there to the top."""
    mass, height = 75.0, 0.95
    found = angle(mass, inertia, height, forward, up, spin)
    r = np.array([-height * math.tan(found), height])  # from the foot to the centre of mass
    momentum = mass * (r[0] * up - r[1] * forward) + spin
    about_foot = inertia + mass * float(r @ r)
    energy = momentum**2 / (2.0 * about_foot) + mass * G * height
    assert energy == pytest.approx(mass * G * math.hypot(*r), rel=1e-9)
    assert found * (mass * height * forward - spin) > 0.0


def test_slow_point_masses_have_the_capture_point():
    for speed in (0.01, 0.02):
        assert math.tan(angle(75.0, 1e-9, 0.95, speed, 0.0, 0.0)) * 0.95 == pytest.approx(
            speed * math.sqrt(0.95 / G), rel=1e-3
        )


def test_what_mirrors_mirrors():
    assert angle(75.0, 12.0, 0.9, -0.8, 0.1, -2.0) == pytest.approx(-angle(75.0, 12.0, 0.9, 0.8, 0.1, 2.0))


def test_what_is_too_fast_has_no_place():
    assert math.isnan(angle(75.0, 10.0, 0.95, 100.0, 0.0, 0.0))


def test_support_phases():
    right, left = [1, 1, 0, 1, 1, 1, 0, 0], [1, 0, 0, 0, 1, 1, 1, 0]
    assert list(_phases(np.array([right, left], dtype=bool).T)) == [
        FR_DOUBLE, FR_SINGLE, FLIGHT, FR_SINGLE, FR_DOUBLE, FR_DOUBLE, FL_SINGLE, FLIGHT,
    ]  # fmt: skip
    phase = np.array([1, 1, 3, 1, 1, 1, 3, 3, 1])
    assert spells(phase, 1) == [slice(3, 6)]  # whole ones alone
    assert spells(phase, 3) == [slice(2, 3), slice(6, 8)]
    both = np.array([[1, 0], [1, 1], [0, 1], [1, 1]], dtype=bool)
    assert list(_phases(both)) == [FR_SINGLE, FR_DOUBLE, FL_SINGLE, FL_DOUBLE]


def test_a_walk_in_the_mirror_has_the_other_legs_numbers():
    t = made("long")
    here, there = of_run(t), of_run(mirrored(t))
    for name, indicator in here.items():
        other = name.replace("fl_", "F_").replace("fr_", "fl_").replace("F_", "fr_")
        if name != "gait_phase_durations":
            assert there[other].value == pytest.approx(indicator.value, rel=1e-6, abs=1e-9)
    events, mirror = gait_events(t), gait_events(mirrored(t))
    assert events["r_heel_strike"] == mirror["l_heel_strike"]
    assert len(events["r_heel_strike"]) > 1


def test_balance_of_a_walk():
    t = made("long")
    b = balance(t)
    moved = np.gradient(b.com, t.tick, axis=0)
    assert np.median(np.abs(moved - b.velocity)) < 2e-3
    standing = b.phase != FLIGHT
    assert (b.front[standing] > b.back[standing]).all()
    assert np.isnan(b.front[~standing]).all()
    double = np.isin(b.phase, (FL_DOUBLE, FR_DOUBLE))
    assert np.nanmean((b.front - b.back)[double]) > 2.0 * np.nanmean((b.front - b.back)[~double & standing])
    assert b.inside(0.5 * (b.back + b.front))[standing] == pytest.approx(0.5 * (b.front - b.back)[standing])
    far = np.isfinite(b.placement)
    assert far.mean() > 0.9
    assert np.abs(b.placement - b.capture)[far].mean() < 0.1


def test_angular_momentum_changes_by_the_moment_of_the_ground():
    """About the centre of mass nothing else turns the biped: gravity and pushes at the torso aside."""
    t = made("long")
    b = balance(t)
    from biped.robot.planar.tree import motion

    arm = motion(t.tree, t.q, t.v).point - b.com[:, None]
    moment = (arm[..., 0] * t.force[..., 2] - arm[..., 1] * t.force[..., 0]).sum(axis=1)
    gained = np.cumsum(moment[:-1]) * t.tick
    assert np.abs(gained - (b.spin[1:] - b.spin[0])).max() < 0.02 * np.abs(b.spin).max() + 0.5


def test_what_a_push_does_to_the_robot_is_absorbed():
    assert push_work(made("walk")) == 0.0
    assert "absorbed_energy" not in of_run(made("walk"))
    assert of_run(made("pushed"))["absorbed_energy"].value == push_work(made("pushed")) != 0.0


def test_balance_is_said_on_level_ground_alone():
    assert not any("capture" in name for name in of_run(made("slope")))
    assert "distance_travelled" in of_run(made("slope"))


def rows(levels: dict[float, tuple[int, int]]) -> tuple[dict, dict[int, float]]:
    runs, impulse = [], {}
    for size, (count, failed) in levels.items():
        for i in range(count):
            impulse[len(runs)] = size
            runs.append({"index": len(runs), "fell": i < failed, "end": "fell" if i < failed else "completed"})
    return {"runs": runs}, impulse


@pytest.mark.parametrize(
    ("levels", "expected"),
    [
        ({10.0: (10, 0), 20.0: (10, 2), 30.0: (10, 3)}, 20.0),  # fewer than 30 %
        ({10.0: (10, 0), -40.0: (10, 1)}, 40.0),  # of whichever way
        ({10.0: (10, 2), 20.0: (LEAST_RUNS - 1, 0)}, 10.0),  # of ten at least
        ({10.0: (10, 9)}, None),
    ],
)
def test_the_stability_margin_is_the_largest_disturbance_that_most_withstand(levels, expected):
    result, impulse = rows(levels)
    found = of_campaign(result, impulse)
    assert (found["Stability_margin"].value if "Stability_margin" in found else None) == expected
    fell = sum(failed for _, failed in levels.values())
    assert found["fall_percentage"].value == pytest.approx(100.0 * fell / len(result["runs"]))
