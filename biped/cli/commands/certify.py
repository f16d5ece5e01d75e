"""`biped certify`: how likely a fall is."""

from __future__ import annotations

import argparse
from pathlib import Path

from biped.base.errors import InputError
from biped.cli.common import DONE, UNDECIDED, answer, changes_of, warn, workers_of
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
    parser.add_argument("scenario", nargs="?", help="name in scenarios/, or path of a scenario file")
    known = "estimate problems whose probability is known, each so many times (100: several minutes)"
    parser.add_argument("--reference", type=whole, metavar="REPEATS", help=known)
    take_changes(parser)
    parser.add_argument("--engine", help="engine to run in")
    relative = "half the 95 %% interval over the probability, at which it stops (default: 0.3)"
    parser.add_argument("--relative", type=number, default=0.3, help=relative)
    parser.add_argument("--most", type=whole, default=20_000, help="runs at most (default: 20000)")
    parser.add_argument("--size", type=whole, default=100, help="runs at each level of a sample (default: 100)")
    score = "what levels are of: learned from stronger disturbances (default), margin, drop or lean"
    parser.add_argument("--score", default="learned", help=score)
    parser.add_argument("--method", choices=["counting", "splitting"], help="default: whichever is cheaper")
    parser.add_argument("--out", type=Path, help="results folder; an interrupted command in it is continued")
    take_trust(parser)
    take_workers(parser)
    take_json(parser)


def command(args: argparse.Namespace) -> int:
    """Estimates the probability; what an interrupt leaves is gone on with by the same command."""
    from biped.show.certify import document_of
    from biped.show.markdown import write
    from biped.show.terminal import progress, show
    from biped.studies.certify.estimation import Accuracy
    from biped.studies.certify.study import certify

    if (args.reference is None) == (args.scenario is None):
        raise InputError("certify: expected a scenario, or --reference REPEATS alone")
    if args.reference is not None:
        return _reference(args)
    accuracy = Accuracy(args.relative, args.most, args.size, args.score, args.method)
    with workers_of(args) as jobs:
        found = certify(args.scenario, changes_of(args), jobs, args.out, accuracy, progress, warn)
    document = document_of(found.as_dict())
    write(document, found.folder, "certify.md")
    answer(args, found.as_dict(), show, document)
    return DONE if found.reached else UNDECIDED


def _reference(args: argparse.Namespace) -> int:
    from biped.show.certify import reference_document
    from biped.show.terminal import progress, show
    from biped.studies.certify.reference import validate

    if args.reference < 2:
        raise InputError(f"--reference {args.reference}: expected at least 2 repeats")
    with workers_of(args) as jobs:
        found = [one.as_dict() for one in validate(args.reference, jobs, progress)]
    answer(args, {"problems": found}, show, reference_document(found))
    return DONE
