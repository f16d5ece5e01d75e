"""Sentinels: what no fall can do has diverged, what does not balance is doubtful, what is sound stays what it is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from biped.ensemble.campaign import run_one
from biped.measure import verdict
from biped.measure.metrics import assess, measure
from biped.measure.metrics.walking import apart, kind_of, outcome
from biped.measure.trajectory import Trajectory
from biped.robot.planar.tree import motion
from biped.studies.run import plan_of
from tests.runs import made, synthetic, tree

WINDOW = (0.5, 2.0)


def run(name: str, *changes: str, seconds: float = 3.0) -> tuple[Trajectory, dict]:
    window = ["window.start=1.0", f"window.end={seconds}"]
    t, row = run_one(plan_of(name, [f"duration={seconds}", *window, *changes]), 0)
    return t, row.as_dict()


def fast_at(t: Trajectory) -> int | None:
    """The row in which a link is too fast, if there is one."""
    return verdict.first_too_fast(replace(t))  # the log may have changed since it was looked at last


def residual(t: Trajectory) -> float:
    return measure(t, WINDOW)["energy_residual"]


@pytest.mark.parametrize("name", ["walk", "slope", "slippery", "pushed", "generalized", "pyramidal", "substeps"])
def test_sound_runs_are_left_alone(name):
    t = made(name)
    judged, numbers = assess(t, (0.0, t.time[-1]))
    assert (judged.end, numbers["verdict"], numbers["doubt"]) == ("completed", "sound", "")
    assert judged.log is t.log
    wide = verdict.SAMPLED if t.sampled else 1.0
    assert numbers["energy_residual"] < 0.5 * verdict.ENERGY * wide
    assert numbers["momentum_residual"] < 0.6 * verdict.MOMENTUM * wide


def test_forces_of_one_step_of_several_are_sampled():
    assert made("substeps").sampled
    assert not made("walk").sampled


@pytest.mark.parametrize(
    ("name", "change", "why"),
    [
        ("level_normal", "sensors.delay=0.6", "faster than any fall"),
        ("level_normal", "simulation.iterations=1", "momentum not accounted for"),
        ("level_normal_generalized", "simulation.iterations=1", "not accounted for"),
        ("home", "truth.joint_damping=3300.0", "torso faster than any fall can make it at 0.001 s"),
        ("level_normal", "ground.damping_ratio=0.01", "faster than any fall"),
    ],
)
def test_a_blow_up_counts_as_a_fall_and_is_no_walk(name, change, why):
    t, row = run(name, change)
    assert (row["end"], row["cause"], row["verdict"]) == (t.end, t.cause, "diverged")
    assert why in f"{row['cause']}; {row['doubt']}"
    assert (row["walked"], row["stood"], row["fell"], row["diverged"]) == (False, False, True, True)
    assert np.isfinite(t.log).all(), "nothing is kept from where it blew up"
    assert "diverged: " in outcome(row)


def test_the_bound_on_speed_is_the_energy_of_the_fall_in_the_lightest_link():
    """v = sqrt(2 M g h / m): the human's foot, 1 kg or so, at tens of m/s."""
    t = synthetic(0.1, q=[0.0, 1.3, *[0.0] * 7])
    whole = motion(t.tree, t.q, t.v)
    mass = tree().mass
    height = mass @ whole.com[0, :, 1] / mass.sum()
    bound = np.sqrt(2.0 * mass.sum() * 9.81 * height / mass.min())
    for factor, expected in ((0.999, None), (1.001, 50)):
        t.v[50:, 1] = factor * bound
        assert fast_at(t) == expected
    shoved = replace(t, pushes=((0.0, 0.1, 10.0 * mass[0] / 0.1, 0.0, "torso"),))  # 10 m/s of a torso by itself
    assert fast_at(shoved) is None


def test_a_start_at_great_speed_and_a_slide_downhill_are_no_blow_up():
    thrown = synthetic(1.0, q=[0.0, 1.3, *[0.0] * 7], v=[1000.0, *[0.0] * 8])
    assert fast_at(thrown) is None
    time = 0.001 * np.arange(8000)
    q, v = np.zeros((8000, 9)), np.zeros((8000, 9))
    pull = 9.81 * np.sin(np.radians(44.0))
    q[:, 0], q[:, 1], v[:, 0] = 0.5 * pull * time**2, 1.3, pull * time  # without friction
    slid = synthetic(8.0, q=q, v=v)
    assert fast_at(replace(slid, slope=-44.0)) is None
    assert fast_at(slid) is not None, "on level ground nothing slides like that"


def forged(t: Trajectory, extra: float) -> Trajectory:
    """The run with less work in its last tick [J] than was done: it moves as it did, and its momentum is what it is."""
    account = t.work.copy()
    account[-2] -= extra
    return replace(t, account=account)


