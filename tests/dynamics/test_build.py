"""Mechanisms from bodies and joints: against the same ones written by hand, and joint forces against free bodies."""

import numpy as np
import pytest

from biped.base.errors import InputError
from biped.dynamics import RK8, integrate
from biped.dynamics.bodies import GROUND, Plane, Space
from biped.dynamics.check import check_derivatives
from biped.dynamics.mechanisms import slider_crank


def test_bodies_and_motions_of_others_are_refused():
    mine, other = Plane(name="mine"), Plane(name="other")
    rod = {"mass": 1.0, "inertia": 1.0, "at": (0, 0)}
    body, foreign = mine.body("rod", **rod), other.body("rod", **rod)
    joint = mine.hinge("foot", GROUND, (0, 0), body, (0, 0))
    for wrong, name in ((foreign, "rod"), ("rod", "rod")):
        with pytest.raises(InputError, match=f"mine: {name} is not a body of this mechanism"):
            mine.hinge("h", GROUND, (0, 0), wrong, (0, 0))
        with pytest.raises(InputError, match=f"mine: {name} is not a body of this mechanism"):
            mine.torque("t", wrong, torque=1.0)
    motion = integrate(other.system, other.q, other.v, duration=0.1, dt=0.1)
    with pytest.raises(InputError, match="the motion is that of other"):
        mine.joint_forces(motion, joint)
    with pytest.raises(InputError, match="foot is not a joint of this mechanism"):
        other.joint_forces(motion, joint)
    for change in ({"mass": "1"}, {"at": "ab"}, {"mass": None}):
        with pytest.raises(InputError, match=r"mass must be|at must have"):
            mine.body("second", **{**rod, **change})


class SliderCrank:
    """The thesis's slider-crank, a little way from its start, as bodies and joints."""

    def __init__(self):
        self.plane = p = Plane(name="slider-crank")
        c, s = np.cos(0.3), np.sin(0.3)
        rod = {"mass": 1.0, "inertia": 1 / 12, "centre": (0.5, 0.0)}
        self.crank = p.body("crank", **rod, at=(0, 0), angle=0.3, spin=2.0)
        self.rod = p.body("rod", **rod, at=(c, s), angle=-0.3, spin=-2.0, velocity=(-2 * s, 2 * c))
        self.slider = p.body("slider", mass=1.0, inertia=1.0, at=(2 * c, 0), velocity=(-4 * s, 0))
        self.a = p.hinge("A", GROUND, (0, 0), self.crank, (0, 0))
        self.b = p.hinge("B", self.crank, (1, 0), self.rod, (0, 0))
        self.c = p.hinge("C", self.rod, (1, 0), self.slider, (0, 0))
        self.guide = p.slide("guide", GROUND, (0, 0), (1, 0), self.slider, (0, 0))
        p.torque("motor", self.crank, torque=slider_crank.TORQUE, damping=slider_crank.DAMPING)
        self.motion = integrate(p.system, p.q, p.v, duration=2.0, dt=1e-2, sampling=0.1, scheme=RK8)


@pytest.fixture(scope="module")
def built():
    return SliderCrank()


def test_it_moves_as_the_one_written_by_hand(built):
    exact = integrate(slider_crank.trusted(), [0.3], [2.0], duration=2.0, dt=1e-3, sampling=0.1, scheme=RK8)
    np.testing.assert_allclose(built.plane.angle(built.motion.q, built.crank), exact.q[:, 0], atol=1e-8)
    place = built.plane.position(built.motion.q, built.slider, (0, 0))
    np.testing.assert_allclose(place[:, 0], slider_crank.slider_position(exact.q), atol=1e-8)
    np.testing.assert_allclose(place[:, 1], 0.0, atol=1e-10)


def test_joint_forces_hold_every_free_body_in_its_motion(built):
    """Newton for each body, and Euler about its centre of mass, with the forces of its joints alone."""
    m, g = built.motion, np.array([0.0, -9.81])
    force = {joint.name: built.plane.joint_forces(m, joint) for joint in built.plane.joints}
    A, B, C, guide = (force[name][0] for name in ("A", "B", "C", "guide"))

    def state(body):
        c, s = (m.q[:, body.first + i] for i in (2, 3))
        a = m.acceleration[:, body.first : body.first + 4]
        spin = c * m.v[:, body.first + 3] - s * m.v[:, body.first + 2]
        return np.stack((c, s), 1), a, spin, c * a[:, 3] - s * a[:, 2]

    def cross(a, b):
        return a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]

    u, a, spin, turn = state(built.crank)
    np.testing.assert_allclose(a[:, :2] + 0.5 * a[:, 2:], -A + B + g, atol=1e-9)
    drive = slider_crank.TORQUE - slider_crank.DAMPING * spin
    np.testing.assert_allclose(turn / 12, cross(-0.5 * u, -A) + cross(0.5 * u, B) + drive, atol=1e-9)
    u, a, _, turn = state(built.rod)
    np.testing.assert_allclose(a[:, :2] + 0.5 * a[:, 2:], -B + C + g, atol=1e-9)
    np.testing.assert_allclose(turn / 12, cross(-0.5 * u, -B) + cross(0.5 * u, C), atol=1e-9)
    _, a, _, _ = state(built.slider)
    np.testing.assert_allclose(a[:, :2], -C - guide + g, atol=1e-9)
    np.testing.assert_allclose(guide[:, 0], 0.0, atol=1e-12)
    np.testing.assert_allclose(force["guide"][1], 0.0, atol=1e-9)  # everything meets in the pin: nothing turns it


