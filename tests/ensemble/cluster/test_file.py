"""Files that describe a cluster, and what a batch system is handed."""

from __future__ import annotations

import sys
from contextlib import ExitStack

import pytest

from biped.base.errors import InputError
from biped.ensemble.cluster.file import Queued, from_file, read, seconds
from tests.cases import write

pytestmark = [
    pytest.mark.filterwarnings("ignore::ResourceWarning", "ignore::DeprecationWarning"),
    pytest.mark.usefixtures("folder"),
]

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
    options = ("--nthreads 1", "--nworkers 2", "--nanny", "--preload biped.ensemble.cluster.worker",
               "--lifetime 1680s", "--death-timeout 120", "--tls-ca-file", "--tls-key")  # fmt: skip
    assert all(option in worker for option in options), worker
