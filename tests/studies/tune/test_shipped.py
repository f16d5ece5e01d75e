"""What was found and ships: gaits that walk at their speed, stand, and stop."""

from __future__ import annotations

import pytest

from biped.ensemble.plan import Plan
from biped.scenario.reading import read_scenario


@pytest.mark.parametrize(
    ("name", "changes", "speed"),
    [
        ("robust/own", [], 0.79),
        ("robust/own", ["gains.speed=0.6"], 0.6),
        ("robust/own", ["gains.speed=1.0"], 1.0),
        ("robust/model_error", [], 0.79),
        ("robust/efficient", ["sweep={}"], 0.77),
    ],
)
def test_shipped_gaits_walk_at_their_speed(name, changes, speed):
    from biped.ensemble.campaign import run_one

    scenario = read_scenario(name, [*changes, "duration=8.0"])
    _, row = run_one(Plan(scenario), 0)
    assert row.walked
    assert row.speed == pytest.approx(speed, rel=0.05)


def test_upright_with_every_contact_kept_it_stands_through_a_push():
    from biped.ensemble.campaign import run_one

    _, row = run_one(Plan(read_scenario("robust/stand", ["duration=5.0"])), 0)
    assert not row.fell
    assert abs(row.distance) < 0.1


def test_it_stops_at_any_moment_of_a_stride_and_stands():
    """About 15 of 16 do (docs/robust.md); the first change slows them down, the last brings the torso upright."""
    from biped.ensemble.campaign import run_one

    plan = Plan(read_scenario("robust/walk_to_stand"))
    rows = [run_one(plan, i)[1] for i in range(8)]
    assert sum(row.stood for row in rows) >= 6
    assert all(row.distance > 3.0 for row in rows), "they walked first"
    assert not any(row.stood for row in [run_one(Plan(read_scenario("robust/own")), 0)[1]])
