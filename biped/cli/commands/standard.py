"""`biped standard`: gaits and the standard tests, searched to failure."""

from __future__ import annotations

import argparse
from pathlib import Path

from biped.base.files import label
from biped.cli.common import DONE, changes_of, print_json, workers_of
from biped.ensemble.guard import new_folder
from biped.show.standing import show, write
from biped.show.terminal import progress
from biped.studies.folders import RUNS
from biped.studies.standard.study import standard


def command(args: argparse.Namespace) -> int:
    """Puts gaits to the tests; what an interrupt leaves is gone on with by the same command."""
    out: Path = args.out or new_folder(RUNS, "standard")
    with workers_of(args) as jobs:
        found = standard(args.gait, args.test, changes_of(args), jobs, out, progress).as_dict()
    write(found, out)
    if args.json:
        print_json(found)
    else:
        show(found)
        print(f"  standard.json and standard.md in {label(out)}/")
    return DONE
