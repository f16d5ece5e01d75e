"""Torques from the floating coordinates are the general allocation's, tick by tick, in walks."""

from __future__ import annotations

import numpy as np
import pytest

from biped.ensemble import campaign
from biped.ensemble.plan import Plan
from biped.scenario.reading import read_scenario
from tests.ticks import Bench

WALKS = {
    "normal": ("level_normal",),
    "fast": ("level_fast",),
    "own": ("robust/own",),  # with u_0
    "touching": ("level_normal", "reading='touching'"),
    "push": ("push_forward",),
    "single": ("level_slow", "actuation.single_tangential=true", "ground.slope=-1.0"),
}


def compare(name: str, *changes: str) -> tuple[int, float]:
    """Ticks compared and the largest difference of torques, relative to each tick's largest; sets must be the same.

    The walk has its motors' limits, without which some of these fall; the torques that are compared have none.
    """
    walk = campaign.simulate(Plan(read_scenario(name, [*changes])).run(0))
    free = Plan(read_scenario(name, [*changes, "actuation.torque_limit=1e9"])).run(0).scenario
    floating, general = Bench(free), Bench(free, general=True)
    worst = 0.0
    for k in range(len(walk)):
        q, v = walk.q[k].copy(), walk.v[k].copy()
        for bench in (floating, general):
            bench.c["memory"]["phase"] = walk.phase[k].astype(int) - 1
        u, other = floating.tick(q, v, k), general.tick(q, v, k)
        assert floating.active == general.active, k
        assert floating.c["tick"]["rank"] == general.c["tick"]["rank"], k
        assert floating.c["tick"]["rows"] == general.c["tick"]["rows"], k
        worst = max(worst, np.abs(u - other).max() / np.abs(other).max())
    return len(walk), worst


@pytest.mark.parametrize("name", WALKS)
def test_same_sets_and_torques(name):
    ticks, worst = compare(*WALKS[name], "duration=1.0", "window.start=0.0", "window.end=1.0", "push=[]")
    assert ticks == 1000
    assert worst < 1e-10


@pytest.mark.slow
@pytest.mark.parametrize("name", WALKS)
def test_same_sets_and_torques_for_ten_seconds(name):
    ticks, worst = compare(*WALKS[name])
    assert ticks == 10000
    assert worst < 1e-10
