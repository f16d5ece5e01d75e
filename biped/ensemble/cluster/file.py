"""A cluster as a file says: a scheduler with its certificates, workers here, or jobs of SLURM, PBS or LSF."""

import re
import shlex
import sys
from contextlib import ExitStack
from pathlib import Path
from typing import Annotated, Any, Literal

from msgspec import Meta, field

from biped.base.errors import InputError, safe
from biped.base.files import label, read_toml
from biped.base.typed import Section
from biped.ensemble.cluster.local import Local
from biped.ensemble.cluster.tasks import Connection, connecting
from biped.ensemble.cluster.worker import options
from biped.scenario.valid import convert, known_keys

Text = Annotated[str, Meta(min_length=1, max_length=1000)]
QUIETLY = "export DASK_DISTRIBUTED__WORKER__PROFILE__ENABLED=False"
SPARE = 120.0
"""[s] before the end of a walltime at which workers go."""


class Scheduler(Section, frozen=True, kw_only=True):
    """A scheduler that runs already: its address, and files of certificates where that is tls://…."""

    address: Text
    ca_file: Text | None = None
    cert: Text | None = None
    key: Text | None = None


class Workers(Section, frozen=True, kw_only=True):
    """Workers on this machine."""

    workers: Annotated[int, Meta(ge=1, le=1000)]


class Jobs(Section, frozen=True, kw_only=True):
    """Jobs of a batch system.

    Attributes:
        jobs: How many.
        cores: Workers of each, one core each.
        memory: Of each job.
        walltime: Of each job, HH:MM:SS; workers go two minutes before, and another job takes their place.
        queue, account: As the batch system calls them.
        interface: Network interface, such as `ib0`.
        shared: Folder that all machines see, for the certificates of this campaign.
        python: Interpreter there, with biped; default: this one.
        scratch: Folder of a machine's own for what Dask writes.
        directives: More lines of the job's head.
        prologue: Shell commands before the workers start.
        logs: Folder of the jobs' output.
    """

    jobs: Annotated[int, Meta(ge=1, le=10_000)]
    cores: Annotated[int, Meta(ge=1, le=1000)] = 1
    memory: Text | None = None
    walltime: Text = "01:00:00"
    queue: Text | None = None
    account: Text | None = None
    interface: Text | None = None
    shared: Text | None = None
    python: Text | None = None
    scratch: Text | None = None
    directives: list[Text] = field(default_factory=list)
    prologue: list[Text] = field(default_factory=list)
    logs: Text | None = None


class File(Section, frozen=True, kw_only=True):
    """A file: exactly one of the tables, and how long a scheduler or a first worker is waited for [s]."""

    scheduler: Scheduler | None = None
    local: Workers | None = None
    slurm: Jobs | None = None
    pbs: Jobs | None = None
    lsf: Jobs | None = None
    wait: Annotated[float, Meta(gt=0)] | None = None


def read(name: str) -> File:
    """Reads a file.

    Raises:
        InputError: It is no description of a cluster.
    """
    path = Path(name)
    data = read_toml(path)

    def fail(key: str, what: str) -> InputError:
        return InputError(f"{label(path)}: {key}: {what}")

    known_keys(data, File, "", fail)
    file = convert(data, File, fail)
    tables = [name for name in File.__struct_fields__ if name != "wait"]
    if sum(getattr(file, name) is not None for name in tables) != 1:
        words = ", ".join(f"[{name}]" for name in tables)
        raise InputError(f"{label(path)}: expected exactly one of the tables {words}")
    return file


def from_file(name: str, stack: ExitStack) -> Connection:
    """The cluster that a file describes.

    Args:
        name: Its path.
        stack: Lets go what is started here.

    Raises:
        InputError: It cannot be used.
    """
    from biped.ensemble.cluster import WAIT

    file = read(name)
    wait = WAIT if file.wait is None else file.wait
    if file.local is not None:
        local = Local(file.local.workers)
        stack.callback(local.close)
        return Connection(local.connect, name, wait, "they are starting", local.trouble)
    if file.scheduler is not None:
        there = file.scheduler
        if not there.address.startswith(("tcp://", "tls://")):
            raise InputError(f"{label(Path(name))}: scheduler.address: expected tcp://host:8786 or tls://…, got "
                             f"'{safe(there.address)}'")  # fmt: skip
        files = {key: getattr(there, key) for key in ("ca_file", "cert", "key") if getattr(there, key) is not None}
        for key, path in files.items():
            if not Path(path).is_file():
                raise InputError(f"{label(Path(name))}: scheduler.{key}: no file '{safe(path)}'")
        remedy = f"biped worker {there.address} starts one"
        return Connection(connecting(there.address, files), f"{name} ({there.address})", wait, remedy)
    kind: Literal["slurm", "pbs", "lsf"] = next(kind for kind in ("slurm", "pbs", "lsf") if getattr(file, kind))
    jobs: Jobs = getattr(file, kind)
    queued = Queued(kind, jobs, label(Path(name)))
    stack.callback(queued.close)
    return Connection(queued.connect, name, file.wait, f"{jobs.jobs} jobs are asked for")  # queues take what they take


