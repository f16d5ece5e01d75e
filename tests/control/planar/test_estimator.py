"""What the robot knows of its posture: (4.8) from what touches, (4.9) from the gyro, and what comes between."""

from __future__ import annotations

import math

import numpy as np
import pytest

from biped.base.files import folder
from biped.control.planar.estimator import ANGLE, CLIPPED, GYRO, RATE, estimate, fit_line, read_gyro, read_switches
from biped.control.planar.senses import Senses
from biped.ensemble.plan import Plan
from biped.robot.columns import FORCE, WIDTH
from biped.robot.planar.model import posture_of, tree_at
from biped.robot.planar.posture import project
from biped.robot.planar.topology import BASE, HIP, N_POINTS, NU, PITCH, X, Z
from biped.robot.planar.tree import motion
from biped.scenario.devices import Encoders, Estimator, Gyro, Switches
from biped.scenario.keys import Scenario, Sensors, Start

TREE = tree_at(folder("models") / "robot.xml")
POINTS = ("right_toe", "right_heel", "left_toe", "left_heel")
EXACT = Encoders(resolution=(0.0, 0.0, 0.0))
QUIET = Gyro(noise=0.0, range=1e6, cutoff=1e9)
DT = 1e-3


def senses(count: int, q, v, encoders=EXACT, gyro=QUIET, switches=None, estimator=None) -> Senses:
    sensors = Sensors(encoders=encoders, gyro=gyro, switches=switches or Switches())
    s = Scenario(model="robot", controller="robot", sensors=sensors, estimator=estimator or Estimator(), duration=1.0)
    return Senses(Plan(s).run(0), TREE, q, v, count)


def inferred(one: Senses, log, k, q, v):
    estimate(one.record[0], one.noise, one.angle_noise, one.noted, q, v, log, k, 0, one.joints, one.q, one.v)


def standing(*names: str, seed: int = 0) -> np.ndarray:
    """A posture on the named points."""
    q, _ = posture_of(folder("models") / "robot.xml", "flat")
    q[PITCH:] += 0.05 * np.random.default_rng(seed).normal(size=7)
    q[[4, 7]] = -np.abs(q[[4, 7]])
    return project(TREE, q, names, POINTS)


@pytest.mark.parametrize(
    "names", [("right_toe", "right_heel"), ("right_heel", "left_toe"), ("right_toe", "left_toe"), POINTS[:3], POINTS]
)
def test_points_on_the_ground_give_the_torsos_angle(names):
    q = standing(*names, seed=3)
    one = senses(1, q, np.zeros(9))
    e = one.record[0]
    e["touching"] = [name in names for name in POINTS]
    assert fit_line(e, q[BASE:]) == len(names)
    assert e["fit"][0] == pytest.approx(q[PITCH], abs=1e-9)
    place = motion(TREE, q, np.zeros(9)).point[[POINTS.index(name) for name in names]]
    centred = place - place.mean(axis=0)
    assert e["fit"][3] == pytest.approx(2.0 * math.sqrt((centred**2).sum() / len(names)))


def test_three_points_that_disagree_are_fitted_by_least_squares():
    """The line of least squares of the points' heights, found by brute force."""
    q = standing(*POINTS[:3], seed=4)
    joints = q[BASE:] + np.array([0.0, 0.0, 3e-3, 0.0, 0.0, 0.0])  # an encoder's zero that is off
    one = senses(1, q, np.zeros(9))
    e = one.record[0]
    e["touching"] = [1, 1, 1, 0]
    fit_line(e, joints)
    turned = q.copy()
    turned[BASE:] = joints
    angles = np.linspace(q[PITCH] - 0.01, q[PITCH] + 0.01, 20001)
    many = np.tile(turned, (len(angles), 1))
    many[:, PITCH] = angles
    height = motion(TREE, many, np.zeros(9)).point[:, :3, 1]
    spread = ((height - height.mean(axis=1, keepdims=True)) ** 2).sum(axis=1)
    assert e["fit"][0] == pytest.approx(angles[np.argmin(spread)], abs=2e-6)
    assert abs(e["fit"][0] - q[PITCH]) > 1e-4, "an error that matters"