def test_work_of_weight_and_motor_is_the_energy_gained(built):
    m = built.motion
    assert built.plane.system.powers == ("gravity", "motor")
    np.testing.assert_allclose(m.work[:, 1], m.energy - m.energy[0], atol=1e-6)
    np.testing.assert_allclose(m.work[:, 0], m.potential[0] - m.potential, atol=1e-9)


def everything_plane():
    p = Plane(name="everything")
    a = p.body("a", mass=2.0, inertia=0.3, at=(0.1, 0.2), angle=0.4, centre=(0.2, -0.1), spin=1.0)
    b = p.body("b", mass=1.0, inertia=0.2, at=(1.0, 0.5), angle=-0.7, centre=(0.0, 0.3))
    c = p.body("c", mass=0.5, inertia=0.1, at=(2.0, 0.0), angle=0.1)
    p.rod("rod", GROUND, (0, 1), a, (0.3, 0.1))
    p.slide("slot", a, (0.1, 0.2), (1.0, 2.0), b, (0.2, 0.0), turns=True)
    p.weld("weld", b, (0.5, 0.0), c, (0.0, 0.1))
    p.spring("spring", a, (0.1, 0.0), c, (0.0, 0.2), stiffness=30.0, rest=0.4)
    return p


def everything_space():
    p = Space(name="everything in space")
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    a = p.body("a", mass=2.0, inertia=(0.3, 0.4, 0.5), at=(0, 0, 0), axes=turn, centre=(0.1, 0.2, 0.3))
    b = p.body("b", mass=1.0, inertia=np.diag((0.2, 0.2, 0.1)), at=(1, 0, 0), spin=(1.0, 2.0, 0.5))
    p.hinge("hinge", GROUND, (0, 0, 0), a, (0, 0, 0), (0.0, 0.6, 0.8))
    p.ball("ball", a, (0, -1, 0), b, (0, 0, 0))
    p.spring("spring", GROUND, (2, 2, 0), b, (0.5, 0, 0), stiffness=20.0, rest=0.5)
    return p


@pytest.mark.parametrize("mechanism", [everything_plane(), everything_space()], ids=lambda m: m.name)
def test_every_joint_and_spring_agrees_with_its_derivatives_and_keeps_its_energy(mechanism):
    system = mechanism.system
    rng = np.random.default_rng(2)
    check_derivatives(system, 0.0, rng.normal(size=system.n), rng.normal(size=system.n), 1e-5)
    r = integrate(system, mechanism.q, mechanism.v, duration=1.0, dt=2e-3, scheme=RK8)
    assert np.abs(r.phi[6:]).max() < 1e-8
    assert np.ptp(r.energy[6:]) < 1e-7 * np.abs(r.kinetic).max()


def test_a_push_does_the_work_that_force_and_way_say():
    p = Plane(gravity=(0.0, 0.0))
    a = p.body("a", mass=2.0, inertia=1.0, at=(0, 0))
    p.push("push", a, (0, 0), (4.0, 0.0))
    r = integrate(p.system, p.q, p.v, duration=1.0, dt=1e-2, scheme=RK8)
    assert r.q[-1, 0] == pytest.approx(1.0)
    assert r.work[-1, 1] == pytest.approx(4.0)


@pytest.mark.parametrize(
    ("build", "message"),
    [
        (lambda p: p.body("a", mass=-1.0, inertia=1.0, at=(0, 0)), "must be positive"),
        (lambda p: p.body("a", mass=1.0, inertia=1.0, at=(0, 0, 0)), "2 finite numbers"),
        (lambda p: p.body("a", mass=1.0, inertia=1.0, at=(0, 0), spin=np.nan), "finite numbers"),
        (lambda p: [p.body("a", mass=1.0, inertia=1.0, at=(0, 0)) for _ in range(2)], "two bodies called a"),
        (lambda p: p.rod("r", GROUND, (0, 0), GROUND, (0, 0)), "has no length"),
        (lambda p: p.system, "at least one body"),
        (lambda p: p.push("f", p.body("a", mass=1.0, inertia=1.0, at=(0, 0)), (0, 0), (1.0,)), "must have 2 finite"),
    ],
)
def test_what_makes_no_sense_is_said(build, message):
    with pytest.raises(InputError, match=message):
        build(Plane())


def test_a_rod_without_thickness_in_space_is_refused():
    with pytest.raises(InputError, match="inertia with thickness"):
        Space().body("rod", mass=1.0, inertia=(0.0, 1 / 12, 1 / 12), at=(0, 0, 0))
    with pytest.raises(InputError, match="not at right angles"):
        Space().body("a", mass=1.0, inertia=(1, 1, 1), at=(0, 0, 0), axes=np.ones((3, 3)))
