"""Campaigns on a Dask cluster: scheduler and workers are processes of their own on this machine."""

from __future__ import annotations

import os
import pickle
import random
import signal
import socket
import subprocess
import sys
import time
from contextlib import ExitStack
from pathlib import Path

import cloudpickle
import pytest

import biped
from biped.base.errors import InputError, RunError
from biped.base.json import dumps
from biped.cli.main import main
from biped.ensemble.backend import WorkerLost
from biped.ensemble.chunks import Chunks
from biped.ensemble.cluster import cluster_at, connection, kinds, tasks
from biped.ensemble.cluster.file import Queued, from_file, read, seconds
from biped.ensemble.cluster.tasks import Tasks
from biped.ensemble.executor import workers
from biped.ensemble.packed import SUFFIX
from biped.ensemble.plan import Plan
from biped.scenario.reading import read_scenario
from biped.studies.comparison import compare
from biped.studies.regress.runs import ensemble, measured
from biped.studies.run import run
from biped.studies.stability.study import study
from biped.studies.tune.evaluate import Study, Task
from biped.studies.tune.space import Space
from biped.studies.tune.tuned import tune
from tests.cases import ENSEMBLE, contents, write

ROOT = Path(__file__).parents[2]
MANY = ENSEMBLE.replace("runs = 6", "runs = 400")
pytestmark = pytest.mark.filterwarnings("ignore::ResourceWarning", "ignore::DeprecationWarning")


@pytest.fixture(scope="module")
def cluster():
    """Two workers, for all tests here."""
    with cluster_at("local:2", False, lambda words: None) as two:
        yield two


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write("e.toml", ENSEMBLE)


def test_a_campaign_on_a_cluster_is_the_same_bytes(cluster):
    run("e.toml", (), 1, Path("here"))
    done = run("e.toml", (), cluster, Path("there"))
    assert done.result["summary"]["runs"] == 6
    here, there = contents("here"), contents("there")
    for name in ("result.json", "runs.parquet", "scenario.toml"):
        assert here[name] == there[name]
    kept = {name for name in there if name.endswith(SUFFIX)}
    assert len(kept) == 3, "failures.keep"
    assert all(there[name] == here[name] for name in kept)


def test_the_same_executor_carries_everything(cluster):
    """Functions with what they refer to, and errors with their key."""
    factor = 3

    def times(x: int) -> int:
        if x == 7:
            raise InputError("law: what it was", "law")
        return factor * x

    with workers(times, cluster) as carried_out:
        assert list(carried_out(range(5))) == [0, 3, 6, 9, 12]
        with pytest.raises(InputError, match="what it was") as caught:
            list(carried_out(range(9)))
    assert caught.value.key == "law"


def test_work_is_made_anew_where_it_comes_to():
    plan = ensemble(Plan(read_scenario("e.toml")))
    again = pickle.loads(pickle.dumps(plan))
    assert again.scenario == plan.scenario
    study = Study(read_scenario("tune/efficient"))
    name, space = next(iter(study.tune.conditions)), Space(study.scenario, study.gains)
    task = Task(name, 0, 1, False, space.candidate([0.0] * len(space.axes)))
    there = cloudpickle.loads(cloudpickle.dumps(study.outcome))
    assert there.__self__.tune == study.tune
    assert pickle.loads(pickle.dumps(task)) == task
    assert len(cloudpickle.dumps(Chunks(plan))) < 10_000, "text and a digest"


def test_regression_on_a_cluster_is_the_same(cluster):
    plan = ensemble(Plan(read_scenario("e.toml")))
    here, there = (measured(plan, jobs, "2000-01-01", "here", lambda: None) for jobs in (1, cluster))
    assert here == there


SEARCH = """duration = 0.6
seed = 3
start = { posture = "heel_toe", jitter = 0.002 }
window.start = 0.3
[tune]
gains = ["k_d1", "theta_b"]
generations = 2
population = 4
recheck = 1
checks = 1
unseen = 1
finalists = 1
[tune.conditions.level]
runs = 1
"""


def test_a_search_on_a_cluster_is_the_same(cluster):
    write("search.toml", SEARCH)
    here, there = (tune("search.toml", (), jobs, Path(name)) for name, jobs in (("here", 1), ("there", cluster)))
    assert here.found == there.found
    assert here.gait.read_text() == there.gait.read_text()