def moving(k: int) -> tuple[np.ndarray, np.ndarray]:
    """A biped that turns about its flat right foot, as an inverted pendulum of one joint."""
    q, v = standing("right_toe", "right_heel", seed=5), np.zeros(9)
    rate = 0.4
    q[PITCH] += rate * k * DT
    q[HIP[0]] -= rate * k * DT
    v[PITCH], v[HIP[0]] = rate, -rate
    v[HIP[1]] = 0.0
    place = motion(TREE, q, v)
    q[X] -= place.point[0, 0]
    q[Z] -= place.point[0, 1]
    v[X] -= place.point_velocity[0, 0]
    v[Z] -= place.point_velocity[0, 1]
    return q, v


def test_a_standing_foot_tells_all_of_the_posture():
    q, v = moving(0)
    one, log = senses(50, q, v), np.zeros((50, WIDTH))
    log[:, FORCE + 1 : FORCE + 4 : 2] = 50.0  # the right foot presses
    for k in range(50):
        q, v = moving(k)
        inferred(one, log, k, q, v)
        np.testing.assert_allclose(one.q[PITCH:], q[PITCH:], atol=1e-9)
        assert one.q[Z] == pytest.approx(q[Z], abs=1e-9)
        if k > 0:  # differences lag by half a tick
            np.testing.assert_allclose(one.v, v, atol=2e-3)
    np.testing.assert_allclose(one.noted[1:, RATE], 0.4, atol=1e-6)
    assert not one.noted[:, GYRO].any()


def test_in_the_air_the_gyro_is_integrated_and_clips():
    q, v = moving(0)
    q[Z] += 0.5
    rate = math.radians(200.0)
    v[PITCH] = rate
    one, log = senses(101, q, v, gyro=Gyro(noise=0.0, cutoff=1e9)), np.zeros((101, WIDTH))
    for k in range(101):
        inferred(one, log, k, q, v)
    assert one.noted[1:, GYRO].all()
    assert one.noted[:, CLIPPED].all()
    turned = one.noted[100, ANGLE] - one.noted[0, ANGLE]
    assert turned == pytest.approx(math.radians(150.0) * 0.1, rel=1e-9), "not 200 degrees a second"
    assert one.v[Z] == pytest.approx(v[Z] - 9.81 * 0.101, abs=1e-9), "a body in the air falls"


def test_the_filter_halves_the_power_at_its_cutoff():
    q, v = moving(0)
    one = senses(2000, q, v, gyro=Gyro(noise=0.0, range=1e6))
    t = DT * np.arange(2000)
    out = np.array([read_gyro(one.record[0], math.sin(2 * math.pi * 50.0 * s), 0.0, i == 0) for i, s in enumerate(t)])
    # The sampled filter is the zero-order hold's: |H|² = a² / (1 - 2 (1 - a) cos w + (1 - a)²).
    a = -math.expm1(-2.0 * math.pi * 0.05)
    expected = a / math.sqrt(1.0 - 2.0 * (1.0 - a) * math.cos(2.0 * math.pi * 0.05) + (1.0 - a) ** 2)
    assert out[1000:].max() == pytest.approx(expected, rel=1e-2)
    assert expected == pytest.approx(math.sqrt(0.5), rel=0.05)


def test_noise_has_the_density_asked_for():
    one = senses(200_000, *moving(0), gyro=Gyro(noise=0.05))
    # Power over a band: density² x bandwidth up to half the rate of sampling.
    assert np.degrees(one.noise.std()) == pytest.approx(0.05 * math.sqrt(500.0), rel=0.01)


