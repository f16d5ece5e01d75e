"""A gait's settings travel with it: below what a scenario says, above the defaults."""

from __future__ import annotations

from pathlib import Path

import pytest
from msgspec.structs import replace

from biped.base.errors import InputError
from biped.base.files import folder as folder_of
from biped.base.files import locate, names
from biped.ensemble.plan import Plan
from biped.scenario.devices import Pushing
from biped.scenario.gains import NOT_NEEDED, Frontal, Gains, Pace, Placement, number, single, with_numbers
from biped.scenario.gait import gait_settings, in_the_plane, read_gains, read_settings
from biped.scenario.keys import Backstep, Sensing
from biped.scenario.reading import read, read_scenario, to_toml

GAIT = 'extends = "normal"\n[sensing]\nknee_angle = 0.01\nheel_on = 0.002\n[actuation]\nsingle_tangential = true\n'


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("g.toml").write_text(GAIT, encoding="utf-8")


def scenario(text: str, *changes: str):
    Path("s.toml").write_text(text, encoding="utf-8")
    return read("s.toml", changes)


def test_settings_are_those_of_the_gait_unless_the_scenario_says_otherwise():
    s, origin = scenario('controller = "g.toml"\nsensing.heel_on = 0.004\n', "sensing.toe_on=0.001")
    assert s.sensing == Sensing(knee_angle=0.01, heel_on=0.004, toe_on=0.001)
    assert s.actuation.single_tangential
    assert origin.of("sensing.knee_angle") == "g.toml"
    assert origin.of("sensing.heel_on") == "s.toml"
    assert origin.of("sensing.toe_on") == "--set"
    assert origin.of("sensing.late_stance") == "s.toml"


def test_a_default_that_the_scenario_writes_down_wins_too():
    assert scenario('controller = "g.toml"\nsensing.knee_angle = 0.02\n')[0].sensing.knee_angle == 0.02


def test_a_gait_named_on_the_command_line_brings_its_settings():
    assert scenario("", "controller=g.toml")[0].sensing.knee_angle == 0.01


def test_the_effective_scenario_says_which():
    plan = Plan(*scenario('controller = "g.toml"\n'))
    text = to_toml(plan.scenario)
    assert "knee_angle = 0.01" in text
    Path("again.toml").write_text(text, encoding="utf-8")
    Path("g.toml").write_text(GAIT.replace("0.01", "0.03"), encoding="utf-8")  # no longer matters
    assert Plan(*read("again.toml")).scenario == plan.scenario


def test_an_extending_gait_changes_single_settings():
    Path("h.toml").write_text('extends = "g.toml"\n[sensing]\nknee_angle = 0.0\n', encoding="utf-8")
    s, origin = scenario('controller = "h.toml"\n')
    assert (s.sensing.knee_angle, s.sensing.heel_on) == (0.0, 0.002)
    assert origin.of("sensing.heel_on") == "g.toml"


@pytest.mark.parametrize("saved", [False, True])
def test_a_gait_that_varies_takes_its_settings_along(saved):
    """From the scenario, and from the effective one that is saved with its results."""
    read_ = scenario('controller = "g.toml"\nsensing.toe_on = 0.001\nsweep.controller = ["g.toml", "normal"]\n')
    if saved:
        Path("e.toml").write_text(to_toml(Plan(*read_).scenario), encoding="utf-8")
        read_ = read("e.toml")
    with_settings, without = (Plan(*read_).run(i).scenario for i in (0, 1))
    assert (with_settings.sensing.knee_angle, with_settings.actuation.single_tangential) == (0.01, True)
    assert (without.sensing.knee_angle, without.actuation.single_tangential) == (0.02, False)
    assert with_settings.sensing.toe_on == without.sensing.toe_on == 0.001


BACK = 'extends = "normal"\n[backstep]\nmargin = 0.01\n'


def test_a_gait_may_step_back():
    Path("b.toml").write_text(BACK, encoding="utf-8")
    s, origin = scenario('controller = "b.toml"\nbackstep.theta_l = 70.0\n')
    assert s.backstep == Backstep(margin=0.01, theta_l=70.0)
    assert origin.of("backstep.margin") == "b.toml"
    backstep = {"margin": 0.01, "theta_l": 70.0, "k_d2": 300.0, "b_d2": 10.0, "bend": 0.0, "k_d3": 0.0, "b_d3": 0.0}
    assert gait_settings(s) == {"start": {"posture": "flat"}, "backstep": backstep}
    assert scenario('controller = "normal"\n')[0].backstep is None


@pytest.mark.parametrize("first", ["b.toml", "normal"])
def test_the_step_back_goes_with_its_gait(first):
    Path("b.toml").write_text(BACK, encoding="utf-8")
    plan = Plan(*scenario(f'controller = "{first}"\nsweep.controller = ["b.toml", "normal"]\n'))
    assert [plan.run(i).scenario.backstep for i in (0, 1)] == [Backstep(margin=0.01), None]


