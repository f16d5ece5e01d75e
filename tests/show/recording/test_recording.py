"""Recordings as files: sound, small, the same for the same run; what they hold is in test_scene and test_series."""

import dataclasses
import re

import numpy as np
import pytest
from rerun.chunk import RrdReader

from biped.base.errors import InputError
from biped.show.recording import record
from biped.show.recording.series import curves
from tests.show.recording.pushed import ROOT
from tests.show.recordings import contents_of, named_in, read, rerun


def test_the_file_is_sound_and_a_broken_one_is_told(path, tmp_path):
    sound = rerun("verify", path)
    assert sound.returncode == 0, sound.stderr
    cut = tmp_path / "cut.rrd"
    cut.write_bytes(path.read_bytes()[:20_000])
    assert rerun("verify", cut).returncode != 0


def test_it_is_small(path, run):
    assert path.stat().st_size < 320e3 * run.trajectory.time[-1] + 400e3  # 3.6 MB for 10 s


def test_the_same_run_gives_the_same_content_and_another_does_not(path, run, tmp_path):
    again, other = tmp_path / "again.rrd", tmp_path / "other.rrd"
    record(again, [run], title="a push on a slope")
    same = rerun("compare", "--unordered", path, again)
    assert same.returncode == 0, same.stderr
    assert ids(path) == ids(again)
    log = run.trajectory.log.copy()
    log[500, 1] += 1e-6
    changed = run._replace(trajectory=dataclasses.replace(run.trajectory, log=log))
    record(other, [changed], title="a push on a slope")
    assert ids(other) != ids(path)


def ids(path):
    return [store.recording_id for store in RrdReader(str(path)).recordings()]


def test_a_run_that_diverges_is_recorded_as_far_as_it_is_finite(run, tmp_path):
    log = run.trajectory.log[:300].copy()
    log[-1, 1:19] = np.nan
    broken = dataclasses.replace(run.trajectory, log=log, end="diverged", cause="a coordinate stopped being finite")
    path = tmp_path / "nan.rrd"
    record(path, [run._replace(trajectory=broken)], title="nan")
    time, velocity = read(path, f"{ROOT}/series/velocity")[0]["Scalars:scalars"]
    assert time[-1] == 0.298e9
    assert np.isfinite(velocity).all()
    assert not read(path, f"{ROOT}/scene/push_0")[0]  # the push never came


def test_the_view_shows_what_is_logged(path, run):
    """Every entity that the blueprint names is in the file: else a view would be empty without a word."""
    logged = {chunk.entity_path for chunk in RrdReader(str(path)).stream().to_chunks()}
    from biped.show.recording import layout
    from biped.show.recording.series import place

    placed = place([run])
    assert contents_of(layout(placed).root_container)
    named = named_in(layout(placed))
    named = {name.removesuffix("/**") for name in named} - {"/", "$origin"}
    assert len(named) >= len(curves(placed[0])) + 4
    for name in named:
        assert any(entity == name or entity.startswith(name + "/") for entity in logged), name


def test_a_file_that_cannot_be_written_is_an_error_in_words(run, tmp_path):
    (tmp_path / "file").write_text("")
    for path in (tmp_path / "nowhere" / "run.rrd", tmp_path / "file" / "run.rrd"):
        with pytest.raises(InputError, match=re.escape(f"{path}: cannot be written")):
            record(path, [run], title="nowhere")
    with pytest.raises(InputError, match=re.escape(f"{tmp_path}: is there already and is not a recording")):
        record(tmp_path, [run], title="nowhere")
