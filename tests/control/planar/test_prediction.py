"""The state that the law believes in: its mechanics against MuJoCo's and against an oracle, and whole walks."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from biped.control.planar.estimator import infer
from biped.control.planar.prediction import believe, prediction_of, step
from biped.control.planar.senses import Senses
from biped.engines.home import simulate as home
from biped.engines.mujoco import simulate
from biped.robot.planar.tree import motion
from biped.scenario.devices import Actuation
from biped.scenario.keys import Scenario, Sensing
from biped.studies.run import plan_of
from tests.control.planar.test_pushing import edges, least_distance
from tests.ticks import Bench, dynamics, foreign, states

LATE = ("sensors.delay=0.01", "duration=3")
PREDICTED = (*LATE, "sensing.predict=0.01")
SENSES = ("sensors.encoders={}", "sensors.gyro={}", "sensors.switches={}", "estimator={}")


def moved(bench: Bench, q, v, u, seconds: float, steps: int) -> np.ndarray:
    """(2, 9) where the law's mechanics take a state under joint torques u (6,)."""
    one = prediction_of(bench.run.scenario, q, v)
    one.record[0]["dt"] = seconds / steps
    q, v, force = q.copy(), v.copy(), np.r_[np.zeros(3), u]
    for _ in range(steps):
        step(bench.c, one.record[0], q, v, force)
    return np.array([q, v])


def test_a_step_in_the_air_is_right_to_the_second_order():
    """Against MuJoCo's Runge-Kutta of a thousand parts."""
    bench, rng = Bench(), np.random.default_rng(4)
    for q, v in states(5, 3):
        q[1] += 5.0
        q[[4, 7]] -= 0.3  # far from their stops
        u = 10.0 * rng.normal(size=6)
        off = []
        for seconds in (2e-4, 1e-4):
            model = foreign()
            kept = model.opt.timestep, model.opt.integrator
            model.opt.timestep, model.opt.integrator = seconds / 1000, mujoco.mjtIntegrator.mjINT_RK4
            data = mujoco.MjData(model)
            data.qpos[:], data.qvel[:], data.qfrc_applied[3:] = q, v, u
            mujoco.mj_step(model, data, 1000)
            model.opt.timestep, model.opt.integrator = kept
            off.append(np.abs(moved(bench, q, v, u, seconds, 1) - [data.qpos, data.qvel]).max(axis=1))
        np.testing.assert_allclose(off[0] / off[1], 4.0, rtol=0.1)


def test_the_ground_pushes_by_gauss_s_principle():
    """The velocity after a step is the nearest, by M, to that of the forces alone which no gap forbids."""
    bench, seen, worst = Bench(Scenario(actuation=Actuation(torque_limit=1e9, contacts="pushing"))), set(), 0.0
    dt = 1e-3
    for q, v in states(200, 1):
        d = dynamics(q, v)
        _, after = moved(bench, q, v, np.zeros(6), dt, 1)
        R = np.linalg.cholesky(d.M).T
        G = edges(d, 1.0)
        gap = [-h / dt if h > 1e-3 else 0.0 for h in d.height for _ in range(2)] + [q[k] / dt for k in (4, 7)]
        free = v - dt * np.linalg.solve(d.M, d.h)
        C = np.linalg.solve(R.T, G.T).T
        ours = R @ (after - free)
        oracle = least_distance(C, np.array(gap) - G @ free)
        worst = max(worst, np.abs(ours - oracle).max() / max(1.0, np.abs(oracle).max()))
        seen.add(tuple(np.abs(G @ after - gap) < 1e-6))
    assert worst < 1e-6
    assert len(seen) > 40


def test_a_wrong_mass_matrix_predicts_wrong():
    q, v = next(states(1, 2))
    right, wrong = Bench(), Bench()
    wrong.c["tree"]["mass"] *= 1.1
    a, b = (moved(bench, q, v, 20.0 * np.ones(6), 0.01, 10) for bench in (right, wrong))
    assert np.abs(a - b).max() > 1e-3


def test_nothing_to_predict_is_what_is_sensed():
    bench = Bench()
    q, v = next(states(1, 5))
    one = prediction_of(Scenario(sensing=Sensing(predict=1e-6)), q, v)
    out = np.zeros(9), np.zeros(9)
    for k in range(3):
        believe((one,), (), bench.record, k, *out)
        np.testing.assert_array_equal(out, (q, v))


