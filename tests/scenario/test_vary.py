"""Points are made when asked for; every draw is checked before the first run."""

from __future__ import annotations

import itertools

import pytest

from biped.base.errors import InputError
from biped.ensemble.plan import Plan
from biped.scenario.keys import Scenario
from biped.scenario.possible import MOST_RUNS
from biped.scenario.randomise import Distribution, Randomise
from biped.scenario.vary import DRAW, Points, drawn, points_of, run_seed, with_values
from biped.scenario.world import Ground


def test_points_are_the_product_the_last_key_fastest():
    sweep = {"a": (1.0, 2.0), "b": (3.0, 4.0, 5.0)}
    points = Points(sweep)
    assert list(points) == [dict(zip(sweep, values, strict=True)) for values in itertools.product(*sweep.values())]
    assert points[-1] == points[5] == {"a": 2.0, "b": 5.0}
    assert points[1:3] == [points[1], points[2]]
    with pytest.raises(IndexError):
        points[6]
    assert list(Points({})) == [{}]


def test_points_are_made_when_they_are_asked_for():
    many = tuple(map(float, range(100_000)))
    points = points_of(Scenario(sweep={"ground.slope": many, "ground.friction": many}))
    assert len(points) == 10**10
    assert points[123_456_789] == {"ground.slope": 1234.0, "ground.friction": 56_789.0}


def test_a_value_in_a_list_is_changed_and_the_rest_stays():
    s = Scenario()
    varied = with_values(s, {"truth.mass.3": 2.0, "start.v.1": 0.5, "simulation.iterations": 7}, DRAW)
    assert varied.truth.mass == (1.0, 1.0, 1.0, 2.0, 1.0, 1.0, 1.0)
    assert varied.start.v[1] == 0.5
    assert varied.simulation.iterations == 7
    assert with_values(varied, {"truth.mass.3": 1.0, "start.v.1": 0.0, "simulation.iterations": 100}, DRAW) == s


@pytest.mark.parametrize("value", [float("nan"), float("inf"), (1.0, float("nan"))])
def test_values_are_finite(value):
    with pytest.raises(InputError, match="finite"):
        with_values(Scenario(), {"ground.friction": value}, DRAW)


def test_every_draw_is_checked_before_the_first_run():
    draw = {"ground.friction": Distribution(normal=(1.0, 0.35))}
    scenario = Scenario(randomise=Randomise(draw=draw))
    frictions = [drawn(scenario, i, run_seed(0, i))["ground.friction"] for i in range(88)]
    assert min(frictions[:87]) > 0.0 > frictions[87]
    Plan(Scenario(randomise=Randomise(runs=87, draw=draw)))
    with pytest.raises(InputError, match=r"run 87: ground\.friction = -0\.0075") as caught:
        Plan(Scenario(randomise=Randomise(runs=88, draw=draw)))
    assert caught.value.key == "randomise.draw"
    checked_before = Plan(Scenario(randomise=Randomise(runs=88, draw=draw)), checked=True)
    with pytest.raises(InputError, match="run 87"):
        checked_before.run(87)


def test_what_differs_in_its_seed_alone_is_checked_once(monkeypatch):
    asked = []
    whole = Plan._drawn
    monkeypatch.setattr(Plan, "_drawn", lambda self, index: asked.append(index) or whole(self, index))
    Plan(Scenario(randomise=Randomise(runs=MOST_RUNS)))
    assert asked == [0]
    asked.clear()
    grids = {"ground.friction": Distribution(grid=(1.0, 2.0)), "ground.slope": Distribution(grid=(0.0, 1.0, 2.0))}
    Plan(Scenario(randomise=Randomise(runs=MOST_RUNS, draw=grids)))
    assert asked == list(range(6))


def test_contacts_of_a_rigid_ground_have_no_time():
    from biped.scenario.possible import possible

    def fail(key, what):
        return InputError(f"{key}: {what}")

    ground = Ground(contact_time=1e-4)
    possible(Scenario(engine="home", ground=ground), fail)
    with pytest.raises(InputError, match="two time steps"):
        possible(Scenario(ground=ground), fail)


def test_a_deviation_of_minus_zero_is_none():
    scenario = Scenario(randomise=Randomise(draw={"ground.slope": Distribution(normal=(2.0, -0.0))}))
    assert drawn(scenario, 0, 0) == {"ground.slope": 2.0}
