"""Gains and settings that change during a run."""

from __future__ import annotations

from pathlib import Path

import msgspec
import numpy as np
import pytest

from biped.base.errors import InputError
from biped.base.files import locate
from biped.ensemble import campaign
from biped.ensemble.plan import Plan
from biped.measure.trajectory import Trajectory
from biped.scenario.devices import ActuationChange, Change
from biped.scenario.gains import Gains
from biped.scenario.gait import read_gains
from biped.scenario.keys import Scenario, Start
from biped.scenario.randomise import Distribution, Randomise
from biped.scenario.reading import read_scenario, to_toml

WALK = Scenario(duration=0.6, start=Start(posture="heel_toe"))
LEAN = Gains(theta_b=80.0, k_d2=(500.0, 60.0, 60.0, 0.0))


def trajectory(scenario: Scenario, *changes: Change) -> Trajectory:
    return campaign.simulate(Plan(msgspec.structs.replace(scenario, change=changes)).run(0))


@pytest.mark.parametrize("engine", ["mujoco", "home"])
def test_change_at_once_is_the_other_gait_from_the_start(engine):
    scenario = msgspec.structs.replace(WALK, engine=engine)
    other = msgspec.structs.replace(scenario, gains=LEAN)
    np.testing.assert_array_equal(trajectory(scenario, Change(at=0.0, gains=LEAN)).log, trajectory(other).log)


def test_nothing_changes_before_its_time():
    plain, changed = trajectory(WALK), trajectory(WALK, Change(at=0.25, gains=LEAN))
    np.testing.assert_array_equal(changed.q[:251], plain.q[:251])
    assert np.abs(changed.Q_d[250] - plain.Q_d[250]).max() > 1.0


def test_a_gait_whose_knees_are_straight_does_not_keep_those_of_the_gait_before():
    bent = msgspec.structs.replace(WALK, gains=Gains(theta_k=(-10.0, 0.0, 0.0, -10.0)))
    kept, straight = (trajectory(bent, Change(at=0.2, **what)) for what in ({"gains": LEAN}, {"controller": "normal"}))
    gains = Plan(WALK).run(0).gains
    for t, rest in ((kept, -10.0), (straight, 0.0)):
        rows = (t.time > 0.2) & (t.phase[:, 0] == 1)
        assert rows.any()
        torque = -gains.k_d3[0] * (t.q[rows, 4] - np.radians(rest)) - gains.b_d3[0] * t.v[rows, 4]
        np.testing.assert_allclose(t.Q_d[rows, 4], torque, atol=1e-9)


def test_gains_go_linearly_and_stay():
    """The hip's couple of (3.16) from logged angles and states, with gains interpolated here."""
    t = trajectory(WALK, Change(at=0.1, over=0.2, gains=Gains(k_d2=(350.0, 70.0, 70.0, 30.0))))
    gains = Plan(WALK).run(0).gains
    share = np.clip((t.time - 0.1 + t.tick) / 0.2, 0.0, 1.0)[:, None]
    k = (1.0 - share) * np.array(gains.k_d2) + share * np.array([350.0, 70.0, 70.0, 30.0])
    for leg in range(2):
        state = t.phase[:, leg].astype(int) - 1
        angle = t.q[:, 2] + t.q[:, 3 + 3 * leg] + np.pi / 2
        rate = t.v[:, 2] + t.v[:, 3 + 3 * leg]
        couple = (
            -k[np.arange(len(t)), state] * (angle - np.radians(gains.theta_l)[state])
            - np.array(gains.b_d2)[state] * rate
        )
        np.testing.assert_allclose(t.Q_d[:, 3 + 3 * leg], couple, atol=1e-9)


def test_changes_follow_one_another_and_keep_what_they_do_not_name():
    one, other = Change(at=0.2, gains=Gains(theta_b=80.0)), Change(at=0.2, gains=Gains(k_d1=600.0))
    both = Change(at=0.2, gains=Gains(theta_b=80.0, k_d1=600.0))
    np.testing.assert_array_equal(trajectory(WALK, one, other).log, trajectory(WALK, both).log)


@pytest.mark.parametrize("engine", ["mujoco", "home"])
def test_every_touching_contact_counts_from_then_on(engine):
    scenario = msgspec.structs.replace(WALK, engine=engine)
    t = trajectory(scenario, Change(at=0.3, actuation=ActuationChange(contacts="touching")))
    touching = t.height < scenario.sensing.contact_height
    assert (t.active[:300, :4] < touching[:300]).any(), "the release test drops some before"
    np.testing.assert_array_equal(t.active[300:, :4], touching[300:])


def test_gait_by_name_and_by_speed_is_written_out(tmp_path):
    """The effective scenario says all there is to say, and says the same when read again."""
    changes = (
        Change(at=0.1, controller="robust", gains=Gains(theta_b=80.0)),
        Change(at=0.2, gains=Gains(speed=0.6)),
    )
    plan = Plan(msgspec.structs.replace(WALK, change=changes))
    robust = locate("controllers", "robust", "")
    first, second = plan.run(0).scenario.change
    assert first.gains == read_gains(robust, Gains(theta_b=80.0))
    assert second.gains == read_gains(robust, Gains(speed=0.6))
    file = tmp_path / "again.toml"
    file.write_text(to_toml(plan.scenario), encoding="utf-8")
    assert Plan(read_scenario(str(file))).scenario == plan.scenario


def test_controller_beside_the_file_that_names_it(tmp_path: Path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "deep").mkdir()
    (tmp_path / "deep/mine.toml").write_text('extends = "fast"\ntheta_b = 77.0', encoding="utf-8")
    (tmp_path / "deep/s.toml").write_text('change = [{ at = 1.0, controller = "mine.toml" }]', encoding="utf-8")
    assert Plan(read_scenario("deep/s.toml")).run(0).scenario.change[0].gains.theta_b == 77.0


def test_changes_vary_like_any_key():
    scenario = msgspec.structs.replace(
        WALK,
        change=(Change(at=0.1, controller="robust"),),
        sweep={"change.0.gains.theta_b": (75.0, 85.0)},
        randomise=Randomise(runs=2, draw={"change.0.at": Distribution(uniform=(0.1, 0.5))}),
    )
    plan = Plan(scenario)
    changes = [plan.run(i).scenario.change[0] for i in range(4)]
    assert [change.gains.theta_b for change in changes] == [75.0, 75.0, 85.0, 85.0]
    assert changes[0].at == changes[2].at != changes[1].at
    varied = msgspec.structs.replace(scenario, sweep={"change.0.controller": ("fast", "style")})
    fast, style = (Plan(varied).run(i).scenario.change[0].gains for i in (0, 2))
    assert (fast, style) == tuple(read_gains(locate("controllers", name, ""), Gains()) for name in ("fast", "style"))


def test_no_contacts_to_choose_where_the_ground_only_pushes():
    with pytest.raises(
        InputError, match=r"change\[0\]\.actuation\.contacts: expected none where actuation.contacts = "
    ):
        read_scenario("calm/own", ['change=[{at=1.0,actuation.contacts="touching"}]'])