def test_both_engines_on_a_cluster_are_the_same(cluster):
    here, there = (compare("e.toml", "e", (), jobs).as_dict() for jobs in (1, cluster))
    assert dumps(here) == dumps(there)


def test_commands_and_python_know_clusters(capsys):
    """No command takes --cluster and works here."""
    for command in ("run", "check", "compare", "regress"):
        assert main([command, "e.toml", "--cluster", "nowhere"]) == 2, command
    assert main(["diff", "normal", "robust", "--scenario", "e.toml", "--cluster", "nowhere"]) == 2
    assert capsys.readouterr().err.count("nowhere") == 5
    with pytest.raises(InputError, match="cluster, which has workers of its own"):
        biped.run("e.toml", jobs=2, cluster="local:1")
    for ask in (biped.run, biped.compare):
        with pytest.raises(InputError, match="nowhere: expected the address"):
            ask("e.toml", cluster="nowhere")


class Idle:
    """A law that does nothing."""

    def __init__(self, setup):
        pass

    def torques(self, sensed):
        return [0.0] * 6


@pytest.mark.slow
def test_from_python_with_a_law_that_is_an_object():
    here, there = (biped.run("e.toml", law=Idle, **who).runs for who in ({"jobs": 1}, {"cluster": "local:2"}))
    assert dumps(here.to_pylist()) == dumps(there.to_pylist())


@pytest.mark.slow
def test_stability_on_a_cluster_is_the_same(cluster):
    here, there = (study("level_slow_generalized", [], ("mujoco",), jobs) for jobs in (2, cluster))
    assert dumps(here.as_dict()) == dumps(there.as_dict())


def test_a_worker_of_other_versions_is_refused_and_both_are_named(cluster, monkeypatch):
    there = kinds.versions()
    monkeypatch.setattr(tasks, "resources", lambda same: {"biped-other": 1.0})
    monkeypatch.setattr(tasks, "versions", lambda: there | {"mujoco": "3.9.9"})
    monkeypatch.setattr(tasks, "LOOK", 0.1)
    told = []
    monkeypatch.setattr(cluster._connection, "wait", 0.5)
    monkeypatch.setattr(cluster, "_tell", told.append)
    with pytest.raises(RunError, match=r"no worker for .* is refused"), workers(abs, cluster) as carried_out:
        list(carried_out(range(3)))
    assert len(told) == 2, "each once"
    for words in told:
        assert f"is refused: it has mujoco {there['mujoco']}, here is mujoco 3.9.9" in words


def test_another_kind_of_machine_is_asked_for_only_where_it_matters():
    assert len(kinds.resources(False)) == 1
    assert kinds.resources(False).items() < kinds.resources(True).items()


class Stalled:
    """A client whose scheduler does not answer."""

    status = "running"

    def sync(self, *_, **__):
        raise TimeoutError

    def close(self, timeout):
        pass


def test_a_scheduler_that_stays_away_is_an_error_that_says_what_it_needs(monkeypatch):
    clients = iter([Stalled()])

    def connect():
        try:
            return next(clients)
        except StopIteration:
            raise OSError("refused") from None

    monkeypatch.setattr(connection.time, "sleep", lambda _: None)
    told = []
    with pytest.raises(RunError, match="no scheduler for 0 s; finished runs are kept: start it and its workers"):
        Tasks(connection.Connection(connect, "tcp://h:1", 0.0, ""), abs, False, told.append)
    assert "is gone or does not answer" in told[0]


def free_port() -> int:
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        return one.getsockname()[1]


def test_where_there_is_no_cluster(capsys, monkeypatch):
    monkeypatch.setattr("biped.ensemble.cluster.address.CONNECT", 0.3)
    address = f"tcp://127.0.0.1:{free_port()}"
    for where, says in {
        address: f"--cluster {address}: expected a running Dask scheduler",
        "local:0": "expected at least one worker",
        "somewhere": "expected the address of a Dask scheduler",
        "none.toml": "none.toml: cannot be read",
    }.items():
        assert main(["run", "e.toml", "--cluster", where, "--out", "x"]) == 2
        err = capsys.readouterr().err
        assert says in err
        assert err.count("\n") == 1
        assert not Path("x").exists()
    assert main(["run", "e.toml", "--cluster", "local:2", "--jobs", "2"]) == 2
    assert "--jobs: expected without --cluster" in capsys.readouterr().err
    assert main(["worker", "host:8786"]) == 2
    assert "expected the address of a scheduler, such as tcp://host:8786" in capsys.readouterr().err


