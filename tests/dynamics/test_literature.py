"""Mechanisms from the literature, built from bodies and joints, against their one degree of freedom.

Each has a closed geometry x(s), found here without any multiplier: then ½ I(s) ṡ² + V(s) is all there is to its
motion, with I and V from the places of its bodies. Sarrus's linkage and the spherical four-bar are over-constrained.
"""

from itertools import pairwise

import numpy as np
import pytest
from numpy.polynomial import Chebyshev
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from biped.dynamics import RK8, integrate
from biped.dynamics.bodies import GROUND, Plane, Space

G = 9.81
STEP = 1e-3  # of differences, of fourth order


def slope(f, s):
    """df/ds by differences of fourth order."""
    return (8 * (f(s + STEP) - f(s - STEP)) - (f(s + 2 * STEP) - f(s - 2 * STEP))) / (12 * STEP)


def alone(inertia, potential, s, rate, times, reach, degree=40):
    """s (K,) of I s̈ + ½ I′ ṡ² + V′ = 0, by Chebyshev's polynomials of I and V from one end of `reach` to the other."""
    I, V = (Chebyshev.interpolate(np.vectorize(f), degree, reach) for f in (inertia, potential))
    between = 0.37 * reach[0] + 0.63 * reach[1]
    assert abs(I(between) / inertia(between) - 1) < 1e-8
    dI, dV = I.deriv(), V.deriv()

    def change(t, y):
        return y[1], -(0.5 * dI(y[0]) * y[1] ** 2 + dV(y[0])) / I(y[0])

    found = solve_ivp(change, (times[0], times[-1]), (s, rate), "DOP853", times, rtol=1e-10, atol=1e-11).y[0]
    assert reach[0] <= found.min()
    assert found.max() <= reach[1]
    return found


# --- Sarrus's linkage: two folding pairs of plates at right angles, between them a table that only rises ---


def test_sarrus_linkage_lifts_its_table_straight():
    angle, table = 1.0, 3.0
    space = Space(name="sarrus")
    height = 2 * np.sin(angle)
    top = space.body("table", mass=table, inertia=(0.5, 0.5, 0.5), at=(0, 0, height))
    for name, out, axis in (("x", np.array([1.0, 0, 0]), (0, 1, 0)), ("y", np.array([0, 1.0, 0]), (1, 0, 0))):
        up, knee = np.array([0, 0, 1.0]), np.cos(angle) * out + np.array([0, 0, np.sin(angle)])
        rods = []
        for kind, start, along in (("low", 0 * out, knee), ("high", knee, height * up - knee)):
            inertia = (np.eye(3) - np.outer(along, along)) / 12 + 1e-6 * np.eye(3)
            rods.append(space.body(f"{kind} {name}", mass=1.0, inertia=inertia, at=start, centre=along / 2))
        space.hinge(f"foot {name}", GROUND, (0, 0, 0), rods[0], (0, 0, 0), axis)
        space.hinge(f"knee {name}", rods[0], knee, rods[1], (0, 0, 0), axis)
        space.hinge(f"head {name}", rods[1], height * up - knee, top, (0, 0, 0), axis)
    r = integrate(space.system, space.q, space.v, duration=0.4, dt=0.01, sampling=0.1, scheme=RK8)

    def inertia(a):
        high = np.sin(a) ** 2 / 4 + 9 * np.cos(a) ** 2 / 4 + 1 / 12
        return 2 * (1 / 3 + high + 2e-6) + table * 4 * np.cos(a) ** 2

    exact = alone(inertia, lambda a: G * np.sin(a) * (2 * 2 + 2 * table), angle, 0.0, r.t, (0.0, 1.1))
    at = space.position(r.q, top, (0, 0, 0))
    np.testing.assert_allclose(at[:, 2], 2 * np.sin(exact), atol=1e-8)
    np.testing.assert_allclose(at[:, :2], 0.0, atol=1e-10)
    assert r.structural_rank == space.system.n - 1 < space.system.m
    assert at[0, 2] - at[-1, 2] > 0.3


# --- the spherical four-bar: all axes meet in one point ---

ARCS = (1.2, 0.6, 1.1, 1.0)  # of the ground, the crank, the coupler and the rocker [rad]


def spherical(s):
    """Axes of the crank's pin and of the rocker's at a crank angle s."""
    ground, crank, coupler, rocker = ARCS
    far = np.array([np.sin(ground), 0, np.cos(ground)])  # the rocker's axis on the ground; the crank's is z
    pin = np.array([np.sin(crank) * np.cos(s), np.sin(crank) * np.sin(s), np.cos(crank)])
    d = pin @ far
    a, b = np.linalg.solve([[1, d], [d, 1]], [np.cos(coupler), np.cos(rocker)])
    flat = a * pin + b * far
    across = np.cross(pin, far)
    return pin, flat + np.sqrt((1 - flat @ flat) / (across @ across)) * across, far


def frame(u, w):
    """Axes of a link between two directions, as columns."""
    y = np.cross(u, w)
    y /= np.linalg.norm(y)
    return np.column_stack((u, y, np.cross(u, y)))


