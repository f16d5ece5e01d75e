"""The step back: when it is taken, what it changes, and that uphill it keeps the walker up."""

from __future__ import annotations

import math

import numpy as np
import pytest

from biped.control.planar.tick import torso_falls_back
from biped.ensemble import campaign
from biped.ensemble.plan import Plan
from biped.scenario.devices import Actuation
from biped.scenario.keys import Backstep, Scenario
from biped.scenario.reading import read_scenario
from biped.scenario.world import Ground
from tests.ticks import Bench, states

ON = Scenario(actuation=Actuation(torque_limit=1e9), backstep=Backstep(margin=0.05, theta_l=60.0))


def falls_back(c, place: float, speed: float, contacts: dict[int, float]) -> bool:
    """Whether a torso 1 m above the ground falls back over contacts (point to place [m]); both legs begin swinging."""
    c["memory"]["believed"][:] = 0
    for point, x in contacts.items():
        c["memory"]["believed"][point] = 1
        c["at"]["point"][point, 0] = x - place
    c["memory"]["phase"][:] = [0, 2] if contacts else [2, 2]
    torso_falls_back(c, np.array([place, 1.0, *[0.0] * 7]), np.array([speed, *[0.0] * 8]))
    return bool(c["memory"]["back"])


def test_it_falls_back_when_its_extrapolated_centre_is_behind_every_contact():
    c = Bench(ON).c
    reach = math.sqrt(1.0 / 9.81)
    assert falls_back(c, -0.06, 0.0, {1: 0.0})
    assert c["memory"]["phase"].tolist() == [0, 3], "the leg in the air is extended, the other stands"
    assert not falls_back(c, -0.04, 0.0, {1: 0.0})
    assert c["memory"]["phase"].tolist() == [0, 2]
    assert not falls_back(c, -0.06, 0.02 / reach, {1: 0.0})
    assert falls_back(c, 0.2, -0.26 / reach, {1: 0.0})
    assert not falls_back(c, -0.06, 0.0, {1: 0.0, 2: -0.3}), "the rear toe still stands"
    assert not falls_back(c, -9.0, 0.0, {}), "in flight nothing is behind anything"


def test_behind_means_vertically_below_on_a_slope():
    c = Bench(Scenario(backstep=Backstep(margin=0.0), ground=Ground(slope=5.0))).c
    below = math.tan(math.radians(5.0))
    assert falls_back(c, below - 0.001, 0.0, {1: 0.0})
    assert not falls_back(c, below + 0.001, 0.0, {1: 0.0})


def test_only_the_thigh_of_a_leg_that_steps_back_has_another_couple():
    on, off = Bench(ON), Bench(Scenario(actuation=Actuation(torque_limit=1e9)))
    seen = 0
    for q, v in states(200, seed=4):
        on.tick(q, v), off.tick(q, v)
        c, plain = on.c, off.c
        if not c["memory"]["back"]:
            np.testing.assert_array_equal(c["tick"]["Q_d"], plain["tick"]["Q_d"])
            continue
        for leg in range(2):
            if c["memory"]["phase"][leg] != 3:
                assert c["tick"]["Q_d"][3 + 3 * leg] == plain["tick"]["Q_d"][3 + 3 * leg]
                continue
            seen += 1
            thigh = q[2] + q[3 + 3 * leg] + np.pi / 2
            couple = -300.0 * (thigh - np.radians(60.0)) - 10.0 * (v[2] + v[3 + 3 * leg])
            assert c["tick"]["Q_d"][3 + 3 * leg] == pytest.approx(couple)
            assert c["tick"]["Q_d"][4 + 3 * leg] == pytest.approx(-30.0 * q[4 + 3 * leg] - 5.0 * v[4 + 3 * leg])
    assert seen > 20


def test_the_knee_of_a_leg_that_steps_back_is_bent_until_its_thigh_is_back():
    plain, bent = (
        Bench(Scenario(actuation=ON.actuation, backstep=Backstep(margin=0.05, theta_l=90.0, **knee)))
        for knee in ({}, {"bend": 1.5, "k_d3": 80.0, "b_d3": 4.0})
    )
    ahead, behind = 0, 0
    for q, v in states(400, seed=4):
        bent.tick(q, v), plain.tick(q, v)
        for leg in range(2):
            knee = 4 + 3 * leg
            Q = bent.c["tick"]["Q_d"]
            if not bent.c["memory"]["back"] or bent.c["memory"]["phase"][leg] != 3:
                assert Q[knee] == plain.c["tick"]["Q_d"][knee]
                continue
            to_go = q[2] + q[3 + 3 * leg] + np.pi / 2 - np.radians(90.0)
            ahead, behind = ahead + (to_go > 0.0), behind + (to_go <= 0.0)
            rest = -1.5 * max(to_go, 0.0)
            assert Q[knee] == pytest.approx(-80.0 * (q[knee] - rest) - 4.0 * v[knee])
            assert Q[knee - 1] == plain.c["tick"]["Q_d"][knee - 1], "the thigh's couple is the same"
    assert min(ahead, behind) > 10


@pytest.mark.slow
def test_stepping_back_keeps_it_up_on_eight_degrees():
    """Without it about six of ten walk up 8°, with it nine or more (docs/notes/robust-search.md)."""
    walked = {}
    for name, changes in (("off", []), ("on", ["backstep={}"])):
        plan = Plan(read_scenario("robust/own", ["ground.slope=8.0", "randomise.runs=24", *changes]))
        with campaign.rows_of(plan, range(len(plan)), campaign.cores()) as rows:
            walked[name] = sum(row.walked for row in rows)
    assert walked["on"] >= walked["off"] + 3
