"""The row of the atlas: its tests with as many runs as each needs, and what is kept of growth and sensitivity."""

from __future__ import annotations

import pytest

from biped.base.errors import InputError, RunError
from biped.cli.main import main
from biped.studies.standard import atlas, trials_of


@pytest.fixture
def quick(monkeypatch):
    """Two tests alone, and studies of walks that are counted."""
    asked = []

    class Found:
        def as_dict(self):
            return {"kinds": [{"norm": 1.0}], "sizes": [{"factor": 2.0}]}

    def study(name, changes, jobs):
        asked.append((name, tuple(changes)))
        if 'controller="slow"' in changes:
            raise RunError("too short")
        return Found()

    monkeypatch.setattr(atlas, "SEARCHED", ("level",))
    monkeypatch.setattr(atlas, "COUNTED", ("random_push",))
    monkeypatch.setattr(atlas, "sensitivity", study)
    monkeypatch.setattr(atlas, "growth", study)
    return asked


def test_one_call_makes_the_row_and_goes_on_where_it_was(quick, tmp_path, monkeypatch):
    monkeypatch.setattr(atlas, "RUNS", "randomise.runs=1")
    changes = ["duration=1.0"]
    found = atlas.atlas(["calm", "slow"], changes, 1, tmp_path)
    runs = {(one["test"], one["gait"]): one["tried"][0]["runs"] for one in found["standings"]}
    assert runs == {("standard/level", "calm"): 1, ("standard/level", "slow"): 1,
                    ("standard/random_push", "calm"): 100, ("standard/random_push", "slow"): 100}  # fmt: skip
    assert found["norms"] == {"calm": [{"norm": 1.0}], "slow": []}
    assert found["growth"] == {"calm": [{"factor": 2.0}], "slow": []}
    assert len(quick) == 4
    assert all("duration=1.0" in asked for _, asked in quick)
    assert atlas.atlas(["calm", "slow"], changes, 1, tmp_path) == found
    assert len(quick) == 4, "what is kept is not made again"


def test_its_tests_are_there():
    names = {trial.name.rpartition("/")[2] for trial in trials_of([*atlas.SEARCHED, *atlas.COUNTED])}
    assert names == {*atlas.SEARCHED, *atlas.COUNTED}


def test_other_tests_are_refused(capsys):
    assert main(["standard", "calm", "--atlas", "--test", "level"]) == 2
    assert "--atlas: expected neither --test nor --engines" in capsys.readouterr().err
    with pytest.raises(InputError):
        atlas.atlas(["calmer"], [], 1, None)
