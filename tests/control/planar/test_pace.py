"""What a pace adds to Q_d of seven links, in closed form, and in both engines from what the law sensed."""

from __future__ import annotations

import msgspec
import numpy as np
import pytest

from biped.base.errors import InputError
from biped.engines.home import simulate as at_home
from biped.engines.planar.mujoco import simulate
from biped.ensemble.plan import Plan
from biped.robot.planar.tree import motion
from biped.robot.robot import seven_links
from biped.robot.run import Run
from biped.scenario.devices import Actuation
from biped.scenario.gains import Gains, Pace
from biped.scenario.keys import Scenario
from biped.scenario.reading import read_scenario
from biped.scenario.world import Ground
from tests.ticks import Bench, dynamics, states

PACE = Pace(speed=0.6, slope=1.5, side=0.0, swing=0.3, stance=-0.2, knee=9.0, ankle=50.0)
ON = "gains.pace={speed=0.6,slope=1.5,side=0.0,swing=0.3,stance=-0.2,knee=9.0,ankle=50.0}"
HIPS, KNEES, ANKLES = (3, 6), (4, 7), (5, 8)


def bench(gains: Gains, slope: float, angles: str) -> Bench:
    ground = Ground(slope=slope, angles=angles)
    return Bench(Scenario(actuation=Actuation(torque_limit=1e9), ground=ground, gains=gains))


@pytest.mark.parametrize(
    ("slope", "angles", "rise"), [(0.0, "gravity", 0.0), (5.0, "gravity", 5.0), (5.0, "slope", 0.0)]
)
def test_legs_follow_the_speed_of_the_centre_of_mass(slope, angles, rise):
    """The speed is that of MuJoCo's mass matrix, whose first row is the momentum forward."""
    plain, paced = bench(Gains(), slope, angles), bench(Gains(pace=PACE), slope, angles)
    k, seen = plain.run.gains.k_d2, set()
    for q, v in states(60, 31):
        plain.tick(q, v)
        paced.tick(q, v)
        M = dynamics(q, v).M
        faster = M[0] @ v / M[0, 0] - 0.6 + 1.5 * np.radians(rise)
        added = np.zeros(9)
        for leg, s in enumerate(paced.c["memory"]["phase"]):
            couple = k[s] * (0.3 if s >= 2 else -0.2) * faster
            added[2] += couple
            added[HIPS[leg]] = couple
            added[KNEES[leg]] = 9.0 * max(faster, 0.0) ** 2 if s >= 2 else 0.0
            v0 = 0.6 - 1.5 * np.radians(rise)
            slow = s == 1 and -2.0 * v0 < faster < 0.0
            added[ANKLES[leg]] = -50.0 * faster**2 * (1.0 + (v0 + faster) / v0) if slow else 0.0
            seen.add((int(s), slow))
        found = paced.c["tick"]["Q_d"] - plain.c["tick"]["Q_d"]
        np.testing.assert_allclose(found, added, atol=1e-9 * max(1.0, np.abs(added).max()))
    assert seen == {(0, False), (1, False), (1, True), (2, False), (3, False)}


@pytest.mark.parametrize(
    ("slope", "angles", "leaned"), [(5.0, "gravity", 6.0), (-5.0, "gravity", 0.0), (5.0, "slope", 0.0)]
)
def test_the_torso_leans_uphill_as_if_its_spring_rested_further_forward(slope, angles, leaned):
    leans = bench(Gains(pace=msgspec.structs.replace(PACE, lean=1.2)), slope, angles)
    rests = bench(Gains(pace=PACE, theta_b=leans.run.gains.theta_b - leaned), slope, angles)
    for q, v in states(10, 32):
        leans.tick(q, v)
        rests.tick(q, v)
        np.testing.assert_allclose(leans.c["tick"]["Q_d"], rests.c["tick"]["Q_d"], atol=1e-9)


def couples(run: Run, t, late: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Couples of the thighs, as logged, and as they follow from the motion of some ticks ago and the logged states."""
    tree, gains = seven_links(run.robot).tree, run.gains
    q, v = t.q[: len(t.q) - late], t.v[: len(t.q) - late]
    at = motion(tree, q, v)
    speed = at.com_velocity[..., 0] @ tree.mass / tree.mass.sum()
    faster = speed - PACE.speed + PACE.slope * np.radians(run.scenario.ground.slope)
    wanted = np.zeros((len(q), 2))
    for leg, thigh in enumerate((1, 4)):
        s = t.phase[late:, leg].astype(int) - 1
        k, b, rest = (np.array(g)[s] for g in (gains.k_d2, gains.b_d2, np.radians(gains.theta_l)))
        angle = at.angle[:, thigh] + np.pi / 2 + np.radians(run.scenario.ground.slope)
        flexed = np.where(s >= 2, PACE.swing, PACE.stance) * faster
        wanted[:, leg] = -k * (angle - rest - flexed) - b * at.rate[:, thigh]
    return t.Q_d[late:, HIPS], wanted


@pytest.mark.parametrize(("made", "more"), [
    (simulate, ()), (at_home, ("engine=home",)), (simulate, ("control.mechanics=pinocchio",)),
    (simulate, ("actuation.mode=generalized",)),
])  # fmt: skip
def test_it_is_at_work_in_every_loop(made, more):
    run = Plan(read_scenario("gentle/own", ["duration=0.5", "ground.slope=2.0", "backstep.margin=9.0", ON, *more])).run(
        0
    )
    found, wanted = couples(run, made(run))
    np.testing.assert_allclose(found, wanted, atol=1e-8)


def test_the_law_follows_what_it_senses_and_not_the_truth():
    changes = ["duration=0.5", "ground.slope=2.0", "backstep.margin=9.0", "sensors.delay=0.01", ON]
    run = Plan(read_scenario("gentle/own", changes)).run(0)
    t = simulate(run)
    found, wanted = couples(run, t, late=10)
    np.testing.assert_allclose(found, wanted, atol=1e-8)
    found, wanted = couples(run, t)
    assert np.abs(found - wanted).max() > 1.0


def test_it_is_off_by_default_and_can_change():
    on = Plan(read_scenario("gentle/own", ["duration=0.4", ON])).run(0)
    off = Plan(read_scenario("gentle/own", ["duration=0.4"])).run(0)
    assert off.gains.pace is None
    later = Plan(read_scenario("gentle/own", ["duration=0.4", "change=[{at=0.0," + ON + "}]"])).run(0)
    np.testing.assert_array_equal(simulate(later).log, simulate(on).log)
    back = Plan(read_scenario("gentle/own", ["duration=0.4", ON, 'change=[{at=0.0,controller="gentle"}]'])).run(0)
    np.testing.assert_array_equal(simulate(back).log, simulate(off).log)


@pytest.mark.parametrize(("change", "words"), [
    (ON.replace("side=0.0", "side=0.5"), r"gains\.pace\.side: expected 0: model 'human' moves in the plane"),
    (ON.replace("side=0.0,", ""), r"pace\.side: missing; \[pace\] has speed, slope, side, swing, stance"),
    ("change=[{at=0.1,gains.pace.swing=0.3}]", r"change\[0\]\.gains\.pace: speed, slope, side, stance missing"),
])  # fmt: skip
def test_a_pace_is_whole_and_has_no_side(change, words):
    with pytest.raises(InputError, match=words):
        simulate(Plan(read_scenario("gentle/own", ["duration=0.4", change])).run(0))
