"""What the ground does: support, centre of pressure, slip, penetration."""

from __future__ import annotations

import math

import mujoco
import numpy as np
import pytest

from biped.measure.metrics import measure
from biped.robot.planar.build import compile_foreign
from biped.robot.planar.tree import motion
from tests.measure.made_up import WEIGHT, steady
from tests.runs import SCENARIOS, made
from tests.ticks import HUMAN


@pytest.mark.parametrize("name", ["walk", "generalized"])
def test_support_is_mujocos_vertical_force_over_weight(name):
    """Mean of qfrc_constraint on the torso's height, set up afresh at every row of the window."""
    t = made(name)
    model = compile_foreign(HUMAN, SCENARIOS[name]).model
    data = mujoco.MjData(model)
    rows = range(500, len(t))
    vertical = []
    for k in rows:
        data.qpos[:], data.qvel[:], data.qfrc_applied[:] = t.q[k], t.v[k], t.applied[k]
        mujoco.mj_forward(model, data)
        vertical.append(data.qfrc_constraint[1])
    support = measure(t, (0.5, 2.0))["support"]
    assert support == pytest.approx(np.mean(vertical) / WEIGHT, rel=1e-6)


def test_vertical_momentum_explains_the_support():
    """Impulse of the ground less that of gravity is the change of momentum: Newton, whatever the engine says."""
    t = made("walk")
    whole = motion(t.tree, t.q, t.v)
    momentum = (t.tree.mass[:, None] * whole.com_velocity).sum(axis=1)
    impulse = 0.001 * (t.column("force")[:-1].sum(axis=(0, 1)) - [0.0, WEIGHT * (len(t) - 1)])
    np.testing.assert_allclose(momentum[-1] - momentum[0], impulse, atol=0.2)


def test_centre_of_pressure():
    """Of a loaded foot, 0 at the heel and 1 at the toe; a foot that bears next to nothing has none."""
    t = steady()
    t.column("force")[:, :, 1] = [300.0, 100.0, 1.0, 1.0]
    assert measure(t, (1.0, 2.0))["centre_of_pressure"] == pytest.approx(0.75)
    both = steady()
    both.column("force")[:, :, 1] = [300.0, 100.0, 0.0, 50.0]
    assert measure(both, (1.0, 2.0))["centre_of_pressure"] == pytest.approx(0.5 * (0.75 + 0.0))
    assert math.isnan(measure(steady(), (1.0, 2.0))["centre_of_pressure"])


def test_slip_and_penetration():
    t = steady()
    t.column("force")[:, :2, 1] = 10.0, 100.0  # the right foot carries load while everything slides along
    numbers = measure(t, (1.0, 2.0))
    assert numbers["slip"] == pytest.approx(1.0, rel=1e-9)
    lowest = 1.3 - (0.626 * 0.288 + 0.245 + 0.246 + 0.039) * 1.8
    assert numbers["penetration"] == pytest.approx(max(0.0, -lowest), abs=1e-9)
    sunk = steady()
    sunk.q[:, 1] -= lowest + 0.004
    assert measure(sunk, (1.0, 2.0))["penetration"] == pytest.approx(0.004, abs=1e-9)
