"""The page of a difference says what the difference says; the run to look at walks on it twice."""

from __future__ import annotations

import json
import re
from html import unescape
from pathlib import Path

import pytest

from biped.base.errors import InputError
from biped.cli.main import main
from biped.show.page import kind_of, write_page
from tests.cases import command
from tests.show.page.test_page import Read

SHORT = ["--set", "duration=3.0", "--set", "window={start=1.0,end=3.0}", "--set", "randomise.runs=6",
         "--set", "start.jitter=0.002"]  # fmt: skip


@pytest.fixture(scope="module")
def compared(tmp_path_factory):
    """Two gaits compared on a short walk, with a page."""
    where = tmp_path_factory.mktemp("diff")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(where)
        argv = ["diff", "robust", "normal", "--scenario", "level_normal", *SHORT, "--jobs", "1"]
        assert main([*argv, "--out", "d", "--html", "page.html"]) in (0, 1)
    return where


@pytest.fixture
def words(compared, monkeypatch):
    monkeypatch.chdir(compared)
    return unescape(" ".join(" ".join(Read(Path("page.html").read_text(encoding="utf-8")).words).split()))


def test_every_number_of_the_difference(words):
    found = json.loads(Path("d/diff.json").read_text(encoding="utf-8"))
    assert "robust → normal" in words
    for name in found["worse"]:
        assert name.replace("_", " ") in words
    assert f"{found['pairs']} pairs of one seed" in words
    for name, one in found["metrics"].items():
        if one["pairs"]:
            assert name in words, name
    assert found["worst"]["again"] in words
    for one in found["settings"][:12]:
        assert one["key"] in words


def test_the_run_to_look_at_walks_twice(words):
    page = Path("page.html").read_text(encoding="utf-8")
    assert len(re.findall("data-walk=", page)) == 2
    assert "second: normal" in words
    assert "first: robust" in words


def test_the_changes_are_drawn_with_their_intervals(words):
    found = json.loads(Path("d/diff.json").read_text(encoding="utf-8"))
    said = [
        one for one in found["metrics"].values() if one["verdict"] != "cannot say" and one["pairs"] and one["first"]
    ]
    assert said
    page = Path("page.html").read_text(encoding="utf-8")
    titles = re.findall(r"<title>([^<]*, (?:better|worse|same|changed))</title>", page)
    assert len(titles) == len(said)


def test_the_folder_is_a_result_that_report_shows(compared, monkeypatch):
    monkeypatch.chdir(compared)
    assert kind_of(Path("d")) == "diff"
    write_page([Path("d")], Path("again.html"), "What changed")
    assert Path("again.html").read_bytes() == Path("page.html").read_bytes()


def test_two_folders_without_a_folder_of_their_own(compared, monkeypatch, capsys):
    monkeypatch.chdir(compared)
    code, found = command(capsys, "diff", "d/first", "d/first/../second", "--html", "two.html")
    assert code in (0, 1)
    assert found["pairs"] == 6
    assert "data-walk=" in Path("two.html").read_text(encoding="utf-8")


def test_names_from_elsewhere_are_text(compared, monkeypatch, tmp_path):
    monkeypatch.chdir(compared)
    found = json.loads(Path("d/diff.json").read_text(encoding="utf-8"))
    found["second"]["name"] = "<script>alert(1)</script>"
    found["settings"] = [{"key": "<b>", "first": "<i>", "second": None}]
    (tmp_path / "diff.json").write_text(json.dumps(found), encoding="utf-8")
    write_page([tmp_path], tmp_path / "page.html", "What changed")
    page = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert "<script>alert" not in page
    assert "&lt;b&gt;" in page


@pytest.mark.parametrize("text", ["{", '{"passed": 3}', "[]"])
def test_what_is_no_difference(text, tmp_path):
    (tmp_path / "diff.json").write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match="what biped diff writes"):
        write_page([tmp_path], tmp_path / "page.html", "What changed")


def test_a_page_that_cannot_be_written(compared, monkeypatch, capsys):
    monkeypatch.chdir(compared)
    assert main(["diff", "d/first", "d/second", "--html", "no/where.html"]) == 2
    assert "--html no/where.html: cannot be written" in capsys.readouterr().err
