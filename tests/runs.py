"""Short runs that several tests look at; each is simulated once."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np

from biped.engines.planar.mujoco import simulate
from biped.ensemble.plan import Plan
from biped.measure.seven_links import PlanarTrajectory
from biped.measure.trajectory import Trajectory
from biped.robot.columns import COLUMNS, WIDTH
from biped.robot.load import load_robot
from biped.robot.planar.model import tree_at
from biped.robot.planar.tree import Tree
from biped.scenario.devices import Actuation
from biped.scenario.keys import Fall, Scenario, Simulation, Start
from biped.scenario.world import Ground, Push
from tests.ticks import HUMAN

SCENARIOS = {
    "walk": Scenario(duration=2.0, start=Start(posture="heel_toe")),
    "long": Scenario(duration=5.0, start=Start(posture="heel_toe")),
    "slope": Scenario(duration=1.0, start=Start(posture="heel_toe"), ground=Ground(slope=4.0)),
    "slippery": Scenario(duration=1.0, start=Start(posture="heel_toe"), ground=Ground(friction=0.3)),
    "pushed": Scenario(
        duration=1.0, start=Start(posture="flat"),
        push=(Push(at=0.2, duration=0.2, force=(150.0, 40.0)),
              Push(at=0.3, duration=0.3, force=(-80.0, 0.0), body="left_shank")),
        ground=Ground(slope=-3.0),
    ),
    "generalized": Scenario(
        duration=1.0, start=Start(posture="heel_toe"), actuation=Actuation(mode="generalized")
    ),
    "pyramidal": Scenario(duration=1.0, start=Start(posture="heel_toe"), simulation=Simulation(cone="pyramidal")),
    "folded": Scenario(  # in the air, a knee that is bent as far as it can be
        duration=0.4,
        start=Start(posture="flat", q=(0.0, 2.5, 1.57, 3.1, 3.0, 0.0, 3.1, 0.6, 0.0), v=(0.0,) * 7 + (-10.0, 0.0),
                    contacts=()), fall=Fall(height=0.01),
    ),
    "substeps": Scenario(duration=1.0, start=Start(posture="heel_toe"), simulation=Simulation(timestep=5e-4)),
}  # fmt: skip


@lru_cache(maxsize=16)
def made(name: str) -> Trajectory:
    """The trajectory of one of `SCENARIOS`."""
    return simulate(Plan(SCENARIOS[name]).run(0))


def mirrored(t: Trajectory) -> Trajectory:
    """The run as seen in a mirror: right is left and left is right."""
    swap = {
        "q": [0, 1, 2, 6, 7, 8, 3, 4, 5], "v": [0, 1, 2, 6, 7, 8, 3, 4, 5], "Q_d": [0, 1, 2, 6, 7, 8, 3, 4, 5],
        "u": [3, 4, 5, 0, 1, 2], "phase": [1, 0], "believed": [2, 3, 0, 1], "active": [2, 3, 0, 1, 5, 4],
        "height": [2, 3, 0, 1], "force": [2, 3, 0, 1], "stop": [1, 0],
    }  # fmt: skip
    sides = {"right": "left", "left": "right"}
    pushes = tuple((*push, "_".join(sides.get(word, word) for word in body.split("_"))) for *push, body in t.pushes)
    other = replace(t, log=t.log.copy(), pushes=pushes)
    for name, order in swap.items():
        other.column(name)[:] = t.column(name)[:, order]
    return other


def synthetic(seconds: float, **columns) -> Trajectory:
    """A run of made-up columns (arrays or constants); everything else is zero."""
    n = round(seconds * 1000)
    t = PlanarTrajectory(
        np.zeros((n, WIDTH)), 0.001, 0.0, False, (200.0,) * 6, (), "completed", "", {}, load_robot(HUMAN, None)
    )
    t.time[:] = np.arange(n) * 0.001
    for name, value in columns.items():
        assert name in COLUMNS
        t.column(name)[:] = value
    return t


@lru_cache(maxsize=1)
def tree() -> Tree:
    return tree_at(HUMAN)
