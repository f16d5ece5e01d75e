"""Mechanisms from MJCF files, against the same ones written as functions."""

import numpy as np
import pytest

from biped.base.errors import InputError
from biped.dynamics import RK4, RK8, integrate
from biped.dynamics.check import check_derivatives
from biped.dynamics.mechanisms import four_bars
from biped.dynamics.mechanisms.four_bars import four_bars_mjcf
from biped.dynamics.mjcf import load


@pytest.fixture
def write(tmp_path):
    def write(text):
        path = tmp_path / "mechanism.xml"
        path.write_text(text, encoding="utf-8")
        return path

    return write


def test_two_four_bars_from_a_file_move_as_they_should(write):
    mechanism = load(write(four_bars_mjcf(2)))
    q = np.array([np.pi / 2 if "crank" in name else -np.pi / 2 for name in mechanism.joints])
    v = np.array([-1.0 if "crank" in name else 1.0 for name in mechanism.joints])
    r = integrate(mechanism.system, q, v, duration=2.0, dt=1e-2, scheme=RK4)
    exact = integrate(four_bars.trusted(2), [np.pi / 2], [-1.0], duration=2.0, dt=1e-2, scheme=RK8)
    np.testing.assert_allclose(r.q[:, 0], exact.q[:, 0], atol=1e-6)
    assert r.rank.max() == 4  # of six rows: the mechanism is planar
    assert r.phi.max() < 1e-7


def test_rows_that_are_not_needed_can_be_dropped(write):
    """In a plane the row across it says nothing: the same motion, of full rank, without it."""
    text = four_bars_mjcf(2)
    all_rows = load(write(text))
    across = next(k for k in range(3) if not all_rows.system.evaluate(0.0, all_rows.q + 0.3, all_rows.v).A[k].any())
    fewer = load(write(text), {0: "xyz"[across], 1: "xyz"[across]})
    q = np.array([np.pi / 2 if "crank" in name else -np.pi / 2 for name in all_rows.joints])
    v = np.array([-1.0 if "crank" in name else 1.0 for name in all_rows.joints])
    assert (all_rows.system.m, fewer.system.m) == (6, 4)
    one, two = (integrate(m.system, q, v, duration=0.5, dt=1e-2) for m in (all_rows, fewer))
    np.testing.assert_allclose(two.q, one.q, atol=1e-12)
    check_derivatives(fewer.system, 0.0, q + 0.1, v)
    with pytest.raises(InputError, match="no active connect is called 'lop'"):
        load(write(text), {"lop": "y"})
    with pytest.raises(InputError, match="rows x, y and z can be dropped, not 'w'"):
        load(write(text), {0: "w"})


def test_its_derivatives_agree_with_differences(write):
    mechanism = load(write(four_bars_mjcf(2)))
    rng = np.random.default_rng(4)
    check_derivatives(mechanism.system, 0.0, rng.normal(size=5), rng.normal(size=5))


PENDULUM = """
<mujoco>
  <option gravity="0 0 -9.81"/>
  <worldbody>
    <body name="rod" pos="0.1 0 0">
      {joint}
      <inertial pos="0.5 0 0" mass="2" diaginertia="0.1 0.2 0.2"/>
    </body>
  </worldbody>
  {rest}
</mujoco>
"""


def test_damping_springs_and_armature_are_taken_over(write):
    joint = '<joint name="hinge" axis="0 1 0" damping="0.3" stiffness="4" springref="30" armature="0.05"/>'
    system = load(write(PENDULUM.format(joint=joint, rest=""))).system
    q, v = np.array([0.2]), np.array([1.5])
    e = system.evaluate(0.0, q, v)
    assert e.M[0, 0] == pytest.approx(0.2 + 2 * 0.25 + 0.05)
    spring, weight = -4 * (0.2 - np.radians(30)), 2 * 9.81 * 0.5 * np.cos(0.2)
    assert e.Q[0] == pytest.approx(spring + weight - 0.3 * 1.5)
    check_derivatives(system, 0.0, q, v)


def test_a_keyframe_is_the_start(write):
    rest = '<keyframe><key qpos="0.7" qvel="-2"/></keyframe>'
    mechanism = load(write(PENDULUM.format(joint='<joint name="hinge" axis="0 1 0"/>', rest=rest)))
    assert (mechanism.q, mechanism.v, mechanism.joints) == ([0.7], [-2.0], ["hinge"])


@pytest.mark.parametrize(
    ("joint", "rest", "message"),
    [
        ("<freejoint/>", "", "only hinge and slide"),
        ('<joint type="ball"/>', "", "only hinge and slide"),
        ('<joint name="j" frictionloss="1"/>', "", "dry friction"),
        ('<joint name="j"/>', '<equality><weld body1="rod"/></equality>', "equality 0 is a weld"),
        ('<joint name="j" nonsense="1"/>', "", "nonsense"),
    ],
)
def test_what_is_not_supported_is_said(write, joint, rest, message):
    with pytest.raises(InputError, match=message):
        load(write(PENDULUM.format(joint=joint, rest=rest)))


def test_a_missing_file_is_said(tmp_path):
    with pytest.raises(InputError, match=r"absent\.xml"):
        load(tmp_path / "absent.xml")
