"""Rows in files: the same bytes whoever made them in whatever pieces, nothing finished lost, nothing silently wrong."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

import msgspec
import numpy as np
import pytest

from biped.base.errors import InputError
from biped.base.json import dumps
from biped.cli.main import main
from biped.ensemble import campaign, chunks, columns, compact, parts
from biped.ensemble.campaign import run_one
from biped.ensemble.chunks import Chunks, Deal
from biped.ensemble.lock import Lock
from biped.ensemble.packed import SUFFIX
from biped.ensemble.parts import About, Chunk, Part, Piece, cover, missing
from biped.ensemble.plan import Plan
from biped.ensemble.shard import Shard, shard_of
from biped.ensemble.stored_rows import stored_rows
from biped.ensemble.table import records, schema_of, table
from biped.scenario.reading import from_text, read_scenario, to_toml
from biped.studies import making as running
from tests.cases import ENSEMBLE, command, contents, write

ROOT = Path(__file__).parents[2]


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write("e.toml", ENSEMBLE)


@pytest.fixture
def large(monkeypatch):
    """Six runs are many: their rows lie in files."""
    monkeypatch.setattr(running, "LARGE", 3)


def run(out: str, *more: str, code: int = 0) -> dict[str, bytes]:
    assert main(["run", "e.toml", "--out", out, *more]) == code
    return contents(out)


def of_results(files: dict[str, bytes]) -> dict[str, bytes]:
    return {name: data for name, data in files.items() if name.endswith((".json", ".parquet", ".toml"))}


@pytest.fixture(scope="module")
def small(tmp_path_factory):
    """What six runs by processes here leave."""
    here = Path.cwd()
    os.chdir(tmp_path_factory.mktemp("small"))
    try:
        write("e.toml", ENSEMBLE)
        return run("x", "--jobs", "1")
    finally:
        os.chdir(here)


def test_rows_come_back_from_their_table():
    sweep = '[sweep]\n"ground.slope" = [0.0, 2.0]\n"start.posture" = ["single", "flat"]\n'
    write(
        "s.toml", ENSEMBLE.replace("duration = 0.4", "duration = 0.31").replace("start = 0.3", "start = 0.25") + sweep
    )
    plan = Plan(read_scenario("s.toml", ["randomise.runs=2", "randomise.draw.window={choice=[1.0]}"][:1]))
    rows = [run_one(plan, index)[1] for index in range(len(plan))]
    assert any(row.leg_states is None for row in rows)
    assert any(row.leg_states is not None for row in rows)
    again = list(records(table(rows, schema_of(plan.scenario))))
    assert [dumps(record) for record in again] == [dumps(row.as_dict()) for row in rows]


def test_a_column_of_numbers_and_words_keeps_both():
    plan = Plan(read_scenario("e.toml"))
    schema = schema_of(plan.scenario)
    assert str(schema.field("values.ground.friction").type) == "double"
    mixed = msgspec.structs.replace(plan.scenario, sweep={"start.posture": ("flat", 1.0, True)})
    rows = [run_one(plan, index)[1] for index in range(3)]
    told = [
        msgspec.structs.replace(row, values=row.values | {"start.posture": value})
        for row, value in zip(rows, ("flat", 1.0, True), strict=True)
    ]
    found = [record["values"]["start.posture"] for record in records(table(told, schema_of(mixed)))]
    assert found == ["flat", 1.0, True]
    assert [type(value) for value in found] == [str, float, bool]


def test_a_scenario_travels_as_text():
    plan = Plan(read_scenario("e.toml"))
    assert Plan(from_text(to_toml(plan.scenario), Path("scenario.toml"))).scenario == plan.scenario
    make, arguments = Chunks(plan).__reduce__()
    assert [type(argument) for argument in arguments] == [str, str]
    assert make(*arguments)(Chunk(2, 2)).data == Chunks(plan)(Chunk(2, 2)).data
    with pytest.raises(Exception, match="model, gait or law of this scenario are other files there"):
        make(arguments[0], "another digest")


def test_a_campaign_in_files_holds_what_result_json_held(large, small, capsys):
    files = run("x", "--jobs", "1")
    whole, result = json.loads(small["result.json"]), json.loads(files["result.json"])
    assert result == {key: value for key, value in whole.items() if key != "runs"}
    assert "runs.parquet" not in files
    assert "runs.jsonl" not in files
    rows = stored_rows(Path("x"), 6)
    assert json.loads(dumps(list(rows))) == whole["runs"]
    assert json.loads(dumps([rows[-1], rows[0]])) == [whole["runs"][5], whole["runs"][0]]
    kept = {name for name in files if name.startswith("failures/") and name.endswith(SUFFIX)}
    assert len(kept) == 3, "failures.keep"
    assert all(files[name] == small[name] for name in kept), "the first that fell"
    _, printed = command(capsys, "run", "e.toml", "--out", "x")
    assert printed == result


def test_what_is_shown_of_rows_in_files_is_what_is_shown_of_others(small, capsys, monkeypatch):
    for name in ("few", "many"):
        monkeypatch.setattr(running, "LARGE", 3 if name == "many" else 100)
        assert main(["run", "e.toml", "--jobs", "1", "--out", f"{name}/x"]) == 0
    shown = {}
    for name in ("few", "many"):
        monkeypatch.chdir(name)
        capsys.readouterr()
        assert main(["report", "x", "--out", "r.md"]) == 0
        shown[name] = Path("r.md").read_bytes(), {p.name: p.read_bytes() for p in Path("r/x").iterdir()}
        monkeypatch.chdir("..")
    assert shown["few"] == shown["many"]
    assert len(shown["many"][1]) == 3


@pytest.mark.parametrize("many", [False, True])
def test_any_way_leads_to_the_same_bytes(many, small, monkeypatch):
    if many:
        monkeypatch.setattr(running, "LARGE", 3)
    whole = of_results(run("whole", "--jobs", "1", "--shard", "1/1"))
    assert of_results(run("pool", "--jobs", "2", "--shard", "1/1")) == whole
    for number in (2, 4, 1, 3):
        assert not Path("shards/result.json").exists()
        run("shards", "--jobs", "1", "--shard", f"{number}/4")
    assert of_results(contents("shards")) == whole
    if many:
        assert of_results(run("plain", "--jobs", "2")) == whole
    else:
        assert {name: whole[name] for name in ("result.json", "runs.parquet")} == {
            name: small[name] for name in ("result.json", "runs.parquet")
        }


def test_shards_that_were_copied_together_are_one_campaign(small):
    for number in (1, 2, 3):
        run(f"machine{number}", "--jobs", "1", "--shard", f"{number}/3")
    there = Path("all/parts")
    there.mkdir(parents=True)
    Path("machine1/scenario.toml").rename("all/scenario.toml")
    for number in (1, 2, 3):
        for path in Path(f"machine{number}/parts").iterdir():
            path.rename(there / path.name)
    monkey = pytest.MonkeyPatch()
    with monkey.context() as patch:
        patch.setattr(campaign, "simulate", pytest.fail)
        patch.setattr(running, "keep_some", lambda *_: None)
        files = run("all", "--jobs", "1")
    assert files["result.json"] == small["result.json"]


def test_a_shard_says_how_far_the_campaign_is(capsys):
    code, told = command(capsys, "run", "e.toml", "--jobs", "1", "--out", "x", "--shard", "2/3")
    assert code == 0
    assert told == {"scenario": "e", "shard": "2/3", "runs": 2, "left": 4, "folder": "x"}


@pytest.mark.parametrize("text", ["0/3", "4/3", "3", "1/0", "-1/3", "1/3/4", "a/b", "1/99999999999"])
def test_what_is_no_shard(text, capsys):
    assert main(["run", "e.toml", "--out", "x", f"--shard={text}"]) == 2
    assert "expected I/N with 1 <= I <= N, such as 3/40" in capsys.readouterr().err
    assert main(["run", "e.toml", "--shard", "1/2"]) == 2
    assert "--shard: expected with one scenario and --out" in capsys.readouterr().err


def test_shards_have_every_run_once():
    for total, of in ((6, 4), (3, 7), (1000, 40)):
        runs = [number for i in range(of) for number in Shard(i + 1, of).runs(total)]
        assert runs == list(range(total))
    assert shard_of("3/40") == Shard(3, 40)


def test_shards_share_a_folder_and_nobody_else_does(capsys):
    run("x", "--jobs", "1", "--shard", "1/2")
    others = [Lock(Path("x"), Path("x"), shared=True), Lock(Path("x"), Path("x"), name=".lock-1-of-2")]
    held = subprocess.Popen(
        [sys.executable, "-c", _HOLD], env=os.environ | {"PYTHONPATH": str(ROOT)}, stdin=subprocess.PIPE,
        stdout=subprocess.PIPE, text=True,
    )  # fmt: skip
    for lock in reversed(others):
        lock.release()
    assert held.stdout.readline() == "held\n"
    capsys.readouterr()
    assert main(["run", "e.toml", "--jobs", "1", "--out", "x"]) == 2
    assert "another command is at work in it" in capsys.readouterr().err
    assert main(["run", "e.toml", "--jobs", "1", "--out", "x", "--shard", "1/2"]) == 2
    assert "another command is at work in it" in capsys.readouterr().err
    assert main(["run", "e.toml", "--jobs", "1", "--out", "x", "--shard", "2/2"]) == 0, "but another shard may"
    assert "others are at work" in capsys.readouterr().out
    assert not Path("x/result.json").exists(), "whoever is last ends the campaign"
    held.communicate("\n")
    assert main(["run", "e.toml", "--jobs", "1", "--out", "x", "--shard", "1/2"]) == 0
    assert Path("x/result.json").exists()


_HOLD = """
import sys
from pathlib import Path
from biped.ensemble.lock import Lock
locks = [Lock(Path('x'), Path('x'), shared=True), Lock(Path('x'), Path('x'), name='.lock-1-of-2')]
print('held', flush=True)
sys.stdin.readline()
"""


def test_stopped_after_any_chunk_the_same_command_goes_on_to_the_same_bytes(large, monkeypatch, capsys):
    whole = of_results(run("whole", "--jobs", "1"))
    simulate, count = campaign.simulate, iter(range(100))

    def stopped(run):
        if next(count) == 3:
            raise KeyboardInterrupt
        return simulate(run)

    with monkeypatch.context() as patch:
        patch.setattr(campaign, "simulate", stopped)
        assert main(["run", "e.toml", "--jobs", "1", "--out", "x"]) == 130
    done = sum(part.last - part.first + 1 for part in parts.listed(Path("x/parts")))
    assert 0 < done <= 3
    made = []
    monkeypatch.setattr(campaign, "simulate", lambda run: made.append(run.index) or simulate(run))
    monkeypatch.setattr(running, "keep_some", lambda *_: None)
    assert of_results(run("x", "--jobs", "1")) == whole
    assert made == list(range(done, 6))


def test_a_campaign_goes_on_from_a_journal_and_from_files(small, monkeypatch):
    """Begun by processes here, it goes on in shards; begun in shards, it goes on by processes here."""
    run("x", "--jobs", "1")
    lines = Path("x/runs.jsonl").read_bytes().splitlines(keepends=True)
    Path("x/runs.jsonl").write_bytes(b"".join([*lines[:3], lines[5]]))
    Path("x/result.json").unlink()
    simulate, made = campaign.simulate, []
    with monkeypatch.context() as patch:
        patch.setattr(campaign, "simulate", lambda run: made.append(run.index) or simulate(run))
        patch.setattr(running, "keep_some", lambda *_: None)
        assert run("x", "--jobs", "1", "--shard", "1/1")["result.json"] == small["result.json"]
    assert made == [2, 3, 5]
    run("y", "--jobs", "1", "--shard", "1/2")
    assert run("y", "--jobs", "2")["result.json"] == small["result.json"]


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
def test_a_damaged_file_is_set_aside_and_its_runs_are_made_again(kind, small, capsys):
    for number in (1, 2):
        run("x", "--jobs", "1", "--shard", f"{number}/3")
    path = sorted(Path("x/parts").glob("*.parquet"))[0]
    path.write_bytes(DAMAGE[kind](path.read_bytes()))
    capsys.readouterr()
    assert run("x", "--jobs", "1", "--shard", "3/3")
    assert "set aside" in capsys.readouterr().err
    assert run("x", "--jobs", "1")["result.json"] == small["result.json"]
    assert len(list(Path("x/parts").glob("*.damaged"))) == 1


def test_files_of_something_else_are_refused(capsys, monkeypatch):
    run("x", "--jobs", "1", "--shard", "1/2")
    monkeypatch.setattr("biped.ensemble.origin.digest", lambda package: "another")
    before = contents("x")
    assert main(["run", "e.toml", "--jobs", "1", "--out", "x"]) == 2
    assert "its runs were made with kernels " in capsys.readouterr().err
    assert contents("x") == before


def test_another_kind_of_machine_is_reported_or_refused(small, capsys, monkeypatch):
    run("x", "--jobs", "1", "--shard", "1/2")
    here = chunks.platform_of(chunks.origin_of(Plan(read_scenario("e.toml"))))
    monkeypatch.setattr(chunks, "platform_of", lambda origin: "Plan9 mips")
    assert main(["run", "e.toml", "--jobs", "1", "--out", "x", "--same-platform"]) == 2
    assert f"holds rows made on {here}; here is Plan9 mips: refused by --same-platform" in capsys.readouterr().err
    assert run("x", "--jobs", "1")["result.json"] == small["result.json"]
    assert capsys.readouterr().err.count("last digits may differ") == 1
    (part,) = parts.listed(Path("x/parts"))
    assert part.about.platforms == tuple(sorted([here, "Plan9 mips"]))


def test_files_that_hold_the_same_runs_agree_or_are_an_error(small, capsys):
    for shard in ("1/2", "2/3", "3/3"):
        run("x", "--jobs", "1", "--shard", shard)
    assert contents("x")["result.json"] == small["result.json"]
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


def test_a_run_that_costs_its_workers_is_a_file_of_its_own_until_it_is_made(small, large, monkeypatch):
    simulate = campaign.simulate

    def killed(run):
        if run.index == 3:
            os.kill(os.getpid(), 9)
        return simulate(run)

    with monkeypatch.context() as patch:
        patch.setattr(campaign, "simulate", killed)
        assert main(["run", "e.toml", "--jobs", "2", "--out", "x"]) == 1
    whole = json.loads(small["result.json"])["runs"]
    rows = json.loads(dumps(list(stored_rows(Path("x"), 6))))
    assert [row["end"] for row in rows].count("lost") == 1
    assert rows[3]["cause"] == "lost: its process was killed (SIGKILL), and so was the next"
    assert rows[:3] + rows[4:] == whole[:3] + whole[4:]
    (part,) = parts.listed(Path("x/parts"))
    assert part.about.lost == (3,)
    clean = of_results(run("clean", "--jobs", "1"))
    assert of_results(run("x", "--jobs", "1")) == clean, "a machine's misfortune is no result"


def test_results_whose_rows_are_not_all_there_are_refused(large, capsys):
    run("x", "--jobs", "1")
    (path,) = Path("x/parts").glob("*.parquet")
    path.unlink()
    for reader in (["plot", "x"], ["report", "x", "--out", "r.md"], ["view", "x"]):
        capsys.readouterr()
        assert main(reader) == 2
        err = capsys.readouterr().err
        assert err.startswith("biped: x/parts: expected the rows of 6 runs, there are 0")
        assert err.count("\n") == 1


def test_check_of_many_runs_writes_nothing(large, capsys):
    assert main(["check", "e.toml", "--jobs", "1"]) == 0
    assert {path.name for path in Path().iterdir()} == {"e.toml"}
    _, result = command(capsys, "check", "e.toml", "--jobs", "1")
    assert "runs" not in result
    assert result["summary"]["runs"] == 6


def part(first: int, last: int, lost: tuple[int, ...] = ()) -> Part:
    return Part(Path(f"{first}-{last}"), first, last, About({}, ("here",), lost))


def test_a_lost_run_gives_way_and_nothing_is_there_twice():
    files = [part(0, 4), part(3, 9), part(5, 5, (5,)), part(12, 12, (12,))]
    pieces = cover(files)
    assert [(piece.first, piece.last) for piece in pieces] == [(0, 4), (5, 9), (12, 12)]
    assert missing(pieces, 15) == [range(10, 12), range(13, 15)]
    assert missing(cover(files, lost=False), 15) == [range(10, 15)]
    whole = part(0, 9, (4,))
    assert cover([whole], lost=False) == [Piece(whole, 0, 3), Piece(whole, 5, 9)]
    assert [(piece.first, piece.last) for piece in cover([whole])] == [(0, 3), (4, 4), (5, 9)]


def test_large_files_are_cut_and_read_as_one(monkeypatch):
    monkeypatch.setattr(running, "LARGE", 3)
    monkeypatch.setattr(parts, "GROUP", 2)
    monkeypatch.setattr(compact, "GROUP", 2)
    one = run("one", "--jobs", "1")
    monkeypatch.setattr(compact, "LARGEST", 1)
    several = run("several", "--jobs", "1")
    assert len([name for name in several if name.startswith("parts/")]) == 3
    assert several["result.json"] == one["result.json"]
    assert dumps(list(stored_rows(Path("several"), 6))) == dumps(list(stored_rows(Path("one"), 6)))


def test_stopped_while_files_are_written_anew_nothing_is_lost(large, monkeypatch):
    whole = of_results(run("whole", "--jobs", "1"))

    def stopped(*_):
        raise KeyboardInterrupt

    unlink = Path.unlink
    with monkeypatch.context() as patch:
        patch.setattr(
            Path, "unlink", lambda self, **more: stopped() if self.suffix == ".parquet" else unlink(self, **more)
        )
        assert main(["run", "e.toml", "--jobs", "1", "--out", "x"]) == 130
    assert len(parts.listed(Path("x/parts"))) > 1
    assert of_results(run("x", "--jobs", "1")) == whole


def test_runs_are_dealt_once_in_chunks_of_a_time():
    deal = Deal([range(0, 5000), range(6000, 9000)])
    seen = []
    while (chunk := deal.dealt(4)) is not None:
        seen += range(chunk.first, chunk.first + chunk.runs)
        deal.took(chunks.Made(chunk, b"", 0.05 * chunk.runs, "", ""))
        assert 0.05 * chunk.runs <= chunks.SECONDS * 1.01
    assert seen == [*range(0, 5000), *range(6000, 9000)]
    deal.halve(Chunk(10, 5))
    assert [deal.dealt(4), deal.dealt(4), deal.dealt(4)] == [Chunk(10, 2), Chunk(12, 3), None]


@pytest.mark.parametrize("held", [1, 7, 1000])
def test_the_number_of_a_rank_in_little_memory(held, monkeypatch):
    monkeypatch.setattr(columns, "HELD", held)
    monkeypatch.setattr(columns, "BINS", 5)
    rng = np.random.default_rng(0)
    for numbers in (rng.normal(size=500), np.round(rng.normal(size=500)), np.full(500, 3.0), np.array([1.0, 1.0, 2.0]),
                    np.array([1.0, np.nextafter(1.0, 2.0)] * 20)):  # fmt: skip
        pieces = np.array_split(numbers, 7)
        for rank in (0, numbers.size // 2, numbers.size - 1):
            assert columns.smallest(lambda pieces=pieces: iter(pieces), rank) == np.sort(numbers)[rank]


SQL = "SELECT count(*), avg(speed), max(index) FROM 'x/parts/*.parquet' WHERE fell"


@pytest.mark.parametrize("package", ["pyarrow", "duckdb", "polars"])
def test_rows_can_be_asked_by_other_packages(package, large):
    """As docs/clusters.md says."""
    pytest.importorskip(package)
    run("x", "--jobs", "1")
    fallen = [row for row in stored_rows(Path("x"), 6) if row["fell"]]
    if package == "pyarrow":
        import pyarrow.dataset as ds

        found = ds.dataset("x/parts").to_table(columns=["index", "time"], filter=ds.field("fell"))
        assert found["index"].to_pylist() == [row["index"] for row in fallen]
    elif package == "duckdb":
        import duckdb

        count, _, last = duckdb.sql(SQL).fetchall()[0]
        assert (count, last) == (len(fallen), fallen[-1]["index"])
    else:
        import polars

        found = polars.scan_parquet("x/parts/*.parquet").filter(polars.col("fell")).collect()
        assert found["time"].to_list() == [row["time"] for row in fallen]


def test_a_full_disk_leaves_whole_files(large, capsys, monkeypatch):
    def full(fd):
        raise OSError(28, "No space left on device")

    whole = of_results(run("whole", "--jobs", "1"))
    with monkeypatch.context() as patch:
        patch.setattr(os, "fsync", full)
        assert main(["run", "e.toml", "--jobs", "1", "--out", "x"]) in (1, 2)
    assert "no space left on device" in capsys.readouterr().err
    assert of_results(run("x", "--jobs", "1")) == whole


def test_input_errors_name_the_file():
    with pytest.raises(InputError, match="parts: expected the rows of 6 runs"):
        stored_rows(Path(), 6)


def test_from_python_rows_of_many_runs_are_a_table(large, small, tmp_path):
    import biped

    result = biped.run("e.toml", jobs=1)
    folder = result._done.files.path
    assert folder.is_dir()
    assert result.runs["index"].to_pylist() == list(range(6))
    whole = json.loads(small["result.json"])
    assert result.runs["time"].to_pylist() == [row["time"] for row in whole["runs"]]
    assert dumps(result.summary) == dumps(whole["summary"])
    assert len(result.replay(2)) > 0
    with pytest.raises(InputError, match="run 6: expected the number of a run, 0 … 5"):
        result.replay(6)
    result.save(tmp_path / "saved")
    assert list(stored_rows(tmp_path / "saved", 6))[5]["index"] == 5
    del result
    assert not folder.exists()


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
    rows = parts.read_all(old)
    for name, values in HOSTILE[kind].items():
        at = rows.schema.get_field_index(name)
        rows = rows.remove_column(at) if values is None else rows.set_column(at, name, pa.array(values))
    old.path.unlink()
    parts.commit_to(Path("x/parts"), parts.Made(Chunk(0, 6), parts.encoded(rows, old.about), 0.0, "", ""))
    capsys.readouterr()
    assert main(reader) == 2
    err = capsys.readouterr().err
    assert err.startswith("biped: x/parts/00000000-00000005-")
    assert err.count("\n") == 1
    assert "defect" not in err
