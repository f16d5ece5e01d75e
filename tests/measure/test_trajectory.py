"""What a run leaves behind survives saving."""

from __future__ import annotations

import numpy as np
import pytest

from biped.base.errors import InputError
from biped.measure.columns import COLUMNS, WIDTH
from biped.measure.stored import load
from tests.runs import made


def test_columns_fill_the_log_without_overlap():
    taken = np.zeros(WIDTH, int)
    for first, shape in COLUMNS.values():
        taken[first : first + int(np.prod(shape, dtype=int))] += 1
    np.testing.assert_array_equal(taken, 1)


@pytest.mark.parametrize("name", ["pushed", "generalized"])
def test_round_trip(name, tmp_path):
    t = made(name)
    t.save(tmp_path / "t.npz")
    back = load(tmp_path / "t.npz")
    assert back.log.tobytes() == t.log.tobytes()
    for field in ("tick", "slope", "generalized", "pushes", "end", "cause", "warnings"):
        assert getattr(back, field) == getattr(t, field)
    for mine, theirs in zip(back.tree, t.tree, strict=True):
        np.testing.assert_array_equal(mine, theirs)


def test_same_run_same_file(tmp_path):
    made("pushed").save(tmp_path / "a.npz")
    load(tmp_path / "a.npz").save(tmp_path / "b.npz")
    assert (tmp_path / "a.npz").read_bytes() == (tmp_path / "b.npz").read_bytes()


def test_file_is_plain_numpy_with_named_arrays(tmp_path):
    t = made("pushed")
    t.save(tmp_path / "t.npz")
    with np.load(tmp_path / "t.npz", allow_pickle=False) as file:
        assert set(file) == {"about", *COLUMNS}
        np.testing.assert_array_equal(file["force"], t.force[..., [0, 2]])


def test_last_seconds():
    t = made("pushed")
    end = t.last(0.25)
    assert len(end) == 250
    np.testing.assert_array_equal(end.log, t.log[-250:])
    assert len(t.last(1e6)) == len(t)


@pytest.mark.parametrize("content", [b"", b"text", b"PK\x03\x04"])
def test_what_is_no_trajectory(content, tmp_path):
    (tmp_path / "t.npz").write_bytes(content)
    with pytest.raises(InputError, match=r"t\.npz: not a trajectory"):
        load(tmp_path / "t.npz")


def test_a_missing_file(tmp_path):
    with pytest.raises(InputError, match=r"t\.npz: not a trajectory"):
        load(tmp_path / "t.npz")