def test_a_spherical_four_bar_turns_as_its_crank():
    start, rate, masses, J = 0.5, 3.0, (1.0, 2.0, 1.5), np.array([0.2, 0.3, 0.25])
    z = np.array([0, 0, 1.0])

    def links(s):
        pin, end, far = spherical(s)
        return [frame(z, pin), frame(pin, end), frame(far, end)]

    def turning(s):
        """Angular velocities of the links for ṡ = 1."""
        rates = [slope(lambda x, k=k: links(x)[k], s) @ links(s)[k].T for k in range(3)]
        return [np.array([W[2, 1] - W[1, 2], W[0, 2] - W[2, 0], W[1, 0] - W[0, 1]]) / 2 for W in rates]

    centre = np.array([0.5, 0.1, -0.2])

    def inertia(s):
        total = 0.0
        for R, w, m in zip(links(s), turning(s), masses, strict=True):
            total += m * np.sum(np.cross(w, R @ centre) ** 2) + (R.T @ w) @ (J * (R.T @ w))
        return total

    def potential(s):
        return sum(m * G * (R @ centre)[2] for R, m in zip(links(s), masses, strict=True))

    space, none = Space(name="spherical four-bar"), np.zeros(3)
    placed = [
        space.body(name, mass=m, inertia=J, at=none, axes=R, centre=centre, spin=rate * w)
        for name, m, R, w in zip(("crank", "coupler", "rocker"), masses, links(start), turning(start), strict=True)
    ]
    pin, end, far = spherical(start)
    space.hinge("drive", GROUND, none, placed[0], none, z)
    space.hinge("pin", placed[0], none, placed[1], none, links(start)[0].T @ pin)
    space.hinge("end", placed[1], none, placed[2], none, links(start)[1].T @ end)
    space.hinge("far", GROUND, none, placed[2], none, far)
    r = integrate(space.system, space.q, space.v, duration=1.0, dt=0.01, sampling=0.1, scheme=RK8)
    exact = alone(inertia, potential, start, rate, r.t, (-1.0, 4.5), 80)
    for k in range(3):
        truth = np.array([links(s)[k] @ (1.0, 0.0, 0.0) for s in exact])
        np.testing.assert_allclose(space.position(r.q, placed[k], (1, 0, 0)), truth, atol=1e-7)
        truth = np.array([links(s)[k] @ (0.0, 1.0, 0.0) for s in exact])
        np.testing.assert_allclose(space.position(r.q, placed[k], (0, 1, 0)), truth, atol=1e-7)
    assert r.structural_rank < space.system.m
    assert np.ptp(exact) > 1.0


# --- Jansen's leg: eleven bars by his own lengths, a crank that turns round ---

JANSEN = {"a": 38.0, "b": 41.5, "c": 39.3, "d": 40.1, "e": 55.8, "f": 39.4, "g": 36.7, "h": 65.7, "i": 49.0,
          "j": 50.0, "k": 61.9, "l": 7.8, "m": 15.0}  # fmt: skip


def meet(p, r, q, s):
    """The point at r from p and at s from q, left of the way from p to q."""
    d = np.linalg.norm(q - p)
    x = (d * d + r * r - s * s) / (2 * d)
    u = (q - p) / d
    return p + x * u + np.sqrt(r * r - x * x) * np.array([-u[1], u[0]])


def jansen(s):
    """Points [dm] of the leg at a crank angle s: crank's end, fixed, upper, left, right, lower, foot."""
    n = {k: x / 100 for k, x in JANSEN.items()}
    crank, fixed = n["m"] * np.array([np.cos(s), np.sin(s)]), np.array([-n["a"], -n["l"]])
    upper = meet(fixed, n["b"], crank, n["j"])
    lower = meet(crank, n["k"], fixed, n["c"])
    left = meet(fixed, n["d"], upper, n["e"])
    knee = meet(lower, n["g"], left, n["f"])
    foot = meet(lower, n["i"], knee, n["h"])
    return np.array([crank, fixed, upper, left, lower, knee, foot])


BARS = {"j": (0, 2), "k": (0, 4), "b": (1, 2), "c": (1, 4), "d": (1, 3), "e": (2, 3), "f": (3, 5), "g": (4, 5),
        "h": (5, 6), "i": (4, 6)}  # fmt: skip


