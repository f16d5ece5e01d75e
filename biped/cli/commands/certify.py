"""`biped certify`: how likely a fall is."""

from __future__ import annotations

import argparse
from pathlib import Path

from biped.cli.common import DONE, UNDECIDED, changes_of, print_json, warn, workers_of
from biped.cli.parser import Commands, command_parser, number, take_changes, take_json, take_trust, take_workers, whole


def add(commands: Commands) -> None:
    """Adds the parser of `biped certify`."""
    parser = command_parser(
        commands, "certify", "how likely a fall is: probability with its interval, steps to a fall", command,
        simulates=True,
        description="The probability that a run of a scenario falls, over everything that it draws, with a 95 % "
        "interval: by counting plain runs or, where falls are rare, by splitting, whichever is cheaper. An "
        "interrupted command in --out is continued. Exit code 3: the interval is wider than asked for.",
    )  # fmt: skip
    parser.add_argument("scenario", help="name in scenarios/, or path of a scenario file")
    take_changes(parser)
    parser.add_argument("--engine", help="engine to run in")
    relative = "half the 95 %% interval over the probability, at which it stops (default: 0.3)"
    parser.add_argument("--relative", type=number, default=0.3, help=relative)
    parser.add_argument("--most", type=whole, default=20_000, help="runs at most (default: 20000)")
    parser.add_argument("--size", type=whole, default=150, help="runs at each level of a sample (default: 150)")
    score = "what levels are of: margin of the extrapolated centre of mass (default), drop or lean"
    parser.add_argument("--score", default="margin", help=score)
    parser.add_argument("--method", choices=["counting", "splitting"], help="default: whichever is cheaper")
    parser.add_argument("--out", type=Path, help="results folder; an interrupted command in it is continued")
    take_trust(parser)
    take_workers(parser)
    take_json(parser)


def command(args: argparse.Namespace) -> int:
    """Estimates the probability; what an interrupt leaves is gone on with by the same command."""
    from biped.show.certify import show, write
    from biped.show.terminal import progress
    from biped.studies.certify.study import Accuracy, certify

    accuracy = Accuracy(args.relative, args.most, args.size, args.score, args.method)
    with workers_of(args) as jobs:
        found = certify(args.scenario, changes_of(args), jobs, args.out, accuracy, progress, warn)
    write(found.as_dict(), found.folder)
    if args.json:
        print_json(found.as_dict())
    else:
        show(found.as_dict())
    return DONE if found.reached else UNDECIDED
