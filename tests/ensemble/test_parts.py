"""Rows in files: the same bytes whoever made them in whatever pieces, nothing finished lost, nothing silently wrong."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path

import msgspec
import pytest

from biped.base.errors import InputError
from biped.cli.main import main
from biped.ensemble import chunks, parts
from biped.ensemble.campaign import run_one
from biped.ensemble.chunks import Chunks
from biped.ensemble.columns import stored_rows
from biped.ensemble.parts import About, Chunk, PartFile, PartRange, cover, missing
from biped.ensemble.plan import Plan
from biped.scenario.reading import read_scenario
from tests.cases import contents
from tests.ensemble.campaigns import run

pytestmark = pytest.mark.usefixtures("folder")


DAMAGE = {
    "cut": lambda data: data[: len(data) // 2],
    "nothing": lambda data: b"",
    "garbage": lambda data: b"\0" * len(data),
    "half of it": lambda data: data[:1000] + bytes(len(data) // 2) + data[1000 + len(data) // 2 :],
}


def test_no_bit_of_a_file_changes_unseen():
    plan = Plan(read_scenario("e.toml"))
    parts.commit_to(Path(), Chunks(plan).of([run_one(plan, index)[1] for index in range(3)]))
    (path,) = Path().glob("*.parquet")
    data = path.read_bytes()
    assert parts.sound(parts.read(path))
    for at in range(0, len(data), 97):
        path.write_bytes(data[:at] + bytes([data[at] ^ 4]) + data[at + 1 :])
        with suppress(InputError):
            assert not parts.sound(parts.read(path))


@pytest.mark.parametrize("kind", DAMAGE)
def test_a_damaged_file_is_set_aside_and_its_runs_are_made_again(kind, undisturbed, capsys):
    for number in (1, 2):
        run("x", "--jobs", "1", "--shard", f"{number}/3")
    path = sorted(Path("x/parts").glob("*.parquet"))[0]
    path.write_bytes(DAMAGE[kind](path.read_bytes()))
    capsys.readouterr()
    assert run("x", "--jobs", "1", "--shard", "3/3")
    assert "set aside" in capsys.readouterr().err
    assert run("x", "--jobs", "1")["result.json"] == undisturbed["result.json"]
    assert len(list(Path("x/parts").glob("*.damaged"))) == 1


def test_files_of_something_else_are_refused(capsys, monkeypatch):
    run("x", "--jobs", "1", "--shard", "1/2")
    monkeypatch.setattr("biped.ensemble.journal.digest", lambda *where: "another")
    before = contents("x")
    assert main(["run", "e.toml", "--jobs", "1", "--out", "x"]) == 2
    assert "its runs were made with kernels " in capsys.readouterr().err
    assert contents("x") == before


def test_another_kind_of_machine_is_reported_or_refused(undisturbed, capsys, monkeypatch):
    run("x", "--jobs", "1", "--shard", "1/2")
    here = chunks.platform_of(chunks.origin_of(Plan(read_scenario("e.toml"))))
    monkeypatch.setattr(chunks, "platform_of", lambda origin: "Plan9 mips")
    assert main(["run", "e.toml", "--jobs", "1", "--out", "x", "--same-platform"]) == 2
    assert f"holds rows made on {here}; here is Plan9 mips: refused by --same-platform" in capsys.readouterr().err
    assert run("x", "--jobs", "1")["result.json"] == undisturbed["result.json"]
    assert capsys.readouterr().err.count("last digits may differ") == 1
    (part,) = parts.listed(Path("x/parts"))
    assert part.about.platforms == tuple(sorted([here, "Plan9 mips"]))


def test_files_that_hold_the_same_runs_agree_or_are_an_error(undisturbed, capsys):
    for shard in ("1/2", "2/3", "3/3"):
        run("x", "--jobs", "1", "--shard", shard)
    assert contents("x")["result.json"] == undisturbed["result.json"]
    plan = Plan(read_scenario("e.toml"))
    run("y", "--jobs", "1", "--shard", "1/2")
    rows = [run_one(plan, index)[1] for index in (2, 3)]
    wrong = [rows[0], msgspec.structs.replace(rows[1], time=7.0)], [msgspec.structs.replace(rows[0], time=7.0), rows[1]]
    for at, some in enumerate(wrong):
        parts.commit_to(Path("y/parts"), Chunks(plan).of(some))
        assert main(["run", "e.toml", "--jobs", "1", "--out", "y"]) == (2 if at else 0)
        if not at:
            Path("y/result.json").unlink()
    assert "say different things of run 2" in capsys.readouterr().err


def part(first: int, last: int, lost: tuple[int, ...] = ()) -> PartFile:
    return PartFile(Path(f"{first}-{last}"), first, last, About({}, ("here",), lost))


def test_a_lost_run_gives_way_and_nothing_is_there_twice():
    files = [part(0, 4), part(3, 9), part(5, 5, (5,)), part(12, 12, (12,))]
    pieces = cover(files)
    assert [(piece.first, piece.last) for piece in pieces] == [(0, 4), (5, 9), (12, 12)]
    assert missing(pieces, 15) == [range(10, 12), range(13, 15)]
    assert missing(cover(files, lost=False), 15) == [range(10, 15)]
    whole = part(0, 9, (4,))
    assert cover([whole], lost=False) == [PartRange(whole, 0, 3), PartRange(whole, 5, 9)]
    assert [(piece.first, piece.last) for piece in cover([whole])] == [(0, 3), (4, 4), (5, 9)]


def test_input_errors_name_the_file():
    with pytest.raises(InputError, match="parts: expected the rows of 6 runs"):
        stored_rows(Path(), 6)


HOSTILE = {
    "words for numbers": {"speed": ["fast"] * 6},
    "no numbers of runs": {"index": None},
    "numbers for words": {"cause": [1.0] * 6},
    "no ends": {"end": [None] * 6},
}


@pytest.mark.parametrize("kind", HOSTILE)
@pytest.mark.parametrize("reader", [["plot", "x"], ["report", "x", "--out", "r.md"]])
def test_rows_of_a_stranger_that_are_none_are_refused_in_one_sentence(kind, reader, large, capsys):
    import pyarrow as pa

    run("x", "--jobs", "1")
    (old,) = parts.listed(Path("x/parts"))
    rows = pa.Table.from_batches(parts.rows_of([parts.PartRange(old, old.first, old.last)]))
    for name, values in HOSTILE[kind].items():
        at = rows.schema.get_field_index(name)
        rows = rows.remove_column(at) if values is None else rows.set_column(at, name, pa.array(values))
    old.path.unlink()
    parts.commit_to(Path("x/parts"), parts.FinishedChunk(Chunk(0, 6), parts.encoded(rows, old.about), 0.0, "", ""))
    capsys.readouterr()
    assert main(reader) == 2
    err = capsys.readouterr().err
    assert err.startswith("biped: x/parts/00000000-00000005-")
    assert err.count("\n") == 1
    assert "defect" not in err
