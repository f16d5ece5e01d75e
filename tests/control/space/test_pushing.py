"""Ground that only pushes, out of the plane: both problems against a library's quadratic programs."""

from __future__ import annotations

import numpy as np
import pytest
import qpsolvers

from biped.control.space.pushing import FAR
from biped.control.space.tick import spatial_tick
from biped.engines.loop import drive
from biped.engines.mujoco import MujocoPlant
from biped.ensemble.plan import Plan
from biped.robot.run import Run
from biped.scenario.reading import read_scenario
from tests.control.space.scene import BASE, LEG, N, Scene

EDGES, N_EDGES = 4, 32


@pytest.fixture(scope="module")
def scene() -> Scene:
    return Scene()


class Problem:
    """Both problems, of all points or of those that are within reach, no ties broken."""

    def __init__(self, scene: Scene, far: float):
        c, m = scene.c, scene.mechanics
        act, at = c["actuation"], c["at"]
        mu, tau, eps = act["friction"], act["approach"], act["regularisation"]
        self.M, self.h, self.Q = scene.M(), m.h.copy(), c["tick"]["Q_d"].copy()
        self.G, self.least = np.zeros((34, N)), np.zeros(34)
        away, rho, scale = np.zeros(34), np.zeros(34), np.ones(34)
        rigid = np.linalg.inv(self.M[:BASE, :BASE])
        for p in range(8):
            J = scene.J(p)
            speed, height = 2.0 * at["speed"][p] / tau, at["height"][p] / tau**2
            gap = max(0.0, speed + height)
            gap = act["braking"] * min(0.0, speed + max(0.0, height)) if gap == 0.0 else gap
            if gap >= far:
                self.least[EDGES * p : EDGES * p + EDGES] = -1e9
                continue
            for e in range(EDGES):
                k, slope = EDGES * p + e, mu if e % 2 == 0 else -mu
                self.G[k] = J[0] + slope * J[1 + e // 2]
                self.least[k] = -at["bias"][p, 0] - slope * at["bias"][p, 1 + e // 2] - gap
                away[k], rho[k] = max(0.0, at["height"][p]), J[0, :BASE] @ rigid @ J[0, :BASE]
        for leg in range(2):
            k, j = N_EDGES + leg, BASE + LEG * leg + 3
            self.G[k, j] = -1.0
            self.least[k] = -max(0.0, -2.0 * m.v[j] / tau - m.q[j + 1] / tau**2)
            away[k], rho[k], scale[k] = 0.4428 * max(0.0, -m.q[j + 1]), eps, 0.4428
        self.limit, self.eps = act["limit"], eps
        self.wanted = qpsolvers.solve_qp(self.M, self.h - self.Q, -self.G, -self.least, solver="quadprog")
        assert self.wanted is not None
        slack = np.maximum(0.0, self.G @ self.wanted - self.least)
        self.price = rho * ((away / act["reach"]) ** 2 + (scale * slack / act["yielding"]) ** 2)

    def nearest(self, forces: int = 34) -> np.ndarray:
        """(12,) torques that count on the first so many forces: 32 are those of points, 34 with the knees' stops."""
        E = np.vstack([np.zeros((BASE, 12)), np.eye(12)])
        B, W = np.hstack([E, self.G[:forces].T]), np.linalg.inv(self.M)
        P = B.T @ W @ B + np.diag(np.concatenate([np.full(12, self.eps), self.price[:forces] + 1e-9]))
        r = -B.T @ W @ (self.M @ self.wanted + self.h)
        low = np.concatenate([-self.limit, np.zeros(forces)])
        high = np.concatenate([self.limit, np.full(forces, 1e9)])
        found = qpsolvers.solve_qp(P, r, lb=low, ub=high, solver="quadprog")
        assert found is not None
        return found[:12]


def some_states(scene: Scene) -> list[tuple[np.ndarray, np.ndarray]]:
    """Around the start: feet flat, on an edge, one in the air; fast enough that torques meet their limits."""
    rng, out = np.random.default_rng(3), []
    for number in range(8):
        q, v = scene.q.copy(), scene.v + 0.3 * rng.standard_normal(N)
        q[7:] += (0.0 if number < 3 else 0.03) * rng.standard_normal(12)
        scene.put(q, v)
        q[2] -= scene.data.geom_xpos[scene.points, 2].min()
        out.append((q, v))
    return out


@pytest.fixture(params=[0.0, 0.6])
def braking(request, scene: Scene):
    scene.c["actuation"]["braking"] = request.param
    yield request.param
    scene.c["actuation"]["braking"] = 0.0


@pytest.mark.usefixtures("braking")
def test_motion_and_torques_are_those_of_the_quadratic_programs(scene):
    bounded = 0
    for q, v in some_states(scene):
        scene.put(q, v)
        spatial_tick(scene.record, scene.mechanics, True)
        problem = Problem(scene, FAR)
        force = problem.M @ problem.wanted + problem.h
        assert scene.c["work"]["wanted"] == pytest.approx(force, abs=1e-6 * np.abs(force).max())
        u = scene.c["tick"]["u"]
        assert u == pytest.approx(problem.nearest(), abs=1e-5 * np.abs(u).max())
        # What is beyond reach has a price that leaves a thousandth of it.
        assert u == pytest.approx(Problem(scene, np.inf).nearest(), abs=3e-3 * np.abs(u).max())
        bounded += int((np.abs(u) > problem.limit - 1e-9).any())
    assert bounded > 0, "no torque met its limit: the test would not see that it does"


def changes_of(run: Run) -> np.ndarray:
    """(ticks, 4) how often the sets of a run's problems changed, and how many problems were given up."""
    out: list[tuple[int, ...]] = []

    def watch(*_):
        tick = plant.law.law.record[0]["tick"]
        out.append((*tick["changes"], tick["given_up"]))

    plant = MujocoPlant(run, watch)
    drive(plant)
    return np.array(out)


def test_no_tick_of_a_walk_is_given_up():
    """Flat feet of a gait that used to change a problem's set up to 200 times, and then went on without a solution."""
    changes = changes_of(Plan(read_scenario("spatial/quick", ["duration=3.0"])).run(0))
    assert len(changes) == 3000
    assert not changes[:, 3].any()
    assert 1 < changes[:, :3].max() < 60


@pytest.mark.slow
@pytest.mark.parametrize(("name", "gait"), [("spatial/level", "human3d"), ("spatial/quick", "human3d_sure")])
def test_sets_change_as_seldom_as_the_docs_say(name, gait):
    """The table in docs/any-biped.md; `pytest -m slow -s` prints its numbers."""
    plan = Plan(read_scenario(name, ["randomise.runs=3", "expect={}"]))
    assert plan.scenario.controller == gait
    changes = np.vstack([changes_of(plan.run(index)) for index in range(3)])
    first = changes[:, 0]
    print(f"{gait}: {len(first)} ticks, {first.mean():.2f}, {np.quantile(first, 0.999):.0f}, {first.max()}, "
          f"given up {(changes[:, 3] > 0).sum()}")  # fmt: skip
    assert first.mean() < 2.0
    assert np.quantile(first, 0.999) < 30
    assert not changes[:, 3].any()


def test_without_the_stops_the_knees_torques_do_what_they_would(scene):
    differ, actuation = 0, scene.c["actuation"]
    for q, v in some_states(scene):
        scene.put(q, v)
        torques = {}
        for stops in (1, 0):
            actuation["stops"] = stops
            spatial_tick(scene.record, scene.mechanics, True)
            torques[stops] = scene.c["tick"]["u"].copy()
        actuation["stops"] = 1
        assert not scene.c["tick"]["force"][N_EDGES:].any()
        problem = Problem(scene, FAR)
        assert torques[0] == pytest.approx(problem.nearest(N_EDGES), abs=1e-5 * np.abs(torques[0]).max())
        differ += int(np.abs(torques[1] - torques[0]).max() > 1.0)
    assert differ > 0, "no stop bore anything: the test would not see that it does not"


def test_smoothed_torques_go_a_fraction_of_the_way(scene):
    u, actuation, apart = np.zeros(12), scene.c["actuation"], 0.0
    for k, (q, v) in enumerate(some_states(scene)):
        scene.put(q, v)
        before = scene.c["memory"].copy()
        actuation["follow"] = 1.0
        spatial_tick(scene.record, scene.mechanics, k == 0)
        asked = scene.c["tick"]["u"].copy()
        scene.c["memory"] = before
        actuation["follow"] = 0.4
        spatial_tick(scene.record, scene.mechanics, k == 0)
        u = asked if k == 0 else u + 0.4 * (asked - u)
        assert scene.c["tick"]["u"] == pytest.approx(u, abs=1e-9)
        apart = max(apart, np.abs(u - asked).max())
    actuation["follow"] = 1.0
    assert apart > 1.0, "torques hardly changed: the test would not see that they are smoothed"


def test_torques_change_no_faster_than_their_slew(scene):
    actuation, before, bound = scene.c["actuation"], np.zeros(12), 0
    actuation["most"] = 2.0
    for k, (q, v) in enumerate(some_states(scene)):
        scene.put(q, v)
        spatial_tick(scene.record, scene.mechanics, k == 0)
        u = scene.c["tick"]["u"].copy()
        if k > 0:
            assert np.abs(u - before).max() <= 2.0 + 1e-9
            bound += int((np.abs(u - before) > 2.0 - 1e-9).sum())
        before = u
    actuation["most"] = np.inf
    assert bound > 20, "torques hardly change: the test would not see that they may not jump"


def test_a_walker_that_ground_holds_moves_as_q_d_would(scene):
    """One flat foot, nothing at a limit: twelve torques do what Q_d does to all that the ground leaves free."""
    scene.sensed(scene.q, scene.v)
    q, v = scene.q.copy(), np.zeros(N)
    q[3:7], q[7:] = (1.0, 0.0, 0.0, 0.0), 0.0
    q[13], q[16] = 0.3, -0.9  # the left leg is up
    q[10] = -0.05  # the right knee is off its stop
    q[7], q[11] = 0.025, 0.025
    scene.put(q, v)
    q[2] -= scene.data.geom_xpos[scene.points, 2].min()
    scene.put(q, v)
    gait, pushing = scene.c["gait"].copy(), scene.c["actuation"].copy()
    try:
        for name in ("k_torso", "b_torso", "k", "b"):
            scene.c["gait"][name] = 0.0
        scene.c["actuation"]["regularisation"], scene.c["actuation"]["limit"] = 1e-9, 1e4
        scene.c["gait"]["k"][0, 4] = 20.0  # a weak ankle: the foot stays flat
        spatial_tick(scene.record, scene.mechanics, True)
        problem = Problem(scene, FAR)
        E = np.vstack([np.zeros((BASE, 12)), np.eye(12)])
        # Q_d and u each with the forces that hold the four points where they are.
        A = np.vstack([scene.J(p) for p in range(4)])

        def moves(force):
            K = np.block([[problem.M, A.T], [A, np.zeros((12, 12))]])
            return np.linalg.lstsq(K, np.concatenate([force - problem.h, np.zeros(12)]), rcond=None)[0][:N]

        by_torques, by_q_d = moves(E @ scene.c["tick"]["u"]), moves(problem.Q)
        assert by_torques == pytest.approx(by_q_d, abs=1e-3 * np.abs(by_q_d).max())
    finally:
        scene.c["gait"], scene.c["actuation"] = gait, pushing
