"""What happens to workers, schedulers and clients of a campaign on a cluster: killed, late, elsewhere."""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from biped.ensemble.backend import WorkerLost
from biped.ensemble.executor import workers
from tests.cases import ENSEMBLE, contents, write

ROOT = Path(__file__).parents[3]
MANY = ENSEMBLE.replace("runs = 6", "runs = 400")
pytestmark = [
    pytest.mark.filterwarnings("ignore::ResourceWarning", "ignore::DeprecationWarning"),
    pytest.mark.usefixtures("folder"),
]


def command(out: str, *more: str) -> subprocess.Popen:
    argv = [sys.executable, "-m", "biped.cli.main", "run", "e.toml", "--out", out, *more]
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    return subprocess.Popen(argv, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)


def descendants(of: int) -> list[tuple[int, str]]:
    """Processes below one, with their command lines."""
    found, left = [], [of]
    while left:
        process = left.pop()
        try:
            tasks_of = Path(f"/proc/{process}/task").glob("*/children")
            words = " ".join(path.read_text(encoding="ascii") for path in tasks_of).split()
            line = Path(f"/proc/{process}/cmdline").read_bytes().replace(b"\0", b" ").decode()
        except OSError:
            continue
        found.append((process, line))
        left += map(int, words)
    return found[1:]


@pytest.fixture
def many(request):
    """The result of a longer campaign, by processes here."""
    write("e.toml", MANY.replace("400", str(getattr(request, "param", 400))))
    process = command("whole", "--jobs", "2")
    process.communicate()
    assert process.returncode in (0, 1)
    return {name: contents("whole")[name] for name in ("result.json", "runs.parquet")}


def assert_as(many: dict[str, bytes], out: str = "x") -> None:
    found = contents(out)
    assert {name: found[name] for name in many} == many


@pytest.mark.slow
@pytest.mark.parametrize("many", [800], indirect=True)
def test_workers_killed_every_few_seconds_cost_nothing(many):
    process, kills, chance, before = command("x", "--cluster", "local:2"), 0, random.Random(0), 0
    while process.poll() is None:
        time.sleep(1.0)
        done = len(list(Path("x/parts").glob("*.parquet")))
        spawned = [pid for pid, line in descendants(process.pid) if "spawn_main" in line]
        if spawned and done > before:  # on a slow machine, a worker takes long to start
            os.kill(chance.choice(spawned), signal.SIGKILL)
            kills, before = kills + 1, done
    error = process.communicate()[1]
    assert process.returncode in (0, 1), error
    assert "Traceback" not in error
    assert kills > 1
    assert_as(many)


@pytest.mark.slow
def test_a_scheduler_that_is_killed_is_started_again(many):
    process, killed = command("x", "--cluster", "local:2"), False
    while process.poll() is None and not killed:
        time.sleep(0.1)
        if list(Path("x/parts").glob("*.parquet")):
            (scheduler,) = [pid for pid, line in descendants(process.pid) if "cluster.local" in line]
            os.kill(scheduler, signal.SIGKILL)
            killed = True
    error = process.communicate()[1]
    assert killed
    assert "the scheduler is gone or does not answer" in error
    assert all(line.startswith("biped: ") for line in error.splitlines()), "what libraries log"
    assert process.returncode in (0, 1), error
    assert_as(many)


@pytest.mark.slow
def test_workers_whose_process_is_killed_are_started_anew(many):
    """The process that looks after the workers: nobody else would start them again."""
    process, killed = command("x", "--cluster", "local:2"), False
    while process.poll() is None and not killed:
        time.sleep(0.1)
        if list(Path("x/parts").glob("*.parquet")):
            (looking_after,) = [pid for pid, line in descendants(process.pid) if "cli.main worker" in line]
            os.kill(looking_after, signal.SIGKILL)
            killed = True
    error = process.communicate()[1]
    assert killed
    assert "local:2: its workers ended, and are started anew" in error
    assert all(line.startswith("biped: ") for line in error.splitlines())
    assert process.returncode in (0, 1), error
    assert_as(many)


@pytest.mark.slow
def test_a_client_that_is_killed_takes_its_cluster_along_and_the_next_goes_on(many):
    process = command("x", "--cluster", "local:2")
    while not list(Path("x/parts").glob("*.parquet")):
        assert process.poll() is None
        time.sleep(0.1)
    below = [pid for pid, _ in descendants(process.pid)]
    process.kill()
    process.communicate()
    deadline = time.monotonic() + 60
    while any(Path(f"/proc/{pid}").exists() for pid in below) and time.monotonic() < deadline:
        time.sleep(0.2)
    assert not any(Path(f"/proc/{pid}").exists() for pid in below)
    before = {path.name for path in Path("x/parts").glob("*.parquet")}
    assert before
    again = command("x", "--cluster", "local:2")
    again.communicate()
    assert again.returncode in (0, 1)
    assert_as(many)


@pytest.mark.slow
def test_a_run_that_ends_its_workers_becomes_a_row_that_says_so(cluster):
    def deadly(x: int) -> int:
        if x == 3:
            os.kill(os.getpid(), signal.SIGKILL)
        return x

    with workers(deadly, cluster) as carried_out:
        found = list(carried_out(range(6), lost=lambda x, error: str(error)))
        assert found[:3] + found[4:] == [0, 1, 2, 4, 5]
        assert found[3].startswith("worker lost: 3 workers ended with it, the last one ")
        with pytest.raises(WorkerLost, match="3 workers ended with it"):
            list(carried_out([3]))


@pytest.mark.slow
def test_workers_that_join_late_at_a_scheduler_of_somebody_else(many):
    """As docs/clusters.md has it: a scheduler, a command, and workers that come when they come."""
    write("scheduler.py", "from biped.ensemble.cluster.local import _serve; import asyncio; asyncio.run(_serve())")
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    started = [subprocess.Popen([sys.executable, "scheduler.py"], env=environment, stdout=subprocess.PIPE, text=True)]
    try:
        address = started[0].stdout.readline().strip()
        process = command("x", "--cluster", address)
        for _ in range(2):
            time.sleep(5.0)
            argv = [sys.executable, "-m", "biped.cli.main", "worker", address]
            started.append(subprocess.Popen(argv, env=environment, stderr=subprocess.DEVNULL))
        error = process.communicate()[1]
        assert process.returncode in (0, 1), error
        assert_as(many)
    finally:
        for one in started:
            one.terminate()
            one.communicate()


SUBMIT = """#!/bin/bash
cp "$1" "job-$$.sh"  # as sbatch does
setsid bash "job-$$.sh" > "job-$$.log" 2>&1 < /dev/null &
echo "Submitted batch job $!"
"""

CANCEL = """#!/bin/bash
for job in "$@"; do kill -- "-$job"; done
"""


@pytest.mark.slow
def test_a_campaign_by_jobs_of_a_batch_system(many, monkeypatch):
    """SLURM's two commands, as far as dask-jobqueue asks for them."""
    Path("bin").mkdir()
    for name, text in (("sbatch", SUBMIT), ("scancel", CANCEL)):
        write(f"bin/{name}", text)
        Path("bin", name).chmod(0o755)
    monkeypatch.setenv("PATH", f"{Path('bin').resolve()}:{os.environ['PATH']}")
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    write("slurm.toml", f'[slurm]\njobs = 2\nshared = "{Path().resolve()}"\n')
    process = command("x", "--cluster", "slurm.toml")
    error = process.communicate()[1]
    assert process.returncode in (0, 1), error
    assert_as(many)
    assert not list(Path().glob(".dask-jobqueue.*")), "certificates go with the campaign"