def test_without_its_packages(capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    assert main(["run", "e.toml", "--cluster", "local:2"]) == 2
    assert "install it with: pip install 'biped[cluster]'" in capsys.readouterr().err


FILES = {
    "nothing": ("", "expected exactly one of the tables [scheduler], [local], [slurm], [pbs], [lsf]"),
    "two": ("[local]\nworkers = 1\n[slurm]\njobs = 1\n", "expected exactly one of the tables"),
    "a key nobody knows": ("[slurm]\njobs = 1\nwaltime = '1:00'\n", "did you mean 'walltime'?"),
    "no jobs": ("[slurm]\nqueue = 'short'\n", "jobs"),
    "words": ("[slurm]\njobs = 'many'\n", "slurm.jobs"),
    "a table nobody knows": ("[sge]\njobs = 1\n", "sge: unknown key"),
    "no certificate": ("[scheduler]\naddress = 'tls://h:1'\nca_file = 'none.pem'\n", "ca_file: no file 'none.pem'"),
}


@pytest.mark.parametrize("kind", FILES)
def test_a_file_that_describes_no_cluster(kind):
    text, says = FILES[kind]
    write("c.toml", text)
    with pytest.raises(InputError) as caught, ExitStack() as stack:
        from_file("c.toml", stack)
    assert str(caught.value).startswith("c.toml: ")
    assert says in str(caught.value)


def test_walltimes():
    assert [seconds(text, "f") for text in ("01:00:00", "1-00:00:00", "0:30")] == [3600.0, 86400.0, 1800.0]
    for text in ("soon", "00:01:00", "1"):
        with pytest.raises(InputError, match=r"f: walltime: expected"):
            seconds(text, "f")


JOBS = """[{kind}]
jobs = 3
cores = 2
memory = "4GB"
walltime = "00:30:00"
queue = "short"
account = "walkers"
shared = "."
directives = ["--one-more"]
prologue = ["module load python"]
"""
HEADS = {
    "slurm": ["#SBATCH -p short", "#SBATCH -A walkers", "#SBATCH --cpus-per-task=2", "#SBATCH -t 00:30:00",
              "#SBATCH --one-more"],
    "pbs": ["#PBS -q short", "#PBS -A walkers", "#PBS -l select=1:ncpus=2:mem=", "#PBS -l walltime=00:30:00",
            "#PBS --one-more"],
    "lsf": ["#BSUB -q short", '#BSUB -P "walkers"', "#BSUB -n 2", "#BSUB -W 0:30", "#BSUB --one-more"],
}  # fmt: skip


@pytest.mark.parametrize("kind", HEADS)
def test_the_script_of_a_job(kind):
    """What dask-jobqueue hands to the batch system, of which there is none here."""
    write("c.toml", JOBS.format(kind=kind))
    made = Queued(kind, getattr(read("c.toml"), kind), "c.toml").cluster()
    try:
        script = made.job_script()
        assert made.scheduler.address.startswith("tls://"), "a port that nobody gets in by who has no key"
    finally:
        made.close()
    lines = script.splitlines()
    assert all(any(line.startswith(head) for line in lines) for head in HEADS[kind])
    assert "module load python" in lines
    worker = lines[-1]
    assert f"{sys.executable} -m distributed.cli.dask_worker tls://" in worker
    options = ("--nthreads 1", "--nworkers 2", "--nanny", "--preload biped.ensemble.cluster.preload",
               "--lifetime 1680s", "--death-timeout 120", "--tls-ca-file", "--tls-key")  # fmt: skip
    assert all(option in worker for option in options), worker


def test_a_scheduler_of_ours_is_reached_from_here_only(cluster):
    assert cluster._connection.client.scheduler.address.startswith("tcp://127.0.0.1:")
    there = cluster._connection.client.scheduler_info()["workers"]
    assert all(address.startswith("tcp://127.0.0.1:") for address in there)


# Longer ones: what happens to workers, schedulers and clients.


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
            (scheduler,) = [pid for pid, line in descendants(process.pid) if "scheduling" in line]
            os.kill(scheduler, signal.SIGKILL)
            killed = True
    error = process.communicate()[1]
    assert killed
    assert "the scheduler is gone or does not answer" in error
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
    write("scheduler.py", "from biped.ensemble.cluster.scheduling import _serve; import asyncio; asyncio.run(_serve())")
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