def test_encoders_round_and_their_zeros_are_drawn_once_a_run():
    q, v = moving(0)
    one = senses(1, q, v, encoders=Encoders(reference_error=0.2))
    inferred(one, np.zeros((1, WIDTH)), 0, q, v)
    step = np.radians([4.2e-3, 7.3e-3, 4.2e-3] * 2)
    np.testing.assert_allclose(one.joints / step, np.rint(one.joints / step), atol=1e-9)
    off = np.degrees(one.record[0]["reference"])
    assert off.shape == (NU,)
    assert 0.02 < np.abs(off).max() < 0.8
    assert np.abs(one.joints - q[BASE:] - np.radians(off)).max() <= step.max() / 2 + 1e-12


def test_switches_have_hysteresis_and_wait():
    q, v = moving(0)
    q[Z] += 0.1
    one = senses(1, q, v, switches=Switches(force=5.0, release=2.0, debounce=0.002))
    log, e, seen = np.zeros((20, WIDTH)), one.record[0], []
    force = [0, 4.9, 5.1, 5.1, 5.1, 3.0, 2.1, 1.0, 3.0, 1.0, 1.0, 1.0, 1.0]
    for k in range(len(force)):
        log[k, FORCE + 1] = force[k]
        read_switches(e, q, v, log, k)
        seen.append(int(e["touching"][0]))
    # Believed two ticks after the third of three; what is between the forces changes nothing.
    assert seen == [0, 0, 0, 0, 0, 1, 1, 1, 1, 1, 1, 1, 0]
    assert e["touching"].shape == (N_POINTS,)


def test_a_change_of_source_is_blended():
    """The gyro is wrong by 20 degrees a second in the air; where the foot lands, the estimate goes over in 10 ms."""
    q, v = moving(0)
    lifted = q.copy()
    lifted[Z] += 0.1
    one, log = senses(200, lifted, v * 0.0, gyro=Gyro(noise=0.0, bias=20.0, cutoff=1e9)), np.zeros((200, WIDTH))
    log[100:, FORCE + 1 : FORCE + 4 : 2] = 50.0
    for k in range(200):
        inferred(one, log, k, lifted if k <= 100 else q, np.zeros(9))
    error = np.degrees(one.noted[:, ANGLE] - q[PITCH])
    assert error[100] == pytest.approx(2.0, rel=0.02)
    assert error[99] < error[101] < 2.1
    assert np.abs(np.diff(error)).max() < 0.25
    np.testing.assert_allclose(error[112:], 0.0, atol=1e-6)


def test_a_narrow_support_is_left_to_the_gyro():
    q = standing("right_toe", "left_toe", seed=6)
    place = motion(TREE, q, np.zeros(9)).point
    width = abs(place[0, 0] - place[2, 0])
    for asked, by_gyro in ((0.9 * width, 0.0), (1.1 * width, 1.0)):
        one, log = senses(3, q, np.zeros(9), estimator=Estimator(width=asked)), np.zeros((3, WIDTH))
        log[:, [FORCE + 1, FORCE + 5]] = 50.0
        for k in range(3):
            inferred(one, log, k, q, np.zeros(9))
        assert one.noted[2, GYRO] == by_gyro


def test_metrics_and_the_fall_test_use_the_truth():
    """Zeros that are off by 3 degrees mislead the law; the log and the verdict know better."""
    from biped.engines.planar import mujoco

    sensors = Sensors(encoders=Encoders(reference_error=3.0), gyro=Gyro(), switches=Switches())
    s = Scenario(model="robot", controller="robot", sensors=sensors, estimator=Estimator(), duration=0.05,
                 start=Start(posture="flat"))  # fmt: skip
    run = Plan(s).run(0)
    t = mujoco.simulate(run)
    assert t.inferred is not None
    assert len(t.inferred) == len(t)
    np.testing.assert_array_equal(t.q[0], run.q)
    assert np.abs(np.degrees(t.inferred[10:, ANGLE] - t.q[10:, PITCH])).max() > 0.3