def test_jansen_s_leg_turns_as_its_crank():
    start, rate, mass = 0.3, 8.0, 1.0
    at, speed = jansen(start), rate * slope(jansen, start)
    for name, (i, k) in BARS.items():
        assert np.linalg.norm(at[i] - at[k]) == pytest.approx(JANSEN[name] / 100), name
    plane = Plane(name="jansen")
    origin = np.zeros(2)
    ends = {"m": (origin, at[0], origin, speed[0])}
    ends |= {name: (at[i], at[k], speed[i], speed[k]) for name, (i, k) in BARS.items()}
    bars, pins = {}, {}
    for name, (p, q, u, w) in ends.items():
        along, length = q - p, float(np.linalg.norm(q - p))
        spin = (along[0] * (w - u)[1] - along[1] * (w - u)[0]) / length**2
        bars[name] = plane.body(
            name, mass=mass, inertia=mass * length**2 / 12, at=p, velocity=u, spin=spin, centre=(length / 2, 0.0),
            angle=float(np.arctan2(along[1], along[0])),
        )  # fmt: skip
        for node, x in zip(("o", 0) if name == "m" else BARS[name], (0.0, length), strict=True):
            pins.setdefault(node, []).append((bars[name], (x, 0.0)))
    pins["o"].insert(0, (GROUND, tuple(origin)))
    pins[1].insert(0, (GROUND, tuple(at[1])))
    for node, joined in pins.items():
        for k, (one, two) in enumerate(pairwise(joined)):
            plane.hinge(f"{node}.{k}", *one, *two)
    r = integrate(plane.system, plane.q, plane.v, duration=1.0, dt=0.005, sampling=0.1, scheme=RK8)

    def inertia(s):
        here, total = slope(jansen, s), 0.0
        for i, k in BARS.values():
            u, w = here[i], here[k]
            total += mass * (u @ u + u @ w + w @ w) / 3
        return total + mass * here[0] @ here[0] / 3

    def potential(s):
        here = jansen(s)
        return mass * G * (sum(here[i, 1] + here[k, 1] for i, k in BARS.values()) + here[0, 1]) / 2

    exact = alone(inertia, potential, start, rate, r.t, (0.0, 12.0), 500)
    feet = np.array([jansen(s)[6] for s in exact])
    length = JANSEN["i"] / 100
    np.testing.assert_allclose(plane.position(r.q, bars["i"], (length, 0.0)), feet, atol=1e-6)
    assert exact[-1] - exact[0] > 2 * np.pi  # all the way round


# --- a double wishbone: an upright on five rods, sprung ---

CHASSIS = np.array([[0.2, 0.3, 0.5], [-0.2, 0.3, 0.5], [0.25, 0.25, 0.2], [-0.25, 0.25, 0.2], [-0.15, 0.3, 0.3]])
UPRIGHT = np.array([[0.0, 0.7, 0.48], [0.0, 0.7, 0.48], [0.0, 0.75, 0.18], [0.0, 0.75, 0.18], [-0.12, 0.72, 0.3]])
HUB, SEAT = np.array([0.0, 0.75, 0.3]), np.array([0.0, 0.35, 0.7])


def test_a_double_wishbone_swings_as_its_hub_travels():
    mass, J, stiffness, rest, rate = 30.0, np.array([0.8, 1.0, 0.8]), 2e4, 0.545, 0.5
    reach = np.linalg.norm(UPRIGHT - CHASSIS, axis=1)

    def pose(z):
        """Place of the hub and its rotation where it has risen by z."""

        def gap(x):
            at = HUB + x[:3]
            tips = at + Rotation.from_rotvec(x[3:]).apply(UPRIGHT - HUB)
            return [*(np.linalg.norm(tips - CHASSIS, axis=1) - reach), x[2] - z]

        x = np.array([0, 0, z, 0, 0, 0])
        for _ in range(8):
            J = np.transpose([(np.array(gap(x + d)) - gap(x - d)) / 2e-5 for d in 1e-5 * np.eye(6)])
            x = x - np.linalg.solve(J, gap(x))
        return HUB + x[:3], Rotation.from_rotvec(x[3:]).as_matrix()

    def motion(z):
        """Velocity of the hub and angular velocity for ż = 1."""
        W = slope(lambda s: pose(s)[1], z) @ pose(z)[1].T
        return slope(lambda s: pose(s)[0], z), np.array([W[2, 1] - W[1, 2], W[0, 2] - W[2, 0], W[1, 0] - W[0, 1]]) / 2

    def inertia(z):
        u, w = motion(z)
        R = pose(z)[1]
        return mass * u @ u + (R.T @ w) @ (J * (R.T @ w))

    def potential(z):
        at = pose(z)[0]
        return mass * G * at[2] + 0.5 * stiffness * (np.linalg.norm(at - SEAT) - rest) ** 2

    space = Space(name="double wishbone")
    u, w = motion(0.0)
    hub = space.body("hub", mass=mass, inertia=J, at=HUB, velocity=rate * u, spin=rate * w)
    for k in range(5):
        space.rod(f"rod{k}", GROUND, CHASSIS[k], hub, UPRIGHT[k] - HUB)
    space.spring("spring", GROUND, SEAT, hub, (0, 0, 0), stiffness=stiffness, rest=rest)
    r = integrate(space.system, space.q, space.v, duration=0.4, dt=2e-3, sampling=0.05, scheme=RK8)
    exact = alone(inertia, potential, 0.0, rate, r.t, (-0.08, 0.08), 14)
    truth = np.array([pose(z)[0] for z in exact])
    np.testing.assert_allclose(space.position(r.q, hub, (0, 0, 0)), truth, atol=1e-7)
    assert np.ptp(exact) > 0.03
