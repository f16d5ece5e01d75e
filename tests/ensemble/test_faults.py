"""What happens to campaigns on real machines: killed, out of disk, twice in a folder; nothing finished is lost."""

from __future__ import annotations

import errno
import json
import os
import random
import resource
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from biped.cli.main import main
from biped.ensemble import campaign
from tests.cases import ENSEMBLE, contents, write

ROOT = Path(__file__).parents[2]
HERE = os.getpid()
RESULTS = ("result.json", "runs.parquet", "scenario.toml")
MANY = ENSEMBLE.replace("runs = 6", "runs = 120")
pytestmark = pytest.mark.usefixtures("folder")


def run(*more: str) -> int:
    return main(["run", "e.toml", "--jobs", "2", "--out", "x", *more])


def assert_as(undisturbed: dict[str, bytes]) -> None:
    """The results of a campaign that nothing happened to, and nothing besides."""
    found = contents("x")
    assert {name: data for name, data in found.items() if name != "runs.jsonl"} == {
        name: data for name, data in undisturbed.items() if name != "runs.jsonl"
    }
    rows = [json.loads(line) for line in found["runs.jsonl"].splitlines()[1:]]
    assert {row["index"] for row in rows if row["end"] != "lost"} == set(range(6))


def test_every_run_costs_a_worker_once(undisturbed, monkeypatch):
    simulate = campaign.simulate

    def killed(run):
        try:
            os.close(os.open(f"killed-{run.index}", os.O_CREAT | os.O_EXCL))
        except FileExistsError:
            return simulate(run)
        assert os.getpid() != HERE
        os.kill(os.getpid(), signal.SIGKILL)

    monkeypatch.setattr(campaign, "simulate", killed)
    assert run() == 0
    assert_as(undisturbed)
    assert len(list(Path().glob("killed-*"))) == 6


def test_a_worker_killed_while_it_keeps_a_fall(undisturbed, monkeypatch):
    from biped.ensemble import failures

    save = failures.save_packed

    def killed(self, path):
        if os.getpid() != HERE and not Path("killed").exists():
            Path("killed").touch()
            path.write_bytes(b"half")
            os.kill(os.getpid(), signal.SIGKILL)
        save(self, path)

    monkeypatch.setattr(failures, "save_packed", killed)
    assert run() == 0
    assert Path("killed").exists()
    assert_as(undisturbed)


def test_a_run_that_costs_two_workers_is_a_row_that_says_so(undisturbed, monkeypatch, capsys):
    simulate = campaign.simulate

    def killed(run):
        if run.index == 2:
            assert os.getpid() != HERE
            os.kill(os.getpid(), signal.SIGKILL)
        return simulate(run)

    with monkeypatch.context() as patch:
        patch.setattr(campaign, "simulate", killed)
        assert run() == 1
    out = capsys.readouterr().out
    assert "1 × lost: its process was killed (SIGKILL)" in out
    result = json.loads(Path("x/result.json").read_text(encoding="utf-8"))
    row, whole = result["runs"][2], json.loads(undisturbed["result.json"])
    assert (row["end"], row["fell"], row["walked"], row["stood"], row["speed"]) == ("lost", False, False, 0, None)
    assert (row["seed"], row["values"]) == (whole["runs"][2]["seed"], whole["runs"][2]["values"])
    assert not result["passed"]
    assert result["summary"]["falls"] == whole["summary"]["falls"] - whole["runs"][2]["fell"]
    assert [r for r in result["runs"] if r["index"] != 2] == [r for r in whole["runs"] if r["index"] != 2]
    # A machine's misfortune is no result: the same command makes it again.
    assert run() == 0
    assert_as(undisturbed)


@pytest.mark.parametrize("jobs", ["1", "2"])
@pytest.mark.parametrize("size", [0, 300, 3000, 7000, 12_000, 16_000])
def test_a_full_disk(size, jobs, undisturbed, capsys):
    """No file may grow beyond a size: a system's answer like any other."""
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, limits[1]))
    try:
        code = main(["run", "e.toml", "--jobs", jobs, "--out", "x"])
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    error = capsys.readouterr().err
    assert code in (1, 2), "nothing was full"
    assert error.startswith("biped: ")
    assert error.count("\n") == 1
    assert "cannot be written: file too large" in error
    assert not Path("x/result.json").exists() or contents("x")["result.json"] == undisturbed["result.json"]
    assert not Path("x/runs.parquet").exists()
    assert not list(Path().rglob("*.part"))
    if Path("x").exists():
        assert Path("x/runs.jsonl").stat().st_size > 0, "an empty folder was left behind"
    capsys.readouterr()
    assert main(["run", "e.toml", "--jobs", jobs, "--out", "x"]) == 0
    assert_as(undisturbed)


