"""`biped export`: results in other people's formats."""

from __future__ import annotations

import argparse

from biped.cli.common import DONE
from biped.show.eurobench import export


def command(args: argparse.Namespace) -> int:
    """Writes them and says how many."""
    files = export(args.run, args.eurobench)
    print(f"{len(files)} files in {args.eurobench}/, format as in EuroBench's documents")
    return DONE
