"""`law = "thesis"` is the thesis's law on every robot, and `spatial` a name that it had."""

from __future__ import annotations

from pathlib import Path

import pytest

from biped.base.errors import InputError
from biped.base.files import folder
from biped.scenario.reading import from_text, read_scenario, to_toml
from biped.studies.diff.changes import settings, side

NAMES = pytest.mark.parametrize("law", ["thesis", "spatial"])


@NAMES
@pytest.mark.parametrize("name", ["level_normal", "upright/own", "robot/own", "calm/own"])
def test_in_the_plane_it_is_the_law_of_scenarios_that_name_none(name, law):
    plain = read_scenario(name)
    assert plain.law is None
    assert to_toml(read_scenario(name, [f"law={law}"])) == to_toml(plain)


def test_a_file_that_names_it_keeps_the_thesis_numbers(tmp_path):
    (tmp_path / "own.toml").write_text('extends = "level_normal"\nlaw = "thesis"\n[thesis]\nspeed = 0.5\n')
    assert read_scenario(str(tmp_path / "own.toml")).thesis["speed"] == 0.5


@NAMES
def test_a_description_of_a_planar_robot_may_name_it(tmp_path, law):
    models = folder("models")
    (tmp_path / "mine.xml").write_text((models / "human.xml").read_text())
    (tmp_path / "mine.toml").write_text((models / "human.toml").read_text() + f'\n[scenario]\nlaw = "{law}"\n')
    assert read_scenario("level_normal", [f'model="{tmp_path / "mine.xml"}"']).law is None


@NAMES
@pytest.mark.parametrize("name", ["spatial/own", "any/h1_walk"])
def test_in_space_the_two_names_are_one_law(name, law):
    plain = read_scenario(name)
    assert plain.law == "thesis"
    assert read_scenario(name, [f"law={law}"]) == plain
    assert from_text(to_toml(plain).replace('law = "thesis"', f'law = "{law}"'), Path("kept.toml")) == plain


@NAMES
def test_a_model_with_a_free_base_needs_no_description(tmp_path, law):
    """Though it has the names of the human's parts, as a variant in the plane has, and its scenario's name."""
    (tmp_path / "mine.xml").write_text((folder("models") / "human3d.xml").read_text())
    (tmp_path / "mine.toml").write_text(
        f'model = "mine.xml"\nlaw = "{law}"\ncontroller = "human3d"\nstart.posture = "heel_toe"\n'
    )
    s = read_scenario(str(tmp_path / "mine.toml"))
    assert s.law == "thesis"
    assert s.robot is not None


def test_results_of_the_two_names_do_not_differ(tmp_path):
    text = to_toml(read_scenario("spatial/own"))
    sides = []
    for name in ("thesis", "spatial"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "scenario.toml").write_text(text.replace('law = "thesis"', f'law = "{name}"'))
        sides.append(side(name, tmp_path / name, {}))
    assert settings(*sides) == []


def test_a_misspelled_law_is_told_the_nearest():
    with pytest.raises(InputError, match=r"law: expected .* one of thesis, stand, got 'thesys'; did you mean 'thesis'"):
        read_scenario("any/h1_walk", ["law=thesys"])