class Queued:
    """Workers that a batch system starts; the scheduler is this process, reached by TLS alone.

    Args:
        kind: The batch system.
        jobs: What to ask it for.
        place: The file, for errors.
    """

    def __init__(self, kind: Literal["slurm", "pbs", "lsf"], jobs: Jobs, place: str):
        self._kind, self._jobs, self._place = kind, jobs, place
        self._cluster: Any = None

    def cluster(self, **more: Any) -> Any:
        """The cluster of dask-jobqueue, with no job yet.

        Raises:
            InputError: The packages are not installed, or it cannot be made so.
        """
        try:
            import cryptography  # noqa: F401
            import dask_jobqueue
        except ImportError as error:
            raise InputError(
                f"{self._place}: needs the package '{error.name}'; install it with: "
                "pip install distributed dask-jobqueue cryptography"
            ) from None
        jobs = self._jobs
        makes = {"slurm": "SLURMCluster", "pbs": "PBSCluster", "lsf": "LSFCluster"}[self._kind]
        account = {} if jobs.account is None else {"project" if self._kind == "lsf" else "account": jobs.account}
        whole = seconds(jobs.walltime, self._place)
        walltime = jobs.walltime if self._kind != "lsf" else f"{int(whole) // 3600}:{int(whole) % 3600 // 60:02d}"
        try:
            return getattr(dask_jobqueue, makes)(
                cores=jobs.cores, processes=jobs.cores, memory=jobs.memory or f"{2 * jobs.cores}GB",
                walltime=walltime, queue=jobs.queue, interface=jobs.interface, security=True,
                shared_temp_directory=jobs.shared or str(Path.cwd()), local_directory=jobs.scratch,
                python=shlex.quote(jobs.python or sys.executable), worker_extra_args=options(f"{whole - SPARE:.0f}s"),
                job_extra_directives=jobs.directives, job_script_prologue=[*jobs.prologue, QUIETLY],
                log_directory=jobs.logs,
                death_timeout=120, job_name="biped", scheduler_options={"dashboard_address": "127.0.0.1:0"},
                **account, **more,
            )  # fmt: skip
        except (OSError, ValueError, RuntimeError) as error:
            raise InputError(f"{self._place}: {self._kind}: {' '.join(str(error).split())[:300]}") from None

    def connect(self) -> Any:
        """Asks for the jobs, and connects.

        Raises:
            InputError: It cannot be made so.
        """
        from distributed import Client

        self.close()
        self._cluster = self.cluster()
        self._cluster.adapt(minimum_jobs=self._jobs.jobs, maximum_jobs=self._jobs.jobs)  # those that end are replaced
        return Client(self._cluster, set_as_default=False)

    def close(self) -> None:
        """Cancels the jobs."""
        cluster, self._cluster = self._cluster, None
        if cluster is not None:
            cluster.close(timeout=10)


def seconds(walltime: str, place: str) -> float:
    """A walltime in seconds.

    Raises:
        InputError: It is none, or too short to work in.
    """
    found = re.fullmatch(r"(?:(\d+)-)?(\d+):(\d\d)(?::(\d\d))?", walltime, re.ASCII)
    if found is None:
        raise InputError(f"{place}: walltime: expected HH:MM:SS, got '{safe(walltime)}'")
    days, hours, minutes, rest = (int(part or 0) for part in found.groups())
    total = 86400.0 * days + 3600.0 * hours + 60.0 * minutes + rest
    if total < 2 * SPARE:
        raise InputError(f"{place}: walltime: expected at least {2 * SPARE / 60:g} minutes, got '{safe(walltime)}'")
    return total
