"""`biped worker`: works for campaigns on a cluster."""

from __future__ import annotations

import argparse

from biped.cli.common import DONE
from biped.ensemble.cluster.worker import go_with_parent, work


def command(args: argparse.Namespace) -> int:
    """Works until the scheduler is gone, the lifetime is over, or it is stopped."""
    if args.with_parent:
        go_with_parent()
    files = {"ca-file": args.tls_ca_file, "cert": args.tls_cert, "key": args.tls_key}
    tls = {name: path for name, path in files.items() if path is not None}
    work(args.scheduler, args.workers, args.memory, args.lifetime, tls)
    return DONE