@pytest.mark.parametrize("first", ["b.toml", "normal"])
def test_a_gait_may_step_back_with_the_numbers_of_all(first):
    Path("b.toml").write_text('extends = "normal"\n[backstep]\n', encoding="utf-8")
    plan = Plan(*scenario(f'controller = "{first}"\nsweep.controller = ["b.toml", "normal"]\n'))
    assert [plan.run(i).scenario.backstep for i in (0, 1)] == [Backstep(), None]


def test_a_step_back_of_the_scenario_stays():
    Path("b.toml").write_text(BACK, encoding="utf-8")
    text = 'controller = "b.toml"\nbackstep.k_d2 = 100.0\nsweep.controller = ["b.toml", "normal"]\n'
    plan = Plan(*scenario(text))
    assert [plan.run(i).scenario.backstep for i in (0, 1)] == [Backstep(margin=0.01, k_d2=100.0), Backstep(k_d2=100.0)]


def test_a_step_back_whose_number_varies_stays():
    """Also where the number happens to be that of the gait it came with."""
    Path("b.toml").write_text(BACK, encoding="utf-8")
    plan = Plan(
        *scenario('controller = "b.toml"\nsweep = { controller = ["normal"], "backstep.margin" = [0.01, 0.02] }\n')
    )
    assert [plan.run(i).scenario.backstep for i in (0, 1)] == [Backstep(margin=0.01), Backstep(margin=0.02)]


def test_the_numbers_of_a_robots_step_back_are_no_step_back():
    assert read_scenario("robot/level").backstep is None
    assert (
        Plan(*scenario('model = "robot"\ncontroller = "robot"\nsweep.controller = ["robot"]\n'))
        .run(0)
        .scenario.backstep
        is None
    )


def test_a_setting_that_varies_itself_is_nobody_elses():
    plan = Plan(*scenario('sweep = { controller = ["g.toml"], "sensing.knee_angle" = [0.02, 0.03] }\n'))
    assert [plan.run(i).scenario.sensing.knee_angle for i in (0, 1)] == [0.02, 0.03]


PUSHING = 'extends = "normal"\nactuation.contacts = "pushing"\n[actuation.pushing]\n'


@pytest.mark.parametrize("varied", ["", "'actuation.pushing.reach' = [0.003]\n"])
def test_a_gait_that_varies_takes_the_numbers_of_a_table_within_a_table_along(varied):
    """One by one: what the scenario says of one, or varies, stays."""
    Path("p.toml").write_text(PUSHING + "regularisation = 2e-3\napproach = 0.03\n", encoding="utf-8")
    Path("q.toml").write_text(PUSHING + "regularisation = 4e-3\nstops = false\n", encoding="utf-8")
    text = 'controller = "p.toml"\nactuation.pushing.yielding = 6.0\n[sweep]\ncontroller = ["p.toml", "q.toml"]\n'
    plan = Plan(*scenario(text + varied))
    reach = 0.003 if varied else 0.002
    assert [plan.run(i).scenario.actuation.pushing for i in (0, 1)] == [
        Pushing(regularisation=2e-3, approach=0.03, yielding=6.0, reach=reach),
        Pushing(regularisation=4e-3, stops=False, yielding=6.0, reach=reach),
    ]


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("sensing.kne_angle = 0.1", r"g\.toml: sensing\.kne_angle: unknown key; did you mean 'knee_angle'"),
        ("sensing.knee_angle = -0.1", r"g\.toml: sensing\.knee_angle: expected .* >= 0"),
        ("sensing = 3", r"g\.toml: sensing: expected a table"),
        ("ground.friction = 1.0", r"g\.toml: ground: unknown key"),
        ("actuation.limit = 'clp'", r"g\.toml: actuation\.limit: expected one of clip, bounded"),
    ],
)
def test_complaints_name_the_gait(text, says):
    Path("g.toml").write_text(f'extends = "normal"\n{text}\n', encoding="utf-8")
    with pytest.raises(InputError, match=says):
        Plan(*scenario('controller = "g.toml"\n'))


def test_shipped_gaits_are_used_with_their_settings():
    """No shipped scenario repeats a setting of its gait."""
    for name in names("scenarios"):
        s, origin = read(name)
        if not s.controller:
            continue  # a robot of another kind, with a law that has no gait
        settings, _ = read_settings(locate("controllers", s.controller, ""))
        settings.pop("start", None)  # where a run starts is a scenario's own matter
        for key in (f"{table}.{key}" for table, values in settings.items() for key in values):
            theirs = [one for one in origin.keys if one.startswith(f"{key}.")]
            if key == "actuation.pushing" and theirs and not origin.keys[key].is_relative_to(folder_of("controllers")):
                for one in theirs:  # of a table within a table it may say some numbers: others than the gait's
                    word = one.rpartition(".")[2]
                    assert getattr(s.actuation.pushing, word) != getattr(settings["actuation"]["pushing"], word), one
                continue
            assert origin.keys[key].is_relative_to(folder_of("controllers")), (name, key)


