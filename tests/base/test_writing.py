"""Files are there whole or not at all."""

from __future__ import annotations

from pathlib import Path

import pytest

from biped.base.writing import reason, write_text, written


def test_a_file_is_replaced_only_when_its_successor_is_whole(tmp_path):
    path = tmp_path / "a.txt"
    write_text(path, "before")
    with pytest.raises(UnicodeEncodeError), written(path) as part:
        part.write_text("half\udc80", encoding="utf-8")
    assert path.read_text() == "before"
    write_text(path, "after")
    assert path.read_text() == "after"
    assert list(tmp_path.iterdir()) == [path]


def test_two_that_write_the_same_file_at_once_do_not_touch_each_others(tmp_path):
    path = tmp_path / "a.txt"
    with written(path, ".first") as first:
        first.write_text("first")
        with written(path, ".second") as second:
            second.write_text("se")
        assert path.read_text() == "se"
    assert path.read_text() == "first"
    assert list(tmp_path.iterdir()) == [path]


def test_it_is_on_disk_before_it_has_its_name(tmp_path, monkeypatch):
    path, order = tmp_path / "a.txt", []
    monkeypatch.setattr("os.fsync", lambda _: order.append("synced"))
    replace = Path.replace
    monkeypatch.setattr(Path, "replace", lambda self, other: order.append("renamed") or replace(self, other))
    write_text(path, "x")
    assert order == ["synced", "renamed"]


def test_reasons_in_words():
    assert reason(OSError(28, "No space left on device")) == "no space left on device"
    assert reason(OSError("odd")) == "odd"
    assert reason(ValueError("embedded null byte")) == "embedded null byte"
