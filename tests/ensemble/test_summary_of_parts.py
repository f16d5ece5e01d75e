"""What is told and shown of a campaign that is kept in parts: from columns, and from groups of rows."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from biped.base.writing import dumps
from biped.cli.main import main
from biped.ensemble.columns import StoredRows, stored_rows
from biped.ensemble.rows import Row, records, schema_of, table
from biped.scenario.keys import Scenario
from biped.show.replay import of_numbers
from biped.show.results import signals_of
from biped.studies import run as running
from tests.cases import ENSEMBLE, write


def test_signals_of_rows_come_back_and_need_no_names_beforehand():
    ended = {"fell": False, "end": "completed", "cause": "", "walked": True, "stood": 0, "time": 1.0}
    common = {"seed": 1, "values": {}, **ended}
    signals = {"error": {"mean": 0.5, "min": 0.0, "max": 1.0}, "b": {"mean": 2.0, "min": 2.0, "max": 2.0}}
    rows = [Row(index=0, **common), Row(index=1, signals=signals, **common)]
    schema = schema_of(Scenario())
    back = list(records(table(rows, schema)))
    assert "signals" not in back[0]
    assert back[1]["signals"] == signals
    assert table(rows[:1], schema).schema == table(rows[1:], schema).schema


def test_the_summary_of_a_large_campaign_reads_columns_and_no_rows(monkeypatch, tmp_path, capsys):
    """What is printed of a campaign grows with its runs by a few columns, not by a record of every run."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(running, "LARGE", 4)
    write("e.toml", ENSEMBLE)

    def refused(*_):
        raise AssertionError("a row was read")

    monkeypatch.setattr(StoredRows, "__iter__", refused)
    assert main(["run", "e.toml", "--out", "x", "--jobs", "1"]) in (0, 1)
    assert "walked" in capsys.readouterr().out


def test_signals_are_told_alike_of_rows_and_of_columns():
    one = {"error": {"mean": 0.5, "min": 0.0, "max": 1.0}}
    two = {"error": {"mean": 1.5, "min": -1.0, "max": 2.0}, "b": {"mean": 2.0, "min": 2.0, "max": 2.0}}
    nothing = {"error": {"mean": None, "min": None, "max": None}}

    class Stored(StoredRows):
        def __init__(self, rows):
            super().__init__([])
            self.rows = rows

        def batches(self, names):
            yield {name: np.array([row[name] for row in self.rows], dtype=object) for name in names}

    told = {"error": {"mean": 1.0, "min": -1.0, "max": 2.0}, "b": {"mean": 2.0, "min": 2.0, "max": 2.0}}
    assert signals_of([{}, {"signals": one}, {"signals": two}, {"signals": nothing}]) == told
    assert signals_of(Stored([{"signals": None}, {"signals": dumps(one)}, {"signals": dumps(two)}])) == told
    assert signals_of(Stored([{"signals": np.nan}])) == {}


def test_some_rows_of_many_are_read_a_group_at_a_time(monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(running, "LARGE", 4)
    write("e.toml", ENSEMBLE)
    assert main(["run", "e.toml", "--out", "x", "--jobs", "1"]) in (0, 1)
    rows = stored_rows(Path("x"), 6)
    assert dumps(rows.of({5, 0, 3, 99})) == dumps([rows[0], rows[3], rows[5]])
    monkeypatch.setattr(StoredRows, "__getitem__", None)
    assert sorted(of_numbers(rows, [1, 4])) == [1, 4]
