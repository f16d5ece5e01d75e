"""A push in pieces has the impulse of the force that it stands for, whatever the shape and the clock."""

from __future__ import annotations

import math
from itertools import pairwise

import pytest

from biped.base.errors import InputError
from biped.scenario.keys import Scenario, Simulation
from biped.scenario.pushing import pieces
from biped.scenario.reading import read_scenario
from biped.scenario.world import Push


def run(rate: float = 1000.0, seconds: float = 10.0, **push) -> Scenario:
    given = {"at": 1.0, "duration": 2.0, "force": (60.0, -20.0)} | push
    return Scenario(push=(Push(**given),), simulation=Simulation(control_rate=rate), duration=seconds)


def impulse(found, until: float = math.inf) -> tuple[float, float]:
    held = [(min(p.end, until) - min(p.start, until), *p.force) for p in found]
    return sum(s * f for s, f, _ in held), sum(s * u for s, _, u in held)


def test_a_constant_push_is_one_piece_to_the_last_digit():
    assert pieces(run(at=0.1, duration=0.2)) == ((0.1, 0.1 + 0.2, (60.0, -20.0), "torso"),)


@pytest.mark.parametrize("rate", [1000.0, 500.0, 125.0])
def test_a_ramp(rate):
    found = pieces(run(rate, shape="ramp"))
    assert impulse(found) == pytest.approx((60.0, -20.0))  # half of the force for 2 s
    assert impulse(found, 2.0) == pytest.approx((15.0, -5.0))
    assert [b.start for b in found[1:]] == pytest.approx([a.end for a in found[:-1]])
    assert all(a.force[0] < b.force[0] < 60.0 for a, b in pairwise(found))


@pytest.mark.parametrize("frequency", [0.1, 0.5, 1.0, 2.0, 20.0])
def test_a_sine(frequency):
    found = pieces(run(shape="sine", frequency=frequency))
    for until in (0.5, 1.0, 1.7, 2.0):
        exact = 60.0 * (1.0 - math.cos(2.0 * math.pi * frequency * until)) / (2.0 * math.pi * frequency)
        near = 60.0 * 1e-3  # a piece that is cut has its mean force to the cut
        assert impulse(found, 1.0 + until)[0] == pytest.approx(exact, abs=near)
    assert impulse(found)[0] == pytest.approx(
        60.0 * (1.0 - math.cos(4.0 * math.pi * frequency)) / (2.0 * math.pi * frequency), abs=1e-9
    )
    assert max(p.end - p.start for p in found) <= max(1e-3, min(0.01, 0.05 / frequency)) + 1e-9


def test_a_push_ends_with_the_run():
    found = pieces(run(seconds=1.5, shape="ramp"))
    assert found[-1].end == pytest.approx(1.5)
    assert impulse(found)[0] == pytest.approx(60.0 * 0.5**2 / 4.0)


def test_too_many_pieces():
    with pytest.raises(InputError, match=r"push\[0\].duration: expected at most 10000 pieces.*got 19500"):
        read_scenario("level_normal", ["duration=200.0", "push=[{at=5.0,duration=500.0,force=[1.0,0.0],shape='sine'}]"])


@pytest.mark.parametrize(
    ("push", "said"),
    [
        ("shape='saw'", r"push\[0\].shape: expected one of constant, ramp, sine"),
        ("frequency=0", r"push\[0\].frequency"),
    ],
)
def test_what_no_push_has(push, said):
    with pytest.raises(InputError, match=said):
        read_scenario("level_normal", [f"push=[{{at=5.0,duration=1.0,force=[1.0,0.0],{push}}}]"])


def test_a_train_of_pushes_is_as_many_apart_as_it_says():
    found = pieces(run(seconds=9.5, duration=0.2, times=5, every=2.0))
    assert [(p.start, round(p.end, 9)) for p in found] == [(1.0, 1.2), (3.0, 3.2), (5.0, 5.2), (7.0, 7.2), (9.0, 9.2)]
    assert {p.force for p in found} == {(60.0, -20.0)}
    assert len(pieces(run(seconds=6.0, duration=0.2, times=5, every=2.0))) == 3, "those after the end do not come"
    ramps = pieces(run(duration=0.5, shape="ramp", times=3, every=1.0))
    assert impulse(ramps) == pytest.approx((3 * 15.0, 3 * -5.0))
