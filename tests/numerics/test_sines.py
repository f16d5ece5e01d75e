"""Sines and cosines against numbers with more digits."""

import math

import numpy as np
import pytest

from biped.numerics.lanes import sines


def ours(angle):
    sin, cos = np.empty_like(angle), np.empty_like(angle)
    sines(angle, len(angle), sin, cos)
    return sin, cos


@pytest.mark.parametrize("reach", [1.0, 10.0, 1e3, 9.9e3])
def test_within_a_rounding_error(reach):
    angle = np.random.default_rng(0).uniform(-reach, reach, 20000)
    sin, cos = ours(angle)
    exact = angle.astype(np.longdouble)
    assert np.abs(sin - np.sin(exact)).max() < 1.2e-16
    assert np.abs(cos - np.cos(exact)).max() < 1.2e-16


def test_special_angles():
    sin, cos = ours(np.array([0.0, 0.5 * math.pi, math.pi, -0.5 * math.pi]))
    np.testing.assert_allclose(sin, [0.0, 1.0, 0.0, -1.0], atol=1.3e-16)
    np.testing.assert_allclose(cos, [1.0, 0.0, -1.0, 0.0], atol=1.3e-16)


def test_only_as_many_as_asked_for():
    sin, cos = np.full(3, 7.0), np.full(3, 7.0)
    sines(np.zeros(3), 2, sin, cos)
    assert sin.tolist() == [0.0, 0.0, 7.0]
    assert cos.tolist() == [1.0, 1.0, 7.0]


@pytest.mark.parametrize("angle", [1e6, -1e18, 1e300])
def test_far_away_it_is_the_librarys(angle):
    sin, cos = ours(np.array([angle]))
    assert (sin[0], cos[0]) == (math.sin(angle), math.cos(angle))


def test_what_is_not_finite_stays_so():
    sin, cos = ours(np.array([np.nan]))
    assert np.isnan([sin[0], cos[0]]).all()
