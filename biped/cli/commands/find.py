"""`biped find`: distinct ways to fall, the likeliest first."""

from __future__ import annotations

import argparse
from pathlib import Path

from biped.cli.common import DONE, FAILED, answer, changes_of, warn, workers_of
from biped.cli.parser import Commands, command_parser, take_changes, take_json, take_trust, take_workers, whole


def add(commands: Commands) -> None:
    """Adds the parser of `biped find`."""
    parser = command_parser(
        commands, "find", "distinct ways to fall, the likeliest first, each a scenario of its own", command,
        simulates=True,
        description="Looks for runs of a scenario that fall, by splitting where they are rare, keeps the likeliest of "
        "every way to fall, makes it likelier as long as it falls alike, and writes it as a scenario for CI. An "
        "interrupted command in --out is continued. Exit code 1: something falls.",
    )  # fmt: skip
    parser.add_argument("scenario", help="name in scenarios/, or path of a scenario file")
    take_changes(parser)
    parser.add_argument("--engine", help="engine to run in")
    against = "only runs that another gait or law stands: what it changes, e.g. controller=robust"
    parser.add_argument("--against", metavar="KEY=VALUE", help=against)
    parser.add_argument("--failures", type=whole, default=10, help="ways to fall at most (default: 10)")
    parser.add_argument("--most", type=whole, default=3000, help="runs that look for falls at most (default: 3000)")
    parser.add_argument("--out", type=Path, help="results folder; an interrupted command in it is continued")
    take_trust(parser)
    take_workers(parser)
    take_json(parser)


def command(args: argparse.Namespace) -> int:
    """Finds ways to fall; what an interrupt leaves is gone on with by the same command."""
    from biped.show.find import document_of
    from biped.show.markdown import write
    from biped.show.terminal import progress, show
    from biped.studies.find import find

    with workers_of(args) as jobs:
        found = find(
            args.scenario, changes_of(args), args.against, jobs, args.out, args.failures, args.most, progress, warn
        )
    document = document_of(found.as_dict())
    write(document, found.folder, "find.md")
    answer(args, found.as_dict(), show, document)
    return FAILED if found.found else DONE
