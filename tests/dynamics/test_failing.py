"""Motions that cannot go on: they end with an error that says when and why."""

from dataclasses import replace

import numpy as np
import pytest

from biped.base.errors import RunError
from biped.dynamics import EULER, RK4, RK8, integrate
from biped.dynamics.mechanisms import pendulum
from tests.dynamics.systems import START


def never(t, q, v, p, out):
    if t > 0.3:
        out[0] = np.nan


def never_a_row(t, q, v, p, out):
    out[0, 0], out[0, 1] = q[0], q[1]
    if t > 0.3:
        out[0, 0] = np.nan


@pytest.mark.parametrize("scheme", [RK4, RK8, RK8.adaptive(1e-8)], ids=lambda s: s.name)
@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"A": never_a_row}, r"t = 0\.3\d* s (A is not finite|no step passes)"),
        ({"phi": never}, r"t = 0\.3\d* s (phi is not finite|no step passes)"),
        ({"b_v": never}, r"t = 0\.3\d* s (b_v is not finite|no step passes)"),
        ({"event": never, "events": ("low",)}, r"t = 0\.3\d* s the event low is not a number"),
    ],
    ids=["A", "phi", "b_v", "event"],
)
def test_what_is_not_a_number_is_named(change, message, scheme):
    """A row of A that is none was taken for a dependent one, and an event that is none never happened."""
    with pytest.raises(RunError, match=message):
        integrate(replace(pendulum.pendulum(), **change), **{**START, "dt": 1e-2}, scheme=scheme)


def negative_mass(t, q, v, p, M):
    M[0, 0], M[1, 1] = 1.0, 0.6 - t


def breaking_force(t, q, v, p, Q):
    Q[1] = np.sqrt(0.5 - t)


def test_a_mass_matrix_that_turns_indefinite_is_said_when_and_how():
    with pytest.raises(
        RunError, match=r"pendulum, RK4.* at t = 0\.6\d* s .*not positive definite: smallest eigenvalue"
    ):
        integrate(replace(pendulum.pendulum(), mass=negative_mass), **START)


def test_a_force_that_is_not_a_number_is_named():
    with pytest.raises(RunError, match=r"t = 0\.50\d* s Q is not finite: Q = \[ *0\. +nan\]"):
        integrate(replace(pendulum.pendulum(), force=breaking_force), **START)


@pytest.mark.parametrize("scheme", [EULER, RK4, RK8], ids=lambda s: s.name)
@pytest.mark.parametrize("dt", [0.5, 2.0, 20.0])
def test_an_absurd_step_ends_with_an_error(scheme, dt):
    with pytest.raises(RunError, match=r"does not settle|not finite"):
        integrate(pendulum.pendulum(), [1.0, 0.0], [0.0, 0.0], duration=30 * dt, dt=dt, scheme=scheme)


def noise(t, q, v, p, Q):
    Q[1] = 1e6 * np.sin(1e18 * (q[1] + t))


def test_a_motion_no_step_can_follow_ends_with_an_error():
    with pytest.raises(RunError, match="no step passes the error test"):
        integrate(replace(pendulum.pendulum(), force=noise), **START, scheme=RK8.adaptive(1e-12))


def test_adaptive_steps_stop_where_a_force_ends():
    with pytest.raises(RunError, match=r"t = 0\.50\d* s (Q is not finite|no step passes)"):
        integrate(replace(pendulum.pendulum(), force=breaking_force), **START, scheme=RK8.adaptive(1e-9))
