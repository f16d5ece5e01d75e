"""The law on a biped that is not the human: Q_d by MuJoCo's Jacobians, both problems by a library's programs."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest
import qpsolvers

from biped.control.space.pushing import FAR
from biped.control.space.tick import _CREEP, _DAMPED, _HOLD
from tests.control.space.any_scene import AnyScene, h1

SIDE, EDGES = (-1.0, 1.0), 4
JOINT = "actuation.mode=joint"


def wanted(scene: AnyScene) -> np.ndarray:
    """(nv,) Q_d: Σ J_ωᵀ τ with MuJoCo's own Jacobians, couples of joints, springs of what is above the legs."""
    model, data, c, anatomy = scene.model, scene.data, scene.c, scene.anatomy
    gait, phase = c["gait"], c["memory"]["phase"]
    k, b, rest = gait["k"], gait["b"], gait["rest"]
    x, y, z = np.eye(3)
    Q, M = np.zeros(model.nv), scene.M()
    for link, (body, own) in enumerate(
        [(anatomy.torso, anatomy.axes), *((leg.thigh, leg.axes) for leg in anatomy.legs)]
    ):
        J = np.zeros((3, model.nv))
        mujoco.mj_jacBody(model, data, None, J, body)
        axes = data.xmat[body].reshape(3, 3) @ own
        up, across, rate = axes[:, 2], axes[:, 1], J @ data.qvel
        angle = np.array([np.arctan2(up @ z, up @ x), -np.arctan2(up @ y, up @ z), -np.arctan2(across @ x, across @ y)])
        rates = np.array([-rate @ y, rate @ x, rate @ up])
        if link == 0:
            tau = -gait["k_torso"] * (angle - gait["rest_torso"]) - gait["b_torso"] * rates
        else:
            leg, s = link - 1, phase[link - 1]
            sign = np.array([1.0, SIDE[leg], SIDE[leg]])
            goal = rest[s, :3].copy()
            if s >= 2:
                stance = scene.soles()[4 * (1 - leg) : 4 * (2 - leg)].mean(axis=0)
                mujoco.mj_subtreeVel(model, data)
                goal[1] += gait["velocity"] * SIDE[leg] * data.subtree_linvel[scene.robot.base_number, 1]
                apart = abs(anatomy.legs[1].knee[1] - anatomy.legs[0].knee[1])
                goal[1] += gait["position"] * (SIDE[leg] * (data.subtree_com[scene.robot.base_number, 1] - stance[1])
                                               - 0.5 * apart)  # fmt: skip
            tau = sign * (-k[s, :3] * (sign * angle - goal) - b[s, :3] * sign * rates)
        Q += J.T @ (tau[0] * -y + tau[1] * x + tau[2] * up)
    for leg in range(2):
        mine, s = anatomy.legs[leg], phase[leg]
        for i in range(3, 6):
            if mine.joints[i] >= 0:
                j, at = model.jnt_dofadr[mine.joints[i]], model.jnt_qposadr[mine.joints[i]]
                angle, rate = mine.sign[i] * (data.qpos[at] - mine.zero[i]), mine.sign[i] * data.qvel[j]
                Q[j] += mine.sign[i] * (-k[s, i] * (angle - rest[s, i]) - b[s, i] * rate)
    start = model.key_qpos[model.key(scene.robot.start).id]
    for joint in anatomy.trunk:
        j, at = model.jnt_dofadr[joint], model.jnt_qposadr[joint]
        Q[j] -= M[j, j] * (_HOLD**2 * (data.qpos[at] - start[at]) + 2.0 * _DAMPED * _HOLD * data.qvel[j])
    return Q


def passive(scene: AnyScene) -> np.ndarray:
    """(nv,) what joints' damping and dry friction take away."""
    v = scene.data.qvel
    return scene.model.dof_damping * v + scene.model.dof_frictionloss * v / np.hypot(v, _CREEP)


