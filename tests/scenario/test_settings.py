"""Readings of the thesis: settings by name, below what a scenario says itself."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from biped.base.errors import InputError
from biped.base.files import folder, names
from biped.ensemble.plan import Plan
from biped.scenario.devices import Actuation
from biped.scenario.keys import Sensing
from biped.scenario.reading import Read, read, read_scenario, to_toml
from biped.scenario.world import Ground


@pytest.fixture(autouse=True)
def _here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("own.toml").write_text(
        '[actuation]\nlimit = "bounded"\nrelease_force = 99.0\n[ground]\nfriction = 7.0\n', encoding="utf-8"
    )


def scenario(text: str) -> Read:
    Path("s.toml").write_text(text, encoding="utf-8")
    return read("s.toml")


def test_a_reading_lies_below_what_the_scenario_says():
    s, origin = scenario('reading = "own.toml"\nactuation.release_force = 120.0\n')
    assert (s.actuation.limit, s.actuation.release_force, s.ground.friction) == ("bounded", 120.0, 7.0)
    assert origin.of("ground.friction") == "own.toml"
    assert origin.of("actuation.release_force") == "s.toml"


def test_the_command_line_may_name_a_reading():
    Path("s.toml").write_text('controller = "fast"\n', encoding="utf-8")
    assert read_scenario("s.toml", ["reading=own.toml"]).ground.friction == 7.0
    assert read_scenario("level_fast", ["reading=clipped"]).actuation.limit == "clip"


@pytest.mark.parametrize("saved", [False, True])
def test_a_reading_that_varies_exchanges_its_settings(saved):
    text = 'reading = "own.toml"\nsensing.toe_on = 0.001\nsweep.reading = ["own.toml", "clipped", "bounded"]\n'
    made = scenario(text)
    if saved:
        Path("e.toml").write_text(to_toml(Plan(*made).scenario), encoding="utf-8")
        made = read("e.toml")
    runs = [Plan(*made).run(i).scenario for i in range(3)]
    assert [s.actuation.limit for s in runs] == ["bounded", "clip", "bounded"]
    assert [s.ground.friction for s in runs] == [7.0, 3.0, 100.0]
    assert {s.sensing.toe_on for s in runs} == {0.001}


def test_a_reading_may_be_drawn():
    plan = Plan(*scenario('reading = "clipped"\nrandomise.draw.reading.grid = ["own.toml", "clipped"]\n'))
    assert plan.run(0).scenario.ground.friction == 7.0


def test_a_gait_with_settings_of_its_own_takes_the_rest_of_a_reading():
    """It was made for them, so a mixture of both would be neither."""
    s = read_scenario("level_normal", ["controller=robust"])
    assert s.actuation == Actuation(single_tangential=True)
    assert s.sensing == Sensing(knee_angle=0.0)
    assert s.ground.friction == read_scenario("level_normal").ground.friction != Ground().friction


def test_a_sweep_over_such_gaits_does_the_same():
    plan = Plan(*scenario('reading = "bounded"\nsweep.controller = ["normal", "robust", "normal"]\n'))
    assert [plan.run(i).scenario.actuation.limit for i in range(3)] == ["bounded", "clip", "bounded"]
    assert [plan.run(i).scenario.sensing.heel_on for i in range(3)] == [0.0, 0.006, 0.0]


def test_the_clipped_reading_is_what_holds_without_one():
    with_it, without = scenario('reading = "clipped"\n')[0], scenario("")[0]
    assert (with_it.actuation, with_it.sensing, with_it.ground) == (
        without.actuation, without.sensing, without.ground,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("text", "reading", "says"),
    [
        ('reading = "bonded"\n', "", r"s\.toml: reading: no reading 'bonded'; .*did you mean 'bounded'"),
        ("reading = 3\n", "", r"s\.toml: reading: expected"),
        ('reading = "r.toml"\n', "ground.frction = 1.0", r"r\.toml: ground\.frction: unknown key.*'friction'"),
        ('reading = "r.toml"\n', "ground.friction = -1.0", r"r\.toml: ground\.friction: expected"),
        ('reading = "r.toml"\n', "push = []", r"r\.toml: push: expected one of sensing, actuation"),
        ('sweep.reading = ["bonded"]\n', "", r"s\.toml: .*no reading 'bonded'"),
    ],
)
def test_complaints_name_the_file(text, reading, says):
    Path("r.toml").write_text(f"{reading}\n", encoding="utf-8")
    with pytest.raises(InputError, match=says):
        Plan(*scenario(text))


def test_shipped_readings_are_read_and_described():
    assert {"bounded", "clipped", "plastic", "touching"} <= set(names("readings"))
    for path in folder("readings").glob("*.toml"):
        assert read_scenario("level_normal", [f"reading={path.stem}"]).reading == path.stem


def test_the_published_gaits_are_read_as_plastic_and_no_searched_one_is():
    for name in names("scenarios"):
        s = read_scenario(name, looking=True)
        published = s.controller in {"slow", "normal", "fast", "style", "downhill"}
        if s.reading == "plastic":
            assert published, name


def test_a_change_reaches_an_entry_of_a_list_by_its_number(tmp_path):
    """As sweeps and draws name it: push.0.force is the force of the first push; the file's other numbers stay."""
    file = tmp_path / "two.toml"
    file.write_text(
        'extends = "demo/push"\n[[push]]\nat = 1.0\nduration = 0.2\nforce = [10.0, 0.0]\n'
        "[[push]]\nat = 2.0\nduration = 0.1\nforce = [20.0, 5.0]\n", encoding="utf-8"
    )  # fmt: skip
    one, two = read_scenario(str(file), ["push.1.force=[300.0,0.0]", "push.1.at=3", "push.0.force.1=7"]).push
    assert (one.at, one.duration, one.force) == (1.0, 0.2, (10.0, 7.0))
    assert (two.at, two.duration, two.force) == (3.0, 0.1, (300.0, 0.0))
    with pytest.raises(InputError, match=re.escape("--set push.2: expected an entry of push, which has 2")):
        read_scenario(str(file), ["push.2.at=1"])
    with pytest.raises(InputError, match="forse"):
        read_scenario(str(file), ["push.0.forse=[1.0,0.0]"])
    with pytest.raises(InputError, match="push"):
        read_scenario("level_normal", ["push.0.at=1"])
    for odd in ('push."\u00b2".at=1', f"push.{'9' * 5000}.at=1", "push.0.force.x=1", "push.x.at=1"):
        with pytest.raises(InputError, match="push"):
            read_scenario(str(file), [odd])