def test_energy_from_nowhere_is_doubtful_and_much_of_it_diverged():
    t = made("walk")
    work = abs(residual(forged(t, 100.0)) - residual(t))  # of 100 J
    one = 0.01 * 100.0 / work
    for share, said in ((0.5, "sound"), (2.0, "doubtful"), (9.0, "doubtful"), (12.0, "diverged")):
        judged, numbers = assess(forged(t, share * one), WINDOW)
        assert (judged.end, numbers["verdict"]) == ("completed", said), share
        if said == "doubtful":
            assert (numbers["doubtful"], numbers["walked"], numbers["stood"], numbers["falls"]) == (1, 0, 0, 0)
            assert "energy not accounted for at 1.999 s" in numbers["doubt"]
            row = {"end": judged.end, "cause": judged.cause, **numbers}
            assert outcome(row) == f"stayed up; doubtful: {numbers['doubt']}"
    sampled = replace(forged(t, 9.0 * one), sampled=True)
    assert assess(sampled, WINDOW).numbers["verdict"] == "sound"


def test_a_doubtful_fall_is_a_fall_and_doubtful():
    t = replace(made("walk"), end="fell", cause="fell forward at 1.999 s")
    judged, numbers = assess(forged(t, 20.0), WINDOW)
    assert (judged.end, judged.cause) == ("fell", "fell forward at 1.999 s")
    assert (numbers["falls"], numbers["doubtful"], numbers["diverged"], numbers["walked"]) == (1, 1, 0, 0)
    row = {"end": judged.end, "cause": judged.cause, **numbers}
    assert outcome(row).startswith("fell forward at 1.999 s; doubtful: energy not accounted for at 1.999 s: ")
    assert kind_of(row) == "fell forward; doubtful: energy not accounted for"


@pytest.mark.parametrize(
    ("end", "cause", "now"),
    [
        ("fell", "fell forward at 0.4 s", ("fell", "fell forward at 0.4 s", "sound", "")),
        ("doubtful", "energy not accounted for at 1 s: 3 %, at most 1 %; contacts chattering at 1 s: in 9 of 10 ticks",
         ("completed", "", "doubtful",
          "energy not accounted for at 1 s: 3 %, at most 1 %; contacts chattering at 1 s: in 9 of 10 ticks")),
        ("doubtful", "energy from nowhere at 1 s: 9 %, at most 5 %; collapsed at 1 s",
         ("fell", "collapsed at 1 s", "doubtful", "energy from nowhere at 1 s: 9 %, at most 5 %")),
        ("diverged", "momentum not accounted for at 1 s: 99 %, at most 1 %; fell backward at 1 s",
         ("fell", "fell backward at 1 s", "diverged", "momentum not accounted for at 1 s: 99 %, at most 1 %")),
        ("diverged", "MuJoCo warned of badqacc before 1 s; fell backward at 1 s",
         ("diverged", "MuJoCo warned of badqacc before 1 s; fell backward at 1 s", "diverged", "")),
    ],
)  # fmt: skip
def test_rows_in_which_the_verdict_replaced_the_end_are_read(end, cause, now):
    row = apart({"end": end, "cause": cause, "fell": end in ("fell", "diverged")})
    assert (row["end"], row["cause"], row["verdict"], row["doubt"]) == now
    assert row["fell"] == (now[0] in ("fell", "diverged"))
    assert apart(row) is row


def test_forces_that_do_not_carry_the_weight_are_doubtful():
    """Momentum: the ground's force is a tenth too small, and so is its work, which hardly shows in the energy."""
    t = replace(made("walk"), log=made("walk").log.copy())
    t.column("force")[..., 1] *= 0.97
    judged, numbers = assess(t, WINDOW)
    assert numbers["momentum_residual"] == pytest.approx(0.03, rel=0.1)
    assert (judged.end, numbers["verdict"]) == ("completed", "doubtful")
    assert "momentum not accounted for" in numbers["doubt"]


def test_pushes_are_part_of_the_momentum():
    t = made("pushed")
    assert measure(t, (0.0, 1.0))["momentum_residual"] < 1e-3
    assert measure(replace(t, pushes=()), (0.0, 1.0))["momentum_residual"] > 1e-2


def test_chattering_in_excess_is_said():
    for count, said in ((190, "sound"), (210, "doubtful")):
        numbers = assess(replace(made("walk"), warnings={"chattering_steps": count}), WINDOW).numbers
        assert numbers["verdict"] == said
    assert "contacts chattering at 1.999 s: in 210 of 2000 ticks" in numbers["doubt"]


def test_a_flight_is_no_walk_and_does_not_pass():
    from biped.ensemble.checks import judge, passed

    t, row = run("level_normal_generalized", "start.v=[5.0,60.0,0,0,0,0,0,0,0]", seconds=10.0)
    assert (t.end, row["walked"], row["stood"], row["flight"]) == ("completed", False, False, 1.0)
    assert row["energy_residual"] < verdict.ENERGY, "a flight is accounted for"
    assert outcome(row) == "stayed up without walking: in the air"
    assert passed(judge({}, {"diverged": 0, "doubtful": 0}, [row])) is False


def test_a_run_of_one_row_is_judged():
    judged, numbers = assess(replace(made("walk"), log=made("walk").log[:1], end="fell", cause="x"), WINDOW)
    assert (judged.end, numbers["energy_residual"], numbers["momentum_residual"]) == ("fell", 0.0, 0.0)
