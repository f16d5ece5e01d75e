"""`biped worker`: works for campaigns on a cluster."""

import argparse

from biped.cli.common import DONE
from biped.cli.parser import Commands, command_parser, whole


def add(commands: Commands) -> None:
    """Adds the parser of `biped worker`."""
    parser = command_parser(
        commands, "worker", "run simulations for campaigns on a cluster", command, simulates=True,
        description="Starts workers for a Dask scheduler. Each worker has one thread and is restarted if it dies.",
    )  # fmt: skip
    parser.add_argument("scheduler", help="address of the scheduler, such as tcp://host:8786")
    parser.add_argument("--workers", type=whole, default=1, help="number of workers, one core each (default: 1)")
    parser.add_argument(
        "--lifetime", metavar="TIME", help="stop after this time, such as 50m; keep it below the time limit of the job"
    )
    parser.add_argument("--memory", metavar="SIZE", default="auto", help="largest memory of each worker, such as 2GB")
    for part, what in (
        ("ca-file", "certificate of the authority that signed the scheduler's, for a scheduler at tls://…"),
        ("cert", "certificate of this worker, for a scheduler at tls://…"),
        ("key", "key of this worker's certificate"),
    ):
        parser.add_argument(f"--tls-{part}", metavar="FILE", help=what)
    parser.add_argument("--with-parent", action="store_true", help="stop when standard input ends")


def command(args: argparse.Namespace) -> int:
    """Works until the scheduler is gone, the lifetime is over, or it is stopped."""
    from biped.ensemble.cluster.worker import go_with_parent, work

    if args.with_parent:
        go_with_parent()
    files = {"ca-file": args.tls_ca_file, "cert": args.tls_cert, "key": args.tls_key}
    tls = {name: path for name, path in files.items() if path is not None}
    work(args.scheduler, args.workers, args.memory, args.lifetime, tls)
    return DONE
