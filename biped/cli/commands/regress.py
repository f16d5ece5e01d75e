"""`biped regress`: scenarios against their recorded numbers."""

from __future__ import annotations

import argparse

from biped.cli.common import DONE, FAILED, print_json, reason_of, workers_of
from biped.show.regress import show
from biped.show.terminal import progress
from biped.studies.regress.guard import regress


def command(args: argparse.Namespace) -> int:
    """Compares, and records where that was asked for."""
    with workers_of(args) as jobs:
        outcome = regress(args.scenario, jobs, args.file, reason_of(args), progress)
    if args.json:
        print_json(outcome.as_dict())
    else:
        show(outcome)
    if outcome.stopped:
        raise KeyboardInterrupt
    return DONE if outcome.passed else FAILED
