"""Q_d out of the plane: moments on bodies projected by their Jacobians; in the plane it is the planar law's."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from biped.control.planar.setup import new, set_gains
from biped.control.planar.tick import desired_forces as planar_forces
from biped.control.space.places import believe_contacts
from biped.control.space.tick import desired_forces
from biped.control.step_back import set_backstep
from biped.scenario.keys import Backstep
from tests.control.space.scene import Scene, states

SIDE = (-1.0, 1.0)


@pytest.fixture(scope="module")
def scene() -> Scene:
    return Scene()


def axis_angle(z, one, other):
    return np.arctan2(z @ one, z @ other)


def wanted(scene: Scene, q: np.ndarray, v: np.ndarray, phase: tuple[int, int]) -> np.ndarray:
    """Σ J_ωᵀ τ with MuJoCo's own rotation Jacobians, and the relative joints' couples."""
    gait, model, data = scene.c["gait"], scene.model, scene.data
    k, b, rest = gait["k"], gait["b"], gait["rest"]
    x, y, z = np.eye(3)
    Q = np.zeros(18)
    excess = scene.c["at"]["com_velocity"][0] - gait["pace"][0] + gait["pace"][1] * scene.c["belief"]["tilt"][0]
    for link in range(3):
        body = (1, 2, 5)[link]
        J = np.zeros((3, 18))
        mujoco.mj_jacBody(model, data, None, J, body)
        turn, rate = data.xmat[body].reshape(3, 3), J @ v
        own = turn[:, 2]
        angle = np.array([axis_angle(own, z, x), -axis_angle(own, y, z), -axis_angle(turn[:, 1], x, y)])
        rates = np.array([-rate @ y, rate @ x, rate @ own])
        if link == 0:
            tau = -gait["k_torso"] * (angle - gait["rest_torso"]) - gait["b_torso"] * rates
        else:
            leg, s = link - 1, phase[link - 1]
            sign = np.array([1.0, SIDE[leg], SIDE[leg]])
            goal = rest[s, :3].copy()
            goal[0] += gait["pace"][3 if s >= 2 else 4] * excess
            if s >= 2:
                soles = [list(scene.robot.feet[one].geoms) for one in (leg, 1 - leg)]
                foot, stance = (data.geom_xpos[sole].mean(axis=0) for sole in soles)
                com, moving = data.subtree_com[1], scene.c["at"]["com_velocity"]
                goal[1] += gait["velocity"] * SIDE[leg] * moving[1]
                goal[1] += gait["push"] * max(SIDE[leg] * scene.c["memory"]["pushed"], 0.0)
                goal[1] += gait["position"] * (SIDE[leg] * (com[1] - stance[1]) - 0.0875)
                if gait["apart"] and foot[0] - stance[0] < gait["crossing"]:
                    # Two shanks are a leg: where its foot would be `apart` from the other.
                    beside = SIDE[leg] * (foot[1] - stance[1])
                    goal[1] = max(goal[1], SIDE[leg] * angle[1] + (gait["apart"] - beside) / (2.0 * 0.4428))
                goal[0] -= gait["shorten"] * (goal[1] - rest[s, 1]) ** 2
            tau = sign * (-k[s, :3] * (sign * angle - goal) - b[s, :3] * sign * rates)
        Q += J.T @ (tau[0] * -y + tau[1] * x + tau[2] * own)
    for leg in range(2):
        s = phase[leg]
        for i in range(3, 6):
            j = 6 + 6 * leg + i
            Q[j] += -k[s, i] * (q[j + 1] - rest[s, i]) - b[s, i] * v[j]
            Q[j] += gait["pace"][6] * max(excess, 0.0) ** 2 if s >= 2 and i == 3 else 0.0
            v0 = gait["pace"][0] - gait["pace"][1] * scene.c["belief"]["tilt"][0]
            if s == 1 and i == 4 and -2.0 * v0 < excess < 0.0:
                Q[j] -= gait["pace"][7] * excess**2 * (2.0 + excess / v0)
    return Q


@pytest.mark.parametrize("pace", [(0.0,) * 8, (0.7, 0.0, 0.0, 0.4, -0.3, 1.2, 9.0, 50.0)])
@pytest.mark.parametrize("crossing", [(0.0, 0.0, 0.0, 0.0), (0.15, 0.1, 0.5, 0.03), (0.3, -0.1, 0.0, 0.1)])
@pytest.mark.parametrize("phase", [(0, 1), (1, 2), (2, 0), (3, 3)])
def test_moments_on_bodies_are_projected(scene, phase, crossing, pace):
    gait = scene.c["gait"]
    gait["pace"] = pace
    gait["apart"], gait["crossing"], gait["shorten"], gait["push"] = crossing
    scene.c["memory"]["pushed"] = 2.0 if phase[0] else -3.0  # m/s²
    for q, v in states(scene, 3, seed=sum(phase)):
        scene.sensed(q, v)
        scene.c["memory"]["phase"] = phase
        desired_forces(scene.c, scene.mechanics)
        expected = wanted(scene, q, v, phase)
        assert scene.c["tick"]["Q_d"] == pytest.approx(expected, abs=1e-9 * np.abs(expected).max())
    scene.c["memory"]["pushed"] = 0.0
    for name in ("pace", "apart", "crossing", "shorten", "push"):
        gait[name] = 0.0


def test_a_foot_that_is_behind_is_kept_apart_and_one_that_is_ahead_may_cross(scene):
    """The right leg swings; the walker falls to its left, over the other foot."""
    gait, placed = scene.c["gait"], {}
    for flexed in (-0.4, 0.4):
        q, v = scene.q.copy(), np.zeros(18)
        q[3:7], q[7:] = (1.0, 0.0, 0.0, 0.0), 0.0
        q[7], v[1] = flexed, 1.0
        for apart in (0.0, 0.3):
            gait["apart"] = apart
            scene.sensed(q, v)
            scene.c["memory"]["phase"] = 2, 0
            desired_forces(scene.c, scene.mechanics)
            placed[flexed, apart] = scene.c["tick"]["placed"][0]
    gait["apart"] = 0.0
    assert placed[-0.4, 0.0] < -0.1  # inward
    assert placed[-0.4, 0.3] > 0.1
    assert placed[0.4, 0.3] == placed[0.4, 0.0] < -0.1


@pytest.mark.parametrize(("rise", "heading"), [("ground.slope=3.0", 0.0), ("ground.side_slope=3.0", 0.5 * np.pi)])
def test_pace_is_less_where_the_ground_rises_ahead(rise, heading):
    scene, found = Scene(rise), []
    q, v = states(scene, 1)[0]
    scene.sensed(q, v)
    scene.c["gait"]["heading"] = heading
    less = 0.7 - 2.0 * np.radians(3.0)
    for pace in ((0.7, 2.0, 0, 0.4, -0.3, 0, 5, 7), (less, 0, 0, 0.4, -0.3, 0, 5, 7), (0.7, 0, 0, 0.4, -0.3, 0, 5, 7)):
        scene.c["gait"]["pace"] = pace
        desired_forces(scene.c, scene.mechanics)
        found.append(scene.c["tick"]["Q_d"].copy())
    assert found[0] == pytest.approx(found[1], abs=1e-9 * np.abs(found[1]).max())
    assert np.abs(found[0] - found[2]).max() > 1.0


@pytest.mark.parametrize(("rise", "heading", "leaned"), [
    ("ground.slope=3.0", 0.0, 3.6), ("ground.slope=-3.0", 0.0, 0.0), ("ground.side_slope=3.0", 0.5 * np.pi, 3.6),
    ("ground.side_slope=3.0", 0.0, 0.0),
])  # fmt: skip
def test_the_torso_leans_uphill_as_if_its_spring_rested_further_forward(rise, heading, leaned):
    scene, found = Scene(rise), []
    q, v = states(scene, 1)[0]
    scene.sensed(q, v)
    gait = scene.c["gait"]
    gait["heading"] = heading
    for lean, further in ((1.2, 0.0), (0.0, leaned)):
        gait["pace"], gait["rest_torso"][0] = (0.0, 0.0, 0.0, 0.0, 0.0, lean, 0.0, 0.0), np.radians(85.0 - further)
        desired_forces(scene.c, scene.mechanics)
        found.append(scene.c["tick"]["Q_d"].copy())
    assert found[0] == pytest.approx(found[1], abs=1e-9 * np.abs(found[1]).max())


@pytest.mark.parametrize(("rise", "heading"), [("ground.side_slope=3.0", 0.0), ("ground.slope=-3.0", 0.5 * np.pi)])
def test_a_leg_in_the_air_is_abducted_where_the_ground_rises_on_its_side(rise, heading):
    scene = Scene(rise)
    q, v = states(scene, 1)[0]
    scene.sensed(q, v)
    scene.c["memory"]["phase"] = 2, 3
    scene.c["gait"]["heading"] = heading
    placed = []
    for side in (0.0, 0.5):
        scene.c["gait"]["pace"] = 0.0, 0.0, side, 0.0, 0.0, 0.0, 0.0, 0.0
        desired_forces(scene.c, scene.mechanics)
        placed.append(scene.c["tick"]["placed"].copy())
    assert placed[1] - placed[0] == pytest.approx([-0.5 * np.radians(3.0), 0.5 * np.radians(3.0)])


@pytest.mark.parametrize(
    "back", [None, Backstep(0.04, 60.0, 200.0, 8.0), Backstep(0.0, 75.0, 90.0, 8.0, 1.5, 80.0, 4.0)]
)
@pytest.mark.parametrize("phase", [(0, 1), (1, 2), (2, 0), (3, 0), (0, 3)])
def test_in_the_plane_it_is_the_planar_law(scene, phase, back):
    """Placement aside, which follows the widths of hips: legs hang straight down sideways."""
    rng = np.random.default_rng(5)
    pitch, joints, rates = 0.2, 0.4 * rng.standard_normal(6), rng.standard_normal(7)
    q, v = scene.q.copy(), np.zeros(18)
    q[3:7] = np.cos(pitch / 2), 0.0, -np.sin(pitch / 2), 0.0
    flexing = [6, 9, 10, 12, 15, 16]  # hip, knee, ankle
    q[7:] = 0.0
    q[np.array(flexing) + 1] = joints
    v[4], v[flexing] = -rates[0], rates[1:]
    scene.sensed(q, v)
    gait = scene.c["gait"].copy()
    scene.c["gait"]["rest"][:, [1, 2, 5]] = 0.0
    scene.c["gait"]["position"] = scene.c["gait"]["velocity"] = 0.0
    scene.c["memory"]["phase"], scene.c["memory"]["back"] = phase, back is not None
    set_backstep(scene.c["backstep"], back)
    desired_forces(scene.c, scene.mechanics)
    scene.c["gait"], scene.c["memory"]["back"] = gait, False
    Q = scene.c["tick"]["Q_d"]

    c = new()[0]
    set_gains(c["gait"], scene.setup.gains)
    c["tree"]["mass"] = 1.0  # whose speed a pace of none does not follow
    c["memory"]["phase"], c["memory"]["back"] = phase, back is not None
    set_backstep(c["backstep"], back)
    hips = pitch + joints[[0, 3]]
    c["at"]["angle"][:] = 0.0
    angle, rate = c["at"]["angle"], c["at"]["rate"]
    from biped.robot.planar.topology import PITCH, THIGH, TORSO

    angle[TORSO], rate[TORSO] = pitch, rates[0]
    for leg in range(2):
        angle[THIGH[leg]], rate[THIGH[leg]] = hips[leg], rates[0] + rates[1 + 3 * leg]
    planar_q, planar_v = np.zeros(9), np.zeros(9)
    planar_q[PITCH], planar_q[3:], planar_v[PITCH], planar_v[3:] = pitch, joints, rates[0], rates[1:]
    planar_forces(c, planar_q, planar_v)
    planar = c["tick"]["Q_d"]
    assert Q[flexing] == pytest.approx(planar[3:], abs=1e-9)
    assert -Q[4] == pytest.approx(planar[PITCH], abs=1e-9)
    still = [j for j in range(18) if j not in (4, *flexing)]
    assert np.abs(Q[still]).max() < 1e-9


def test_a_change_of_contact_counts_when_it_has_lasted(scene):
    scene.put(scene.q, scene.v)
    c = scene.c
    c["at"]["height"] = 1.0
    believe_contacts(c, True)
    assert not c["memory"]["believed"].any()
    c["at"]["height"][5] = 0.0  # the outer toe of the left foot alone: its toe is on the ground
    hold = int(c["sensing"]["hold"][2])
    for _ in range(hold - 1):
        believe_contacts(c, False)
        assert not c["memory"]["believed"].any()
    believe_contacts(c, False)
    assert c["memory"]["believed"].tolist() == [0, 0, 1, 0]