def test_moments_on_bodies_are_projected_and_damping_is_made_up_for():
    scene = h1()
    for q, v in scene.states(6):
        scene.put(q, v)
        commanded, expected = scene.torques(), wanted(scene)
        assert passive(scene) @ np.abs(v) != 0.0
        assert commanded == pytest.approx(expected + passive(scene), abs=1e-9 * np.abs(expected).max())
        # With Q_d applied, the damping of the file takes away just what was added.
        assert scene.data.qfrc_passive == pytest.approx(-passive(scene), abs=1e-9)


def test_a_share_of_Q_d_acts_and_torques_do_the_rest():
    whole, none, some = h1(), h1(JOINT), h1(JOINT, "actuation.assist=0.3")
    columns = [drive.column for drive in some.robot.drives]
    for q, v in whole.states(3, seed=5):
        out = []
        for scene in (whole, none, some):
            scene.put(q, v)
            out.append(scene.torques())
        Q, u, mixed = out
        expected = 0.3 * Q
        expected[columns] += 0.7 * u
        assert np.abs(0.7 * u - 0.7 * Q[columns]).max() > 1.0, "torques do what Q_d does: the test would see no share"
        assert mixed == pytest.approx(expected, abs=1e-6 * np.abs(expected).max())


def test_places_are_mujocos():
    scene = h1(JOINT)
    for q, v in scene.states(4, seed=1):
        scene.put(q, v)
        scene.torques()
        at, belief, M = scene.c["at"], scene.c["belief"], scene.M()
        column = belief["column"]
        there = column >= 0
        upper = at["M_base"].shape[0]
        blocks = np.zeros((len(column), len(column)))
        blocks[:upper, :upper] = at["M_base"]
        reach = at["M_cross"].shape[2]
        for leg in range(2):
            mine = slice(upper + 6 * leg, upper + 6 * leg + 6)
            blocks[mine, mine] = at["M_leg"][leg]
            blocks[mine, upper - reach : upper] = at["M_cross"][leg]
            blocks[upper - reach : upper, mine] = at["M_cross"][leg].T
        assert blocks[np.ix_(there, there)] == pytest.approx(M[np.ix_(column[there], column[there])], abs=1e-12)
        for p in range(8):
            J, bias = scene.J(p)
            leg = p // 4
            mine = np.r_[column[upper - reach : upper], column[upper + 6 * leg : upper + 6 * leg + 6]]
            A = at["A"][:, 12 * leg + 3 * (p % 4) : 12 * leg + 3 * (p % 4) + 3].T
            assert A[:, mine >= 0] == pytest.approx(J[:, mine[mine >= 0]], abs=1e-12)
            assert at["bias"][p] == pytest.approx(bias, abs=1e-10 * max(1.0, np.abs(bias).max()))
            assert at["speed"][p] == pytest.approx(J[0] @ v, abs=1e-12)


