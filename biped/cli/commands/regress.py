"""`biped regress`: scenarios against their recorded numbers."""

import argparse
from pathlib import Path

from biped.cli.common import DONE, FAILED, answer, reason_of, workers_of
from biped.cli.parser import Commands, command_parser, take_running
from biped.scenario.engines import ENGINES


def add(commands: Commands) -> None:
    """Adds the parser of `biped regress`."""
    parser = command_parser(
        commands, "regress", "compare scenarios with their recorded reference numbers", command, simulates=True,
        description="Runs a fixed part of each scenario and compares with recorded numbers: digit by digit on the "
        "kind of machine that recorded them, and within physical tolerances elsewhere.",
    )  # fmt: skip
    parser.add_argument("scenario", nargs="*", help="name in scenarios/, or path (default: every shipped scenario)")
    parser.add_argument("--update", action="store_true", help="record the numbers that differ as the new reference")
    parser.add_argument("--reason", help="why results changed; kept in the file (needed by --update)")
    engine = "run all scenarios in this engine and compare with its references (default: each in its own engine)"
    parser.add_argument("--engine", choices=list(ENGINES), help=engine)
    parser.add_argument("--file", type=Path, help="file of references (default: the one of the shipped scenarios)")
    parser.add_argument("--markdown", action="store_true", help="print what changed as Markdown, sorted by cause")
    take_running(parser)


def command(args: argparse.Namespace) -> int:
    """Compares, and records where that was asked for."""
    from biped.show.references import document_of, moved_table
    from biped.show.terminal import progress
    from biped.studies.regress.guard import regress

    with workers_of(args) as jobs:
        outcome = regress(args.scenario, jobs, args.file, reason_of(args), progress, args.engine)
    if args.markdown and not args.json:
        print(moved_table(outcome))
    else:
        answer(args, outcome.as_dict(), document_of(outcome.as_dict()))
    if outcome.stopped:
        raise KeyboardInterrupt
    return DONE if outcome.passed else FAILED
