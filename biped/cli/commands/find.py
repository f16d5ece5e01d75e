"""`biped find`: distinct ways to fall, the likeliest first."""

import argparse
from pathlib import Path

from biped.cli.common import DONE, FAILED, answer, changes_of, warn, workers_of
from biped.cli.parser import Commands, command_parser, take_changes, take_engine, take_running, whole


def add(commands: Commands) -> None:
    """Adds the parser of `biped find`."""
    parser = command_parser(
        commands, "find", "search for distinct ways to fall, and write each as a scenario", command,
        simulates=True,
        description="Searches for runs of a scenario that fall, also where falls are rare. For each way to fall it "
        "keeps the likeliest run, makes it likelier while it still falls in the same way, and writes it as a "
        "scenario for CI. With --out an interrupted command is continued. Exit code 1: something falls.",
    )  # fmt: skip
    parser.add_argument("scenario", help="name in scenarios/, or path of a scenario file")
    take_changes(parser)
    take_engine(parser)
    against = "only falls in which another gait or law stays up: the key to change, e.g. controller=robust"
    parser.add_argument("--against", metavar="KEY=VALUE", help=against)
    parser.add_argument("--failures", type=whole, default=10, help="largest number of ways to fall (default: 10)")
    parser.add_argument("--most", type=whole, default=3000, help="largest number of runs of the search (default: 3000)")
    parser.add_argument("--out", type=Path, help="results folder; the same command continues what was interrupted")
    take_running(parser)


def command(args: argparse.Namespace) -> int:
    """Finds ways to fall; what an interrupt leaves is gone on with by the same command."""
    from biped.show.certify import ways_document
    from biped.show.markdown import write
    from biped.show.terminal import progress
    from biped.studies.find import find

    with workers_of(args) as jobs:
        found = find(
            args.scenario, changes_of(args), args.against, jobs, args.out, args.failures, args.most, progress, warn
        )
    document = ways_document(found.as_dict())
    write(document, found.folder, "find.md")
    answer(args, found.as_dict(), document)
    return FAILED if found.found else DONE