def test_what_a_table_within_a_table_leaves_unsaid_is_the_gait_s():
    """One key of [actuation.pushing] does not put the others back to their defaults."""
    gait = read_scenario("upright/own").actuation.pushing
    changed = read_scenario("upright/own", ["actuation.pushing.stops=true"]).actuation.pushing
    assert changed.stops
    assert replace(changed, stops=False) == gait
    assert gait.regularisation != Pushing().regularisation
    assert gait.smoothing > 0.0


def test_made_for_is_what_differs_from_the_defaults():
    s = read_scenario("tuned/level")
    assert gait_settings(s) == {
        "sensing": {"knee_angle": 2.389e-05},
        "actuation": {"single_tangential": True},
        "start": {"posture": "heel_toe"},
    }


@pytest.mark.parametrize(("name", "changes", "wanted"), [
    ("level_fast", ["start.posture=flat"], {"posture": "flat"}),
    ("any/cells/level", ["start.posture=flat"], {"posture": "flat"}),
    ("any/cells/level", ["controller=any/stand"], None),
    ("level_fast", ['randomise.draw={"start.posture"={grid=["flat","single"]}}'], None),
])  # fmt: skip
def test_a_gait_says_where_its_walk_began(name, changes, wanted):
    """Also in a posture that is the default of some robots; not in one that was drawn, or in a robot's own stand."""
    assert gait_settings(read_scenario(name, changes)).get("start") == wanted


def test_the_start_of_a_gait_lies_below_the_scenario_s(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text('extends = "fast"\n[start]\nposture = "single"\n', encoding="utf-8")
    mine = f'controller="{path}"'
    scenario = tmp_path / "run.toml"
    scenario.write_text('controller = "mine.toml"\nduration = 1.0\n', encoding="utf-8")
    assert read_scenario(str(scenario)).start.posture == "single"
    assert read_scenario(str(scenario), ["start.posture=flat"]).start.posture == "flat"
    assert read_scenario(str(scenario), [mine, "start.jitter=0.01"]).start.posture == "single"
    path.write_text('extends = "fast"\n[start]\njitter = 0.1\n', encoding="utf-8")
    with pytest.raises(InputError, match=r"start\.jitter: unknown key"):
        read_scenario(str(scenario))


def test_what_a_robot_says_itself_its_gaits_need_not_say():
    settings = gait_settings(read_scenario("tune/robot_brisk"))
    assert set(settings) == {"actuation"}
    assert set(settings["actuation"]) == {"contacts", "pushing"}
    assert settings["actuation"]["pushing"].friction == 0.6


def test_tables_of_a_walker_in_space_are_whole_and_can_be_changed_in_part():
    whole = read_gains(locate("controllers", "human3d", "controller"), Gains())
    assert not [name for name in whole.missing() if name not in ("speed", *NOT_NEEDED)]
    part = Gains(frontal=Frontal(placement=Placement(velocity=0.5)))
    changed = read_gains(locate("controllers", "human3d", "controller"), part)
    assert changed.frontal is not None
    assert changed.frontal.placement is not None
    assert changed.frontal.placement.velocity == 0.5
    assert changed.frontal.placement.position == number(whole, "frontal.placement.position")
    assert with_numbers(changed, {"frontal.placement.velocity": number(whole, "frontal.placement.velocity")}) == whole


def test_a_table_of_a_walker_in_space_that_lacks_a_gain_is_refused(tmp_path):
    text = locate("controllers", "human3d", "controller").read_text()
    file = tmp_path / "gait.toml"
    file.write_text(text.replace("placement = {", "# {"))
    with pytest.raises(InputError, match=r"frontal\.placement: missing; \[frontal\] has k_d1"):
        read_gains(file, Gains())


def test_a_pace_is_whole_and_in_the_plane_has_no_side(tmp_path):
    text = locate("controllers", "human3d", "controller").read_text()
    file = tmp_path / "gait.toml"
    file.write_text(text + "\n[pace]\nspeed = 0.8\nslope = 1.0\nside = 0.0\nstance = 0.1\n")
    with pytest.raises(InputError, match=r"pace\.swing: missing; \[pace\] has speed, slope, side, swing, stance"):
        read_gains(file, Gains())
    gains = read_gains(file, Gains(pace=Pace(swing=0.2)))
    assert gains.pace == Pace(0.8, 1.0, 0.0, 0.2, 0.1)
    in_the_plane(Gains(pace=gains.pace), "human")
    with pytest.raises(InputError, match=r"gains\.pace\.side: expected 0: model 'human' moves in the plane"):
        in_the_plane(Gains(pace=Pace(side=0.1)), "human")


def test_single_numbers_of_tables():
    assert single(["k_d1", "k_d2.1", "axial.k_d1"]) == ["k_d1", "k_d2.1", "axial.k_d1"]
    names = ("position", "velocity", "apart", "crossing", "shorten", "push")
    assert single(["frontal.placement"]) == [f"frontal.placement.{name}" for name in names]
    assert single(["frontal.theta_l"]) == [f"frontal.theta_l.{i}" for i in range(4)]
    assert len(single(["frontal", "axial"])) == 2 * (1 + 4) + 2 * 4 + 2 * 4 + len(names) + 2 * (1 + 4) + 1 + 4
