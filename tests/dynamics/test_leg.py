"""The hanging leg against Lagrange's equations of its energies, of which nothing is derived by hand.

Kinetic energy is a quadratic form in the rates, so that M and the momenta are exact; derivatives with respect to angles
are by complex steps, exact to rounding.
"""

from __future__ import annotations

import numpy as np
import pytest

from biped.dynamics.mechanisms.leg import LINKS, STICKING, HangingLeg, MovingSprings, hanging_leg

MASS, INERTIA = np.array([1.5, 1.4, 0.36]), np.array([0.018, 0.015, 0.0007])
COM = np.array([[0.01, -0.23], [-0.005, -0.235], [0.014, -0.035]])
JOINT = np.array([[0.0, -0.295], [0.003, -0.298], [0.0, 0.0]])
LEG = HangingLeg(MASS, INERTIA, COM, JOINT, np.array([0.0067, 0.0022, 0.005]), np.array([0.13, 0.11, 0.05]),
          np.array([0.09, 0.05, 0.08]))  # fmt: skip
DRIVE = MovingSprings(np.array([2.0, 1.5, 1.0]), np.array([0.2, 0.3, 0.1]), np.array([1.0, 0.5, 0.4]),
              np.array([4.7, 9.4, 18.8]), np.array([0.0, -1.5, 0.2]), np.array([0.1, -1.5, 0.5]))  # fmt: skip
STEP = 1e-30


def places(q):
    """Centres of mass (3, 2) of the links, by turning and adding up."""
    at, out = np.zeros(2, complex), []
    for link in range(LINKS):
        c, s = np.cos(q[link]), np.sin(q[link])
        turn = np.array([[c, -s], [s, c]])
        out.append(at + turn @ COM[link])
        at = at + turn @ JOINT[link]
    return np.array(out)


def velocities(q, v):
    """Of the centres of mass, by a step along v."""
    return _along(places, q, v)


def _along(f, q, v):
    # The derivative of an analytic function along v, itself analytic in q: by central differences of fourth order.
    h = 1e-3
    return (8.0 * (f(q + h * v) - f(q - h * v)) - (f(q + 2 * h * v) - f(q - 2 * h * v))) / (12.0 * h)


def kinetic(q, v):
    moving = (MASS[:, None] * velocities(q, v) ** 2).sum()
    relative = np.array([v[0], v[1] - v[0], v[2] - v[1]])
    return 0.5 * (moving + (INERTIA * v**2).sum() + (LEG.armature * relative**2).sum())


def potential(q):
    return 9.81 * (MASS * places(q)[:, 1]).sum()


def gradient(f, q):
    return np.array([f(q + 1j * STEP * e).imag / STEP for e in np.eye(LINKS)])


def momentum(q, v):
    """∂T/∂v: T is quadratic in v, so that differences are exact."""
    return np.array([0.5 * (kinetic(q, v + e) - kinetic(q, v - e)) for e in np.eye(LINKS)])


def joint_torques(t, q, v):
    angle, rate = np.array([q[0], q[1] - q[0], q[2] - q[1]]), np.array([v[0], v[1] - v[0], v[2] - v[1]])
    reference = DRIVE.amplitude * np.sin(DRIVE.frequency * t + DRIVE.phase) + DRIVE.mean
    u = -DRIVE.K * (angle - reference) - (DRIVE.B + LEG.damping) * rate - LEG.coulomb * np.tanh(rate / STICKING)
    return np.array([u[0] - u[1], u[1] - u[2], u[2]])


@pytest.mark.parametrize("seed", range(5))
def test_mass_matrix_and_forces_are_lagranges(seed):
    rng = np.random.default_rng(seed)
    t, q, v = rng.uniform(0, 3), rng.uniform(-2, 2, LINKS), rng.uniform(-4, 4, LINKS)
    found = hanging_leg(LEG, DRIVE).evaluate(t, q, v)
    M = np.array([momentum(q, e).real for e in np.eye(LINKS)])
    np.testing.assert_allclose(found.M, M, atol=1e-10)
    # d/dt ∂T/∂v - ∂T/∂q + ∂V/∂q = Q at zero acceleration.
    carried = np.array([(momentum(q + 1j * STEP * v, v)[i]).imag / STEP for i in range(LINKS)])
    bias = carried - gradient(lambda x: kinetic(x, v), q) + gradient(potential, q)
    np.testing.assert_allclose(found.Q, joint_torques(t, q, v) - bias, atol=1e-8)


def test_a_locked_joint_is_a_constraint():
    system = hanging_leg(LEG, locked={1: -0.7, 0: 0.2})
    q, v = np.array([0.2, -0.5, 0.9]), np.zeros(LINKS)
    found = system.evaluate(0.0, q, v)
    np.testing.assert_allclose(found.phi, 0.0, atol=1e-15)
    np.testing.assert_array_equal(found.A, [[-1.0, 1.0, 0.0], [1.0, 0.0, 0.0]])