class Problem:
    """Both problems of a tick, with MuJoCo's matrices, of points and stops within reach, no ties broken."""

    def __init__(self, scene: AnyScene):
        c, model, anatomy = scene.c, scene.model, scene.anatomy
        act, belief = c["actuation"], c["belief"]
        mu, tau, eps = act["friction"], act["approach"], act["regularisation"]
        nv, stops = model.nv, len(belief["stop_leg"])
        self.M, self.h = scene.M(), scene.mechanics.h.copy()
        Q = wanted(scene)
        rows: list[tuple[np.ndarray, float, float, float, float]] = []  # row, least, away, rho, scale
        root = list(scene.robot.base_columns)
        rigid = np.linalg.inv(self.M[np.ix_(root, root)])
        for p in range(8):
            J, bias = scene.J(p)
            height = scene.soles()[p, 2]
            gap = max(0.0, 2.0 * (J[0] @ scene.data.qvel) / tau + height / tau**2)
            for e in range(EDGES if gap < FAR else 0):
                slope = mu if e % 2 == 0 else -mu
                rows.append((J[0] + slope * J[1 + e // 2], -bias[0] - slope * bias[1 + e // 2] - gap,
                             max(0.0, height), J[0, root] @ rigid @ J[0, root], 1.0))  # fmt: skip
        self.edges = len(rows)
        shank = 0.5 * (anatomy.legs[0].length + anatomy.legs[1].length)
        for one in range(stops):
            joint = anatomy.legs[belief["stop_leg"][one]].joints[belief["stop_joint"][one]]
            j, way = model.jnt_dofadr[joint], belief["stop_way"][one]
            room = way * (scene.data.qpos[model.jnt_qposadr[joint]] - belief["stop_end"][one])
            gap = max(0.0, 2.0 * way * scene.data.qvel[j] / tau + room / tau**2)
            if one < 2 or gap * shank <= FAR:
                row = np.zeros(nv)
                row[j] = way
                rows.append((row, -gap, shank * max(0.0, room), eps, shank))
        G, least, away, rho, scale = (np.array(part) for part in zip(*rows, strict=True))
        self.G, self.forces = G, self.edges + 2
        found = qpsolvers.solve_qp(self.M, self.h - Q, -G, -least, solver="quadprog")
        assert found is not None
        self.wanted = found
        slack = np.maximum(0.0, G @ found - least)
        self.price = rho * ((away / act["reach"]) ** 2 + (scale * slack / act["yielding"]) ** 2)
        self.limit, self.eps = scene.setup.torque_limit, eps
        self.E = np.zeros((nv, len(scene.robot.drives)))
        self.E[scene.robot.columns, np.arange(len(scene.robot.drives))] = 1.0

    def nearest(self, passive: np.ndarray) -> np.ndarray:
        """(nu,) torques, which count on the points' forces and the knees' stops."""
        n, forces = self.E.shape[1], self.forces
        B, W = np.hstack([self.E, self.G[:forces].T]), np.linalg.inv(self.M)
        P = B.T @ W @ B + np.diag(np.concatenate([np.full(n, self.eps), self.price[:forces] + 1e-9]))
        r = -B.T @ W @ (self.M @ self.wanted + self.h + passive)
        low, high = np.concatenate([-self.limit, np.zeros(forces)]), np.concatenate([self.limit, np.full(forces, 1e9)])
        found = qpsolvers.solve_qp(P, r, lb=low, ub=high, solver="quadprog")
        assert found is not None
        return found[:n]


def test_motion_and_torques_are_those_of_the_quadratic_programs():
    scene, bounded, ranges = h1(JOINT), 0, 0
    for number, (q, v) in enumerate(scene.states(8, seed=2)):
        if number % 2:  # an ankle at the end of its range
            leg = scene.anatomy.legs[0]
            q[scene.model.jnt_qposadr[leg.joints[4]]] = scene.model.jnt_range[leg.joints[4], 1] - 1e-3
        scene.put(q, v)
        u = scene.torques()
        problem = Problem(scene)
        ranges += int(len(problem.G) > problem.forces)
        force = problem.M @ problem.wanted + problem.h + passive(scene)
        column = scene.c["belief"]["column"]
        mine = scene.c["work"]["wanted"]
        assert mine[column >= 0] == pytest.approx(force[column[column >= 0]], abs=1e-6 * np.abs(force).max())
        assert not mine[column < 0].any()
        assert u == pytest.approx(problem.nearest(passive(scene)), abs=1e-5 * np.abs(u).max())
        bounded += int((np.abs(u) > problem.limit - 1e-9).any())
    assert bounded, "no torque met its limit: the test would not see that it does"
    assert ranges, "no ankle met its end: the test would not see that it does"


def test_a_share_of_the_damping_may_be_left_uncompensated():
    whole, half = h1(), h1("actuation.pushing.compensation=0.5")
    q, v = whole.states(1)[0]
    Q = []
    for scene in (whole, half):
        scene.put(q, v)
        Q.append(scene.torques())
    assert Q[0] - Q[1] == pytest.approx(0.5 * passive(whole), abs=1e-9)