@pytest.mark.parametrize("mode", ["joint", "generalized"])
def test_a_delay_of_no_tick_changes_no_digit(mode):
    changes = ("duration=1", f'actuation.mode="{mode}"')
    plain, same = (
        simulate(plan_of("upright/own", (*changes, *more)).run(0)) for more in ((), ("sensing.predict=1e-6",))
    )
    np.testing.assert_array_equal(plain.log, same.log)


def heights(t, name: str = "upright/own") -> np.ndarray:
    """(n, 4) true heights of toes and heels."""
    return motion(plan_of(name, ()).run(0).tree, t.q, t.v).point[..., 1]


def test_a_walk_is_believed_where_it_is():
    """10 ms at a swinging foot's 3 m/s are 30 mm; what is left is the compliance of MuJoCo's ground."""
    late, predicted = (simulate(plan_of("upright/own", changes).run(0)) for changes in (LATE, PREDICTED))
    assert np.quantile(np.abs(late.height - heights(late)), 0.95) > 5e-3
    off = np.abs(predicted.height - heights(predicted))
    assert np.quantile(off, 0.95) < 5e-4
    assert predicted.end == "completed"


def test_it_believes_a_push_no_sooner_than_it_is_sensed():
    """Nobody predicts what nobody knows: the torques are those of the walk without it until its delay is over."""
    push = "push=[{at=1.0,duration=0.1,force=[200.0,0.0]}]"
    plain, pushed = (simulate(plan_of("upright/own", (*PREDICTED, *more)).run(0)) for more in ((), (push,)))
    first = np.argmax((plain.u != pushed.u).any(axis=1))
    assert 1010 <= first <= 1012


def test_an_observer_sees_through_noise():
    """Heights of the feet, 1 m of leg from a torso that is known to 2 mm and angles known to 3 mrad, to a third."""
    noise = ("sensors.angle_noise=0.003", "sensors.height_noise=0.002")
    off = []
    for more in ((), ("sensing.follow=0.03", "sensing.follow_rates=0.01")):
        t = simulate(plan_of("upright/own", (*PREDICTED, *noise, *more)).run(0))
        off.append(np.std((t.height - heights(t))[500:]))
    assert off[1] < off[0] / 3.0


@pytest.mark.parametrize("delay", [0, 7])
def test_senses_are_late_by_whole_ticks(delay):
    run = plan_of("robot/sensors", ("duration=0.05", f"sensors.delay={delay * 1e-3}", "sensors.gyro.noise=0")).run(0)
    t = simulate(run)
    exact = plan_of("robot/sensors", ("duration=0.05",)).run(0)
    one = Senses(exact, exact.tree, t.q[0], t.v[0], len(t))
    rounded = np.radians([4.2e-3, 7.3e-3, 4.2e-3] * 2)
    senses = Senses(run, run.tree, t.q[0], t.v[0], len(t))
    record = Bench(Scenario()).record
    for k in range(len(t)):
        infer((senses.inference,), record, t.q[k], t.v[k], t.log, k, senses.q, senses.v)
        expected = t.q[max(0, k - delay), 3:]
        np.testing.assert_array_less(np.abs(senses.joints - expected), 0.51 * rounded)
        infer((one.inference,), record, t.q[k], t.v[k], t.log, k, one.q, one.v)
    np.testing.assert_allclose(senses.noted[delay:, 0], one.noted[: len(t) - delay, 0], atol=1e-3)


def test_noise_of_the_encoders_is_as_large_as_it_says():
    run = plan_of("robot/sensors", ("duration=1", "sensors.angle_noise=0.003")).run(0)
    noise = Senses(run, run.tree, run.q, run.v, 1000).angle_noise
    assert noise.std() == pytest.approx(0.003, rel=0.03)
    assert abs(np.corrcoef(noise[1:, 0], noise[:-1, 0])[0, 1]) < 0.1


@pytest.mark.slow
@pytest.mark.parametrize("engine", ["mujoco", "home"])
@pytest.mark.parametrize(
    ("scenario", "change", "least"),
    [
        ("upright/senses", (), 24),
        ("upright/senses", ("sensing.predict=0", "sensing.follow=0", "sensing.follow_rates=0"), None),
        ("upright/late", ("sensing.predict=0.007",), 24),
        ("upright/late", ("sensing.predict=0.013",), 24),
    ],
)
def test_walks_with_real_senses(scenario, change, least, engine):
    """Of 24 unseen starts; without the prediction none walks."""
    engine = f'engine="{engine}"'
    plan = plan_of(scenario, (*change, engine, "seed=99", "randomise.runs=24"))
    go = home if "home" in engine else simulate
    walked = sum(go(plan.run(i)).end == "completed" for i in range(24))
    assert walked <= 2 if least is None else walked >= least - 1
