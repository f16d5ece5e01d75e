"""Gains that go over to others during a run in space, as they do in the plane."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from msgspec.structs import replace

from biped.base.errors import InputError
from biped.control.blending import blend, changes_in, step_type
from biped.control.space.record import GAIT
from biped.control.space.setup import set_gains
from biped.engines.mujoco import simulate
from biped.ensemble.campaign import run_one
from biped.ensemble.failures import load_packed, save_packed
from biped.ensemble.plan import Plan
from biped.robot.leg_states import SWING
from biped.scenario.reading import read_scenario
from tests.control.space.scene import Scene


def plan_of(*changes: str) -> Plan:
    return Plan(read_scenario("spatial/own", ["start.jitter=0.0", "duration=0.3", *changes]))


def test_a_change_at_once_is_the_other_gait_from_the_start():
    ground = "actuation.pushing={approach=0.015,reach=0.002,yielding=8.0,regularisation=1e-3}"
    other = 'change=[{at=0.0,controller="human3d_stand"}]'  # which has no pace, and does not say so
    changed = simulate(plan_of(ground, "gains.pace={speed=0.0,slope=0.0,side=0.0,swing=0.2,stance=0.2}", other).run(0))
    np.testing.assert_array_equal(changed.log, simulate(plan_of(ground, 'controller="human3d_stand"').run(0)).log)
    assert changed.changes == (0.0,)


def test_nothing_changes_before_its_time():
    plain = simulate(plan_of().run(0))
    changed = simulate(plan_of("change=[{at=0.1,gains.frontal.k_d1=1000.0,gains.axial.theta_b=20.0}]").run(0))
    np.testing.assert_array_equal(changed.q[:101], plain.q[:101])
    np.testing.assert_array_equal(changed.u[:100], plain.u[:100])
    assert np.abs(changed.u[100] - plain.u[100]).max() > 1.0


def test_every_number_of_the_gait_goes_linearly_and_stays():
    scene = Scene('change=[{at=0.1,over=0.2,controller="human3d_stand"},{at=0.5,gains.k_d1=1.0}]')
    setup, gait = scene.setup, scene.c["gait"]
    changes = changes_in(scene.record, step_type(GAIT), setup.scenario, setup.gains, set_gains)
    before, after = np.zeros(1, GAIT), np.zeros(1, GAIT)
    set_gains(before[0], setup.gains)
    set_gains(after[0], Plan(read_scenario("spatial/own", ['controller="human3d_stand"'])).run(0).gains)
    for k in range(600):
        blend(changes, k)
        if k == 550:
            after[0]["k_torso"][0] = 1.0
        share = np.clip((k - 99) / 200, 0.0, 1.0)
        for name in GAIT.names or ():
            wanted = (1.0 - share) * before[0][name] + share * after[0][name]
            if k not in range(500, 550):
                np.testing.assert_allclose(gait[name], wanted, rtol=1e-14, atol=1e-14, err_msg=f"{name} {k}")
    assert gait["k_torso"][0] == 1.0


def test_back_is_the_gait_that_the_run_began_with():
    scene = Scene('change=[{at=0.0,controller="human3d_stand"},{at=0.2,over=0.1,to="first"},{at=0.4,gains.k_d1=1.0},'
                  '{at=0.5,to="first",gains.b_d1=2.0}]')  # fmt: skip
    setup, gait = scene.setup, scene.c["gait"]
    changes = changes_in(scene.record, step_type(GAIT), setup.scenario, setup.gains, set_gains)
    begun, other = np.zeros(1, GAIT), np.zeros(1, GAIT)
    set_gains(begun[0], setup.gains)
    set_gains(other[0], Plan(read_scenario("spatial/own", ['controller="human3d_stand"'])).run(0).gains)
    seen = {}
    for k in range(600):
        blend(changes, k)
        seen[k] = gait.copy()
    for name in GAIT.names or ():
        np.testing.assert_array_equal(seen[150][name], other[0][name])
        np.testing.assert_array_equal(seen[350][name], begun[0][name])
    assert (seen[450]["k_torso"][0], seen[450]["b_torso"][0]) == (1.0, begun[0]["b_torso"][0])
    assert (seen[550]["k_torso"][0], seen[550]["b_torso"][0]) == (begun[0]["k_torso"][0], 2.0)


def test_back_where_there_is_nothing_to_go_back_from_or_to_is_refused():
    with pytest.raises(InputError, match=r"change\[0\]\.to: expected a change before it"):
        plan_of('change=[{at=0.1,to="first"}]')
    with pytest.raises(InputError, match=r'change\[1\]\.controller: expected none with to = "first"'):
        plan_of('change=[{at=0.0,gains.k_d1=1.0},{at=0.1,to="first",controller="human3d_stand"}]')


def test_a_gait_names_those_by_which_it_stops_and_sets_off(tmp_path):
    """Names in the folder of gaits, or files beside the gait; who else is looked for too."""
    (tmp_path / "mine.toml").write_text('extends = "human3d"\n[transitions]\nstart = "off.toml"\n', encoding="utf-8")
    (tmp_path / "off.toml").write_text('extends = "human3d_stand"\ntheta_b = 70.0\n', encoding="utf-8")
    both = 'change=[{at=0.1,to="stand"},{at=0.2,to="start",gains.b_d1=2.0}]'
    changes = plan_of(f'controller="{tmp_path / "mine.toml"}"', both).run(0).scenario.change
    stand = plan_of('controller="human3d_stand"').run(0).gains
    assert changes[0].gains == stand
    assert changes[1].gains == replace(stand, theta_b=70.0, b_d1=2.0)


@pytest.mark.parametrize(("table", "words"), [
    ('stand = "none_such"', r"mine\.toml: transitions\.stand: no controller 'none_such'"),
    ("stand = 3", r"mine\.toml: transitions\.stand: expected a string, got a whole number"),
    ('halt = "human3d_stand"', r"mine\.toml: transitions\.halt: unknown key"),
    ('start = "human3d_stand"', r"change\[0\]\.to: gait '.*mine\.toml' names no gait for it: expected stand = "),
])  # fmt: skip
def test_transitions_that_lead_nowhere_are_refused(tmp_path, table, words):
    path = tmp_path / "mine.toml"
    # Only what a run asks for is looked for; what it asks for and the file does not have is an error.
    path.write_text(f'{(Path("controllers") / "human3d.toml").read_text("utf-8").partition("[transitions]")[0]}'
                    f"[transitions]\n{table}\n", encoding="utf-8")  # fmt: skip
    with pytest.raises(InputError, match=words):
        plan_of(f'controller="{path}"', 'change=[{at=0.1,to="stand"}]')


def test_a_change_that_waits_begins_some_time_after_a_foot_has_landed():
    """One leg comes down in ticks 120, 320 and 360: the change waits for the second landing, and not for a third."""
    scene = Scene("change=[{at=0.2,over=0.1,after_landing=0.05,gains.k_d1=1.0}]")
    setup, gait, phase = scene.setup, scene.c["gait"], scene.c["memory"]["phase"]
    changes = changes_in(scene.record, step_type(GAIT), setup.scenario, setup.gains, set_gains)
    before, seen = gait["k_torso"][0], []
    for k in range(600):
        phase[:] = 0, (SWING if k < 120 or 200 <= k < 320 or 340 <= k < 360 else 0)
        blend(changes, k)
        seen.append(gait["k_torso"][0])
    assert seen[:370] == [before] * 370, "50 ticks after the landing in tick 320"
    shares = (before - np.array(seen[370:470])) / (before - 1.0)
    np.testing.assert_allclose(shares, np.arange(1, 101) / 100.0, atol=1e-12)
    assert set(seen[470:]) == {1.0}


def test_a_change_that_waits_for_a_foot_that_never_lands_never_begins():
    scene = Scene("change=[{at=0.1,after_landing=0.0,gains.k_d1=1.0},{at=0.2,gains.b_d1=2.0}]")
    setup, gait, phase = scene.setup, scene.c["gait"], scene.c["memory"]["phase"]
    changes = changes_in(scene.record, step_type(GAIT), setup.scenario, setup.gains, set_gains)
    before = gait.copy()
    phase[:] = 0, 1
    for k in range(600):
        blend(changes, k)
    assert gait == before, "nor do those after it"


def test_a_change_that_begins_late_takes_its_whole_time():
    """It waits for the one before, which takes 0.2 s from 0.1 s on, and begins in the tick in which that ends."""
    scene = Scene("change=[{at=0.1,over=0.2,gains.k_d1=1.0},{at=0.15,over=0.1,gains.b_d1=2.0}]")
    setup, gait = scene.setup, scene.c["gait"]
    changes = changes_in(scene.record, step_type(GAIT), setup.scenario, setup.gains, set_gains)
    k_before, b_before, k_seen, b_seen = gait["k_torso"][0], gait["b_torso"][0], [], []
    for k in range(500):
        blend(changes, k)
        k_seen.append(gait["k_torso"][0])
        b_seen.append(gait["b_torso"][0])
    shares = (k_before - np.array(k_seen[100:300])) / (k_before - 1.0)
    np.testing.assert_allclose(shares, np.arange(1, 201) / 200.0, atol=1e-12)
    np.testing.assert_allclose(b_seen[:299], b_before, rtol=1e-14)
    shares = (b_before - np.array(b_seen[299:399])) / (b_before - 2.0)
    np.testing.assert_allclose(shares, np.arange(1, 101) / 100.0, atol=1e-12)
    assert set(k_seen[300:]) == {1.0}
    assert set(b_seen[399:]) == {2.0}


def test_a_change_before_the_last_one_begins_is_refused():
    with pytest.raises(InputError, match=r"change\[1\]\.at: expected at least 0\.2 s, when the last one begins"):
        plan_of("change=[{at=0.2,gains.k_d1=1.0},{at=0.1,gains.b_d1=2.0}]")


def test_how_long_it_takes_to_set_off_is_the_gait_s(tmp_path):
    text = 'extends = "human3d"\n[transitions]\nstand = "human3d_stand"\nstart = "human3d_stand"\n'
    path = tmp_path / "mine.toml"
    setting_off = 'change=[{at=0.0,to="stand"},{at=0.1,to="start"},{at=0.1,to="first"}]'
    for more, wanted in (("", [None, 0.2, 0.25]), ("start_over = 0.05\nwalk_over = 0.1\n", [None, 0.05, 0.1])):
        path.write_text(text + more, encoding="utf-8")
        changes = plan_of(f'controller="{path}"', setting_off).run(0).scenario.change
        assert [change.over for change in changes] == wanted
    own = 'change=[{at=0.0,to="stand"},{at=0.1,over=0.01,to="start"},{at=0.1,over=0.02,to="first"}]'
    assert [one.over for one in plan_of(f'controller="{path}"', own).run(0).scenario.change] == [None, 0.01, 0.02]
    again = 'change=[{at=0.0,to="stand"},{at=0.1,to="first"}]'  # who does not set off by `start` goes back at once
    assert [one.over for one in plan_of(f'controller="{path}"', again).run(0).scenario.change] == [None, None]


def test_after_a_landing_a_walk_stops_as_its_gait_says(tmp_path):
    text = 'extends = "human3d"\n[transitions]\nstop = "human3d_stand"\nstop_after_landing = 0.15\n'
    (tmp_path / "mine.toml").write_text(text, encoding="utf-8")
    mine = f'controller="{tmp_path / "mine.toml"}"'
    changes = plan_of(mine, 'change=[{at=0.1,to="stop"}]').run(0).scenario.change
    assert changes[0].after_landing == 0.15
    own = plan_of(mine, 'change=[{at=0.1,to="stop",after_landing=0.0}]').run(0).scenario.change
    assert own[0].after_landing == 0.0


def test_part_of_a_pace_is_refused_where_there_is_none():
    with pytest.raises(
        InputError, match=r"change\[0\]\.gains\.pace: speed, slope, side, stance missing; \[pace\] has speed"
    ):
        simulate(plan_of("change=[{at=0.1,gains.pace.swing=0.1}]").run(0))


def test_a_gait_of_the_plane_is_refused_where_it_is_named():
    with pytest.raises(InputError, match=r"change\[0\]\.gains\.frontal: missing: model 'human3d' moves in space"):
        plan_of('change=[{at=0.1,controller="calm"}]')
    with pytest.raises(InputError, match=r"^gains\.frontal: missing: model 'human3d' moves in space"):
        plan_of('controller="robust"')  # not its settings, which have no meaning there either
    with pytest.raises(InputError, match=r"change\[0\]\.gains\.axial: expected none: model 'human' moves in the plane"):
        Plan(read_scenario("level_normal", ["change=[{at=0.1,gains.axial.theta_b=9.0}]"]))


def test_changes_are_kept_with_the_run(tmp_path):
    """One that stands at last has a stopping distance, counted from its first change."""
    changes = ('controller="human3d_stand"', "start.posture=stand", "duration=1.6", "window.start=0.6",
               "window.end=1.6", "change=[{at=0.4,over=0.2,gains.theta_l=[86.0,127.0,120.5,122.0]}]")  # fmt: skip
    t, row = run_one(plan_of(*changes), 0)
    assert row.as_dict()["stood"]
    assert row.as_dict()["stopping_distance"] == pytest.approx(t.x[-1] - t.x[400])
    assert abs(t.x[-1] - t.x[400]) > 1e-3
    save_packed(t, tmp_path / "t.xz")
    assert load_packed(tmp_path / "t.xz").changes == t.changes == (0.4,)


@pytest.mark.parametrize("mode", ["joint", "generalized"])
@pytest.mark.parametrize("posture", ["stand", "stride"])
def test_it_stands_through_a_push(mode, posture):
    changes = ('controller="human3d_stand"', f"actuation.mode={mode}", f"start.posture={posture}", "duration=4.0",
               "window.start=3.0", "window.end=4.0", "push=[{at=0.5,duration=0.2,force=[-35.0,35.0,0.0]}]")  # fmt: skip
    t, row = run_one(plan_of(*changes), 0)
    assert row.as_dict()["stood"], row.as_dict()["cause"]
    assert t.com_velocity[:, 1].max() > 0.02, "the push does nothing: the test could not fail"


def test_from_rest_it_walks_once_its_weight_is_shifted():
    s = read_scenario("spatial/stand_to_walk", ["duration=9.0", "window.start=5.0", "start.jitter=0.0"])
    _, row = run_one(Plan(s), 0)
    assert row.as_dict()["walked"], row.as_dict()["cause"]
    at_once = replace(s, change=(replace(s.change[1], at=2.0),))
    assert run_one(Plan(at_once), 0)[0].end == "fell", "the shift is needed for nothing"
