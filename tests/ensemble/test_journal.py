"""Journals: what is damaged is left out and done again, what belongs elsewhere is refused."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from pathlib import Path

import pytest

from biped.base.errors import InputError
from biped.cli.main import main
from biped.ensemble.journal import Journal, here
from tests.cases import ENSEMBLE, contents, write

ABOUT = {"scenario": "abc", "mujoco": "4.0.0"}
RECORDS = [
    {"index": i, "seed": 10 + i, "speed": 0.1 * i, "cause": f"at\u2028{i}\u0085 s\x0b", "values": {"a": [1.5, "ü"]}}
    for i in range(5)
]

Damage = Callable[[bytes], bytes]


def line(change: Callable[[bytes], bytes], number: int = 3) -> Damage:
    """Damage of one line, with its line feed; line 0 is the head."""

    def damage(data: bytes) -> bytes:
        lines = data.splitlines(keepends=True)
        lines[number] = change(lines[number])
        return b"".join(lines)

    return damage


DAMAGES: dict[str, Damage] = {
    "garbage": line(lambda _: bytes(range(1, 10)) + bytes(range(11, 256)) + b"\n"),
    "NUL": line(lambda text: b"\0" * len(text)),
    "NUL and a line feed": line(lambda text: b"\0" * 512 + b"\n"),
    "not UTF-8": line(lambda text: text.replace(b'"cause": "', b'"cause": "\xff\xfe')),
    "glued": line(lambda text: text.removesuffix(b"\n")),
    "cut": line(lambda text: text[: len(text) // 2] + b"\n"),
    "cut and glued": line(lambda text: text[: len(text) // 2]),
    "beginning gone": line(lambda text: text[len(text) // 2 :]),
    "empty": line(lambda _: b"\n"),
    "line separator in a string": line(lambda text: text.replace(b'"cause": "', '"cause": "\u2028'.encode())),
    "wrong type": line(lambda text: text.replace(b'"index": 2', b'"index": "two"')),
    "key gone": line(lambda text: text.replace(b'"index": 2, ', b"")),
    "altered number": line(lambda text: text.replace(b'"seed": ', b'"seed": 1')),
    "null": line(lambda _: b"null\n"),
    "a list": line(lambda text: b"[" + text.strip() + b"]\n"),
    "deep": line(lambda _: b"[" * 100_000 + b"\n"),
    "huge integer": line(lambda _: b'{"index": ' + b"9" * 5000 + b"}\n"),
    "carriage return": line(lambda text: text.replace(b"\n", b"\r\n")),
    "sum gone": line(lambda text: text[: text.rindex(b', "sum"')] + b"}\n"),
    "head gone": line(lambda _: b"", 0),
    "head garbled": line(lambda text: b"\xef\xbb\xbf" + text[5:], 0),
    "torn at the end": lambda data: data[:-20],
    "only a beginning": lambda data: data[:7],
}
"""What can happen to a file, and what people do to it."""


@pytest.fixture
def journal(tmp_path):
    one = Journal(tmp_path / "runs.jsonl", ABOUT)
    for record in RECORDS:
        one.note(record)
    return one


def test_there_are_enough_kinds():
    assert len(DAMAGES) >= 16


def test_records_come_back(journal):
    assert journal.read() == (RECORDS, [])
    assert Journal(journal.path.with_name("none"), ABOUT).read() == ([], [])


def test_what_is_noted_is_what_is_read(journal):
    back = journal.note({"index": 5, "inf": math.inf, "nan": math.nan, "tuple": (1, 2)})
    assert math.isnan(back["inf"])
    assert math.isnan(back["nan"])
    assert back["tuple"] == [1, 2]
    assert repr(journal.read()[0][-1] | {"sum": 0}) == repr(back | {"sum": 0})


@pytest.mark.parametrize("kind", DAMAGES)
def test_damage_costs_what_was_damaged_and_is_mended(kind, journal):
    whole = journal.path.read_bytes()
    journal.path.write_bytes(DAMAGES[kind](whole))
    assert journal.path.read_bytes() != whole, "nothing was damaged"
    records, notes = journal.read()
    assert all(record in RECORDS for record in records)
    assert len(records) >= (0 if kind == "only a beginning" else 3)
    lost = [record for record in RECORDS if record not in records]
    if lost:
        assert len(notes) == 1
        assert "left out, and the work done again" in notes[0]
    for record in lost:
        journal.note(record)
    assert sorted(journal.read()[0], key=lambda record: record["index"]) == RECORDS
    assert journal.read()[1] == [], "the damage is gone"


def test_a_last_line_without_its_end_is_not_glued_to_the_next(journal):
    journal.path.write_bytes(journal.path.read_bytes()[:-1])
    assert journal.read() == (RECORDS, [])
    journal.note({"index": 9})
    assert journal.read() == ([*RECORDS, {"index": 9}], [])


@pytest.mark.parametrize(
    ("about", "says"),
    [
        (ABOUT | {"mujoco": "4.0.1"}, "mujoco 4.0.0; here is mujoco 4.0.1"),
        (ABOUT | {"scenario": "xyz"}, "scenario abc; here is scenario xyz"),
        (ABOUT | {"numpy": "2.4"}, "numpy unknown; here is numpy 2.4"),
        ({"scenario": "abc"}, "mujoco 4.0.0; here is mujoco unknown"),
    ],
)
def test_a_journal_of_something_else_is_refused(about, says, journal):
    before = journal.path.read_bytes()
    with pytest.raises(InputError, match="not mixed") as error:
        Journal(journal.path, about).read()
    assert says in str(error.value)
    assert journal.path.read_bytes() == before


def test_rows_of_another_journal_do_not_count(journal, tmp_path):
    other = Journal(tmp_path / "other.jsonl", ABOUT | {"scenario": "xyz"})
    other.note({"index": 7})
    journal.path.write_bytes(journal.path.read_bytes() + other.path.read_bytes())
    records, notes = journal.read()
    assert records == RECORDS
    assert "2 lines (7, 8)" in notes[0]


def test_a_journal_from_before_journals_said_what_they_are_of(journal):
    journal.path.write_text("".join(json.dumps(record) + "\n" for record in RECORDS), encoding="utf-8")
    with pytest.raises(InputError, match="did not note what its runs were made with"):
        journal.read()


@pytest.fixture
def again(undisturbed, tmp_path, monkeypatch):
    """That campaign in a folder of the test's own, without what it came to."""
    monkeypatch.chdir(tmp_path)
    write("e.toml", ENSEMBLE)
    Path("x").mkdir()
    for name in ("scenario.toml", "runs.jsonl"):
        Path("x", name).write_bytes(undisturbed[name])
    return Path("x/runs.jsonl")


