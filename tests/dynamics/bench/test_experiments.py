"""The bench of Figs 4.7 and 4.8: the numbers that Table 4.1 implies, and two solvers that agree."""

from __future__ import annotations

import math

import numpy as np
import pytest

from biped.dynamics.bench.experiments import measure
from biped.dynamics.bench.followed import FIG_4_8, linear_response
from biped.dynamics.bench.leg import MODEL, READINGS, in_mujoco, leg_of
from biped.dynamics.bench.swings import joints, small_swing
from biped.dynamics.mechanisms.leg import NO_DRIVE

HIP, KNEE = joints()
BUILT, DRY, HIGH, SQUARED = READINGS


@pytest.mark.parametrize(
    ("joint", "reading", "period", "damping"),
    [
        (HIP, BUILT, 1.4165, 0.02244), (HIP, HIGH, 1.5813, 0.0201), (HIP, SQUARED, 1.5813, 0.5025),
        (KNEE, BUILT, 1.1028, 0.0714), (KNEE, HIGH, 1.3005, 0.0606), (KNEE, SQUARED, 1.3005, 1.514),
    ],
)  # fmt: skip
def test_periods_and_damping(joint, reading, period, damping):
    found = small_swing(leg_of(MODEL, reading), joint)
    assert found == pytest.approx((period, damping), rel=6e-4)


def test_the_hips_period_by_hand():
    """A compound pendulum: inertia about the hip 0.653 kg m², moment of the weight 12.85 N m."""
    inertia = 0.0096 + 0.67 * 0.147**2 + 0.84 * 0.295**2 + 0.0069 + 0.55 * 0.435**2 + 0.84 * 0.593**2
    inertia += 0.0007 + 0.36 * (0.628**2 + 0.014**2) + 0.0067
    weight = 9.81 * math.hypot(0.67 * 0.147 + 0.84 * 0.295 + 0.55 * 0.435 + 0.84 * 0.593 + 0.36 * 0.628, 0.36 * 0.014)
    period = 2.0 * math.pi * math.sqrt(inertia / weight)
    assert small_swing(leg_of(MODEL), HIP)[0] == pytest.approx(period, rel=1e-6)


def test_a_linearisation_of_the_moving_references():
    hip = linear_response(leg_of(MODEL), FIG_4_8)[0]
    assert hip == pytest.approx((64.34, 80.97), abs=0.02)


def test_mujoco_swings_with_the_period_of_small_swings():
    leg = leg_of(MODEL, BUILT)
    small = (math.radians(1.0),) * 3
    angle = in_mujoco(MODEL, leg, NO_DRIVE, HIP.locked, np.array(small), 4.0, 1e-3)[:, 0]
    angle += math.atan2(0.36 * 0.014, 1.30974)  # the foot's mass lies ahead: it hangs back
    falls = np.flatnonzero((angle[:-1] > 0.0) & (angle[1:] <= 0.0))
    exact = falls + angle[falls] / (angle[falls] - angle[falls + 1])
    period, damping = small_swing(leg, HIP)
    assert np.diff(exact).mean() * 1e-3 == pytest.approx(period / math.sqrt(1.0 - damping**2), rel=2e-4)


@pytest.mark.slow
def test_both_solvers_and_the_figures_numbers(tmp_path):
    report = measure()
    apart = [swing.apart for swing in report.swings if not swing.reading.coulomb]
    assert max(apart) < 1e-8
    assert report.followed.apart < 1e-4
    window = np.array(report.followed.window)
    np.testing.assert_allclose(window, [[36.04, 107.92], [17.86, 97.57], [9.09, 120.25]], atol=0.02)
    np.testing.assert_allclose(report.followed.steady, [[35.71, 109.18], [17.44, 98.98], [9.09, 120.17]], atol=0.02)
    # Dry friction takes more at small swings; a gear with damping of n² hardly swings at all.
    for joint in ("hip", "knee"):
        last = [np.abs(s.angle[-600:] - s.angle[-600:].mean()).max() for s in report.swings if s.joint == joint]
        built, dry, high, squared = last
        assert squared < dry < built < high
