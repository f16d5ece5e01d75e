"""How a cluster is reached, by whom, and what is said where there is none."""

from __future__ import annotations

import logging
import socket
import subprocess
import sys
from pathlib import Path

import pytest

import biped
from biped.base.errors import InputError, RunError
from biped.cli.main import main
from biped.ensemble.cluster import tasks, worker
from biped.ensemble.cluster.local import Local
from biped.ensemble.cluster.tasks import Tasks
from biped.ensemble.executor import workers

pytestmark = [
    pytest.mark.filterwarnings("ignore::ResourceWarning", "ignore::DeprecationWarning"),
    pytest.mark.usefixtures("folder"),
]


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


def test_a_worker_of_other_versions_is_refused_and_both_are_named(cluster, monkeypatch):
    there = worker.versions()
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
    assert len(worker.resources(False)) == 1
    assert worker.resources(False).items() < worker.resources(True).items()


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

    monkeypatch.setattr(tasks.time, "sleep", lambda _: None)
    told = []
    with pytest.raises(RunError, match="no scheduler for 0 s; finished runs are kept: start it and its workers"):
        Tasks(tasks.Connection(connect, "tcp://h:1", 0.0, ""), abs, False, told.append)
    assert "is gone or does not answer" in told[0]


def test_workers_that_end_again_and_again_are_an_error(monkeypatch):
    local = Local(2)
    monkeypatch.setattr(local, "_start_workers", lambda: subprocess.Popen([sys.executable, "-c", ""]))
    try:
        assert local.mend() == "", "there were none yet"
        local._working = local._start_workers()
        for _ in range(3):
            local._working.wait()
            assert local.mend() == "local:2: its workers ended, and are started anew; finished runs are kept"
        local._working.wait()
        with pytest.raises(RunError, match=r"the workers of local:2 ended 4 times.*finished runs are kept"):
            local.mend()
    finally:
        local.close()


def test_what_dask_logs_is_not_printed(cluster):
    assert cluster
    for name in ("distributed.client", "distributed.worker", "asyncio", "tornado.application"):
        assert not logging.getLogger(name).isEnabledFor(logging.ERROR), name


def free_port() -> int:
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        return one.getsockname()[1]


def test_where_there_is_no_cluster(capsys, monkeypatch):
    monkeypatch.setattr("biped.ensemble.cluster.tasks.CONNECT", 0.3)
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
    assert "install it with: pip install distributed dask-jobqueue cryptography" in capsys.readouterr().err


def test_a_scheduler_of_ours_is_reached_from_here_only(cluster):
    assert cluster._connection.client.scheduler.address.startswith("tcp://127.0.0.1:")
    there = cluster._connection.client.scheduler_info()["workers"]
    assert all(address.startswith("tcp://127.0.0.1:") for address in there)