@pytest.mark.parametrize("kind", DAMAGES)
def test_a_campaign_with_a_damaged_journal_ends_with_the_same_bytes(kind, again, undisturbed, capsys):
    again.write_bytes(DAMAGES[kind](again.read_bytes()))
    assert main(["run", "e.toml", "--jobs", "1", "--out", "x"]) == 0
    errors = capsys.readouterr().err
    assert errors == "" or (errors.startswith("biped: x/runs.jsonl: ") and errors.count("\n") == 1)
    for name in ("result.json", "runs.parquet", "scenario.toml"):
        assert contents("x")[name] == undisturbed[name]


def test_another_version_does_not_continue_a_campaign(again, monkeypatch, capsys):
    there = here() | {"numpy": "1.0"}
    monkeypatch.setattr("biped.ensemble.journal.here", lambda: there)
    before = contents("x")
    assert main(["run", "e.toml", "--jobs", "1", "--out", "x"]) == 2
    error = capsys.readouterr().err
    assert "here is numpy 1.0" in error
    assert error.count("\n") == 1
    assert contents("x") == before


def test_another_model_of_the_same_name_does_not_continue_a_campaign(tmp_path, monkeypatch, capsys):
    from biped.base.files import folder

    monkeypatch.chdir(tmp_path)
    human = (folder("models") / "human.xml").read_text(encoding="utf-8")
    write("m.xml", human)
    write("e.toml", 'model = "m.xml"\n' + ENSEMBLE)
    assert main(["run", "e.toml", "--jobs", "1", "--out", "x"]) == 0
    write("m.xml", human.replace("50.85", "60.85"))
    assert main(["run", "e.toml", "--jobs", "1", "--out", "x"]) == 2
    assert "here is scenario" in capsys.readouterr().err


def test_a_row_of_another_seed_is_made_again(again, undisturbed, monkeypatch):
    """Even one with a sum that fits."""
    lines = again.read_bytes().splitlines()
    about = {name: value for name, value in json.loads(lines[0]).items() if name != "journal"}
    again.unlink()
    journal = Journal(again, about)
    for number, text in enumerate(lines[1:]):
        record = json.loads(text)
        del record["sum"]
        journal.note(record | ({"seed": 1, "speed": 9.9} if number == 2 else {}))
    assert main(["run", "e.toml", "--jobs", "1", "--out", "x"]) == 0
    assert contents("x")["result.json"] == undisturbed["result.json"]
