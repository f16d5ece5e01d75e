"""What a search varies: a gait keeps its structure, keys their range, and mistakes are named."""

from __future__ import annotations

import numpy as np
import pytest

from biped.base.errors import InputError
from biped.scenario.gains import GAINS
from biped.scenario.reading import read_scenario
from biped.studies.tune.evaluate import Study
from biped.studies.tune.search_space import SearchSpace
from tests.studies.tune.small import study_of


def test_space_keeps_structure(scenario_file):
    study = study_of(scenario_file)
    space = SearchSpace(study.scenario, study.gains)
    names = {axis.name for axis in space.axes}
    assert not names & {"k_d2.3", "k_d3.2"}  # zero springs stay zero
    assert "theta_l.3" not in names  # a thigh angle without a spring means nothing
    assert space.candidate(np.zeros(len(space.axes))).gains == study.gains
    rng = np.random.default_rng(1)
    for _ in range(20):
        gains = space.candidate(rng.normal(0.0, 10.0, len(space.axes))).gains
        for name in GAINS:
            for new, old in zip(np.atleast_1d(getattr(gains, name)), np.atleast_1d(getattr(study.gains, name)),
                                strict=True):  # fmt: skip
                if name.startswith("theta"):
                    assert abs(new - old) <= 20.0 + 1e-2
                elif old == 0.0:
                    assert new == 0.0
                else:
                    assert 0.2 * 0.999 <= new / old <= 5.0 * 1.001


def test_keys_vary_within_their_range(scenario_file):
    change = 'tune.keys={"actuation.release_force"={min=50.0,max=400.0,scale="log"},"sensing.ahead"={min=0.0,max=0.2}}'
    study = study_of(scenario_file, change, 'tune.gains=["theta_b"]')
    space = SearchSpace(study.scenario, study.gains)
    assert [axis.name for axis in space.axes] == ["theta_b", "actuation.release_force", "sensing.ahead"]
    assert dict(space.candidate([0.0, 0.0, 0.0]).keys) == {"actuation.release_force": 150.0, "sensing.ahead": 0.1}
    assert dict(space.candidate([0.0, -9.0, 9.0]).keys) == {"actuation.release_force": 50.0, "sensing.ahead": 0.2}


def test_a_key_outside_its_range_begins_where_it_is_told_to(scenario_file):
    for own, begun in ((0.1, 0.3), (0.25, 0.25)):
        change = 'tune.keys={"sensing.ahead"={min=0.2,max=1.0,start=0.3}}'
        study = study_of(scenario_file, 'tune.gains=["k_d1"]', change, f"sensing.ahead={own}")
        space = SearchSpace(study.scenario, study.gains)
        assert dict(space.candidate([0.0, 0.0]).keys) == {"sensing.ahead": begun}
        assert dict(space.candidate([0.0, -9.0]).keys) == {"sensing.ahead": 0.2}


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ('tune.gains=["k_d5"]', ["tune.gains", "k_d5", "k_d"]),
        ('tune.gains=["k_d2.7"]', ["tune.gains", "k_d2.7"]),
        ('tune.gains=["k_d3.2"]', ["zero gains stay zero"]),
        ('tune.keys={"sensing.ahed"={min=0.0,max=1.0}}', ["sensing.ahed", "did you mean 'ahead'"]),
        ('tune.keys={"actuation.mode"={min=0.0,max=1.0}}', ["actuation.mode", "one number"]),
        ('tune.keys={"sensing.ahead"={min=0.2,max=1.0}}', ["sensing.ahead", "0.1"]),
        ('tune.keys={"sensing.ahead"={min=0.2,max=1.0,start=0.1}}', ["sensing.ahead", "start", "0.1"]),
        ('tune.keys={"sensing.ahead"={min=0.0,max=1.0,scale="log"}}', ["sensing.ahead", "log"]),
        ("tune.conditions.level.set.ground.slop=1.0", ["tune.conditions.level.set", "slop", "slope"]),
        ("tune.conditions.level.set.gains.k_d1=1.0", ["tune.conditions.level.set", "gains"]),
    ],
)
def test_mistakes_are_named(scenario_file, change, words):
    def space():
        study = study_of(scenario_file, change)
        return SearchSpace(study.scenario, study.gains)

    with pytest.raises(InputError) as error:
        space()
    for word in words:
        assert word in str(error.value)


def test_scenario_without_tune_or_conditions(tmp_path):
    with pytest.raises(InputError, match="tune: missing"):
        Study(read_scenario("level_fast"))
    (tmp_path / "none.toml").write_text("[tune]\ngenerations = 2\n", encoding="utf-8")
    with pytest.raises(InputError, match="conditions: missing"):
        Study(read_scenario(str(tmp_path / "none.toml")))


def test_tuning_scenarios_are_sound():
    from biped.base.files import names

    tuning = [name for name in names("scenarios") if name.startswith("tune/")]
    assert tuning
    for name in tuning:
        study = Study(read_scenario(name))
        assert SearchSpace(study.scenario, study.gains).axes


def test_a_pace_varies_in_the_plane_but_for_its_side(scenario_file):
    study = study_of(scenario_file, "gains.pace={speed=0.7,slope=0.0,side=0.0,swing=0.1,stance=0.1}")
    names = {axis.name for axis in SearchSpace(study.scenario, study.gains).axes}
    assert {name for name in names if name.startswith("pace")} == {
        f"pace.{one}" for one in ("speed", "slope", "swing", "stance")
    }
    pace = "speed=0.7,slope=0.0,side=0.0,swing=0.1,stance=0.1,lean=1.3,knee=10.0,ankle=75.0"
    study = study_of(scenario_file, f"gains.pace={{{pace}}}")
    space = SearchSpace(study.scenario, study.gains)
    axes = {axis.name: axis for axis in space.axes}
    lean, knee, ankle = (axes[f"pace.{one}"] for one in ("lean", "knee", "ankle"))
    assert (lean.start, lean.log) == (1.3, False)
    assert (knee.start, knee.log) == (10.0, True)  # which has a sign
    assert (ankle.start, ankle.log) == (75.0, True)


def test_what_keeps_legs_apart_varies_where_a_gait_has_it():
    names = [f"frontal.placement.{name}" for name in ("apart", "crossing", "shorten", "push")]
    study = Study(read_scenario("tune/spatial_sturdy"))
    assert not set(names) & {axis.name for axis in SearchSpace(study.scenario, study.gains).axes}
    kept = "gains.frontal.placement={apart=0.15,crossing=0.0,shorten=0.5,push=0.02}"
    study = Study(read_scenario("tune/spatial_sturdy", [kept]))
    axes = {axis.name: axis for axis in SearchSpace(study.scenario, study.gains).axes}
    expected = [(0.15, True), (0.0, False), (0.5, True), (0.02, True)]
    assert [(axes[name].start, axes[name].log) for name in names] == expected
