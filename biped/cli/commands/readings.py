"""`biped readings`: how near readings of the thesis come to what it prints."""

import argparse
from pathlib import Path

from biped.base.errors import InputError
from biped.base.files import label
from biped.cli.common import DONE, print_json, workers_of
from biped.cli.parser import Commands, command_parser, take_json, take_workers, whole


def add(commands: Commands) -> None:
    """Adds the parser of `biped readings`."""
    parser = command_parser(
        commands, "readings", "compare readings of the thesis with the numbers that it prints", command,
        description="Compares readings of the thesis with all numbers that it prints, then confirms the best and the "
        "shipped ones on seeds that no search has used. With --out an interrupted study is continued.",
    )  # fmt: skip
    parser.add_argument("--tries", type=whole, default=100, help="readings to try (default: 100)")
    runs = "runs of each claim in the confirmation (default: 30)"
    parser.add_argument("--confirm", metavar="RUNS", type=whole, default=30, help=runs)
    out = "folder for journals, readings.json and readings.md (default: below runs/)"
    parser.add_argument("--out", type=Path, help=out)
    take_workers(parser)
    take_json(parser)


def command(args: argparse.Namespace) -> int:
    """Searches, then confirms; what an interrupt leaves is gone on with by the same command."""
    from biped.ensemble.guard import new_folder
    from biped.show.readings import confirmation, data_of, distribution, write
    from biped.show.terminal import progress
    from biped.studies.folders import RUNS
    from biped.studies.readings.search import confirm, search

    for name, number, least in (("--tries", args.tries, 0), ("--confirm", args.confirm, 1)):
        if number < least:
            raise InputError(f"{name} {number}: expected at least {least}")
    out: Path = args.out or new_folder(RUNS, "readings")
    with workers_of(args) as jobs:
        tried = search(args.tries, jobs, out, progress)
        confirmed = confirm(tried, args.confirm, jobs, out, progress)
    found = data_of(tried, confirmed)
    write(found, out)
    if args.json:
        print_json(found)
    else:
        print(f"{distribution(tried)}\n\n{confirmation(confirmed)}\n\n  readings.json and readings.md in {label(out)}/")
    return DONE
