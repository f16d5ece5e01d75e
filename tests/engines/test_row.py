"""Kernels that log any robot's state and forces, against what MuJoCo's own functions say."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from biped.engines.mujoco import simulate
from biped.ensemble.plan import Plan
from biped.scenario.reading import read_scenario
from tests.engines.test_mujoco import named


def watched(model: str, *changes: str):
    """A short stand, and MuJoCo's forces of the ground at every tick."""
    forces = []

    def watch(m: mujoco.MjModel, d: mujoco.MjData, _: np.ndarray) -> None:
        total, one = np.zeros(3), np.zeros(6)
        for i in range(d.ncon):
            contact = d.contact[i]
            mujoco.mj_contactForce(m, d, i, one)
            side = (m.geom_bodyid[contact.geom1] == 0) * 1.0 - (m.geom_bodyid[contact.geom2] == 0)
            total += side * contact.frame.reshape(3, 3).T @ one[:3]
        forces.append(total)

    return simulate(Plan(read_scenario(named(model), list(changes))).run(0), watch), np.array(forces)


@pytest.mark.parametrize("cone", ["elliptic", "pyramidal"])
@pytest.mark.parametrize("model", ["h1", "walker2d"])
def test_forces_of_the_ground_are_those_of_mujocos_contacts(model, cone):
    t, forces = watched(model, f"simulation.cone='{cone}'")
    assert np.abs(forces[:, 2]).max() > 100.0
    np.testing.assert_allclose(t.ground_force, forces, rtol=1e-12, atol=1e-9)
    np.testing.assert_allclose(t.force.sum(axis=1), t.ground_force, rtol=1e-12, atol=1e-9)