def test_a_disk_that_is_full_when_all_is_done_does_not_spoil_what_was_there(undisturbed, monkeypatch, capsys):
    assert run() == 0
    before = contents("x")

    def full(fd):
        raise OSError(errno.ENOSPC, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(os, "fsync", full)
        assert run() == 1
    assert "x/runs.parquet: cannot be written: no space left on device" in capsys.readouterr().err
    assert contents("x") == before


def test_a_read_only_folder(undisturbed, monkeypatch, capsys):
    assert run() == 0
    before, system_open = contents("x"), os.open

    def refused(path, flags, *args, **kwargs):
        if flags & (os.O_WRONLY | os.O_RDWR | os.O_CREAT) and str(path).startswith(str(Path("x").resolve())):
            raise OSError(errno.EROFS, "Read-only file system")
        return system_open(path, flags, *args, **kwargs)

    monkeypatch.setattr(os, "open", refused)
    assert run() == 2
    error = capsys.readouterr().err
    assert error == "biped: --out x: cannot be written: read-only file system; choose another folder\n"
    assert contents("x") == before


HOLDING = """
    import sys
    from pathlib import Path
    from biped.ensemble.guard import Lock
    lock = Lock(Path('x'), Path('x'))
    print('held', flush=True)
    sys.stdin.readline()
"""


def test_two_campaigns_in_one_folder(undisturbed, capsys):
    """The lock ends with its holder: nobody has to tidy up, and no clock or number of a process decides."""
    assert run() == 0
    before = contents("x")
    code = "\n".join(line.strip() for line in HOLDING.splitlines())
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    other = subprocess.Popen(
        [sys.executable, "-c", code], env=environment, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    assert other.stdout.readline() == "held\n"
    capsys.readouterr()
    assert run() == 2
    error = capsys.readouterr().err
    assert f"--out x: another command is at work in it (process {other.pid} on " in error
    assert error.count("\n") == 1
    assert {name: data for name, data in contents("x").items() if name != ".lock"} == before
    other.kill()
    other.communicate()
    assert Path("x/.lock").exists(), "the dead do not tidy up"
    assert run() == 0
    assert contents("x") == before


def test_two_campaigns_at_once_in_a_new_folder(undisturbed):
    """One of them is told so; the other's results are whole."""
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    argv = [sys.executable, "-m", "biped.cli.main", "run", "e.toml", "--jobs", "1", "--out", "x"]
    both = [subprocess.Popen(argv, env=environment, stderr=subprocess.PIPE, text=True) for _ in range(2)]
    ends = [(process.communicate()[1], process.returncode) for process in both]
    assert {code for _, code in ends} <= {0, 2}
    assert any(code == 0 for _, code in ends)
    assert all("another command is at work in it" in error for error, code in ends if code == 2)
    assert_as(undisturbed)


def test_a_clock_set_back(undisturbed, monkeypatch):
    assert run() == 0
    lines = Path("x/runs.jsonl").read_bytes().splitlines(keepends=True)
    Path("x/runs.jsonl").write_bytes(b"".join(lines[:4]))
    Path("x/.lock").write_text("process 1 on a machine of the future\n", encoding="utf-8")
    for name in (*RESULTS, "runs.jsonl", ".lock"):
        os.utime(Path("x", name), (4e9, 4e9))
    monkeypatch.setattr(time, "time", lambda: 0.0)
    assert run() == 0
    assert_as(undisturbed)


def command(*more: str, **options) -> subprocess.Popen:
    argv = [sys.executable, "-m", "biped.cli.main", "run", "e.toml", "--jobs", "2", "--out", "x", *more]
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    return subprocess.Popen(argv, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, **options)


def noted() -> int:
    journal = Path("x/runs.jsonl")
    return max(0, journal.read_bytes().count(b"\n") - 1) if journal.exists() else 0


def children(of: int) -> list[int]:
    return [int(word) for word in Path(f"/proc/{of}/task/{of}/children").read_text(encoding="ascii").split()]


@pytest.fixture
def many():
    """The bytes of a longer campaign."""
    write("e.toml", MANY)
    process = command()
    process.communicate()
    assert process.returncode in (0, 1)
    whole = {name: contents("x")[name] for name in RESULTS}
    Path("x").rename("whole")
    return whole


def assert_whole(many: dict[str, bytes]) -> None:
    found = contents("x")
    assert {name: found[name] for name in RESULTS} == many
    assert {path.name for path in Path("x/failures").iterdir()} == {p.name for p in Path("whole/failures").iterdir()}


@pytest.mark.slow
def test_a_campaign_with_a_worker_killed_every_second_ends_with_the_same_bytes(many):
    process, kills = command(), 0
    chance = random.Random(0)
    while process.poll() is None:
        time.sleep(1.0)
        workers = children(process.pid) if process.poll() is None else []
        if workers:
            os.kill(chance.choice(workers), signal.SIGKILL)
            kills += 1
    assert process.communicate()[1] == b""
    assert process.returncode in (0, 1)
    assert kills > 0
    assert_whole(many)


@pytest.mark.slow
@pytest.mark.parametrize("how", [signal.SIGKILL, signal.SIGTERM, signal.SIGINT])
def test_campaigns_stopped_at_random_go_on_to_the_same_bytes(how, many):
    """Ten times each; the workers of a killed parent end by themselves and disturb nobody."""
    chance = random.Random(int(how))
    stops = 0
    while True:
        Path("x/.lock").unlink(missing_ok=True)
        process, before = command(start_new_session=True), noted()
        rows = before + chance.randrange(12)
        # Before the lock is there, there is no command yet, only Python.
        while process.poll() is None and (stops >= 10 or noted() < rows or not Path("x/.lock").exists()):
            time.sleep(0.01)
        if process.poll() is None:
            stops += 1
            process.send_signal(how)
        error = process.communicate()[1].decode()
        assert "Traceback" not in error
        if process.returncode in (0, 1):
            break
        assert process.returncode == (130 if how == signal.SIGINT else -how)
    assert stops >= 3
    assert_whole(many)


@pytest.mark.slow
def test_a_small_disk_that_fills_again_and_again(many):
    """Every attempt gets further, until there is room for all."""
    for size in (5_000, 20_000, 60_000, 120_000, 200_000):
        limit = (size, resource.RLIM_INFINITY)
        process = command(preexec_fn=lambda limit=limit: resource.setrlimit(resource.RLIMIT_FSIZE, limit))
        error = process.communicate()[1].decode()
        if process.returncode == 0:
            break
        assert "Traceback" not in error
        assert process.returncode in (1, 2)
    process = command()
    process.communicate()
    assert process.returncode in (0, 1)
    assert_whole(many)
