"""`biped certify`: how likely a fall is."""

import argparse
from pathlib import Path

from biped.base.errors import InputError
from biped.cli.common import DONE, UNDECIDED, answer, changes_of, warn, workers_of
from biped.cli.parser import Commands, command_parser, number, take_changes, take_engine, take_running, whole


def add(commands: Commands) -> None:
    """Adds the parser of `biped certify`."""
    parser = command_parser(
        commands, "certify", "estimate how likely a fall is, however rare, with an interval", command,
        simulates=True,
        description="Estimates the probability that a run of a scenario falls, over everything that it draws at "
        "random, with a 95 % interval. It counts plain runs or, where falls are rare, splits runs, whichever is "
        "cheaper. With --out an interrupted command is continued. Exit code 3: the interval is wider than "
        "--relative.",
    )  # fmt: skip
    parser.add_argument("scenario", nargs="?", help="name in scenarios/, or path of a scenario file")
    known = "test the estimator: estimate problems of known probability, each so many times (100: several minutes)"
    parser.add_argument("--reference", type=whole, metavar="REPEATS", help=known)
    take_changes(parser)
    take_engine(parser)
    relative = "stop when half the 95 %% interval is this share of the probability (default: 0.3)"
    parser.add_argument("--relative", type=number, metavar="SHARE", default=0.3, help=relative)
    parser.add_argument(
        "--most", type=whole, metavar="N", default=20_000, help="largest number of runs (default: 20000)"
    )
    parser.add_argument(
        "--size",
        type=whole,
        metavar="N",
        default=100,
        help="with splitting: number of runs at each level (default: 100)",
    )
    score = "with splitting: how nearness to a fall is measured: learned (default), margin, drop or lean"
    parser.add_argument("--score", default="learned", help=score)
    parser.add_argument(
        "--method", choices=["counting", "splitting"], help="how to estimate (default: whichever is cheaper)"
    )
    parser.add_argument("--out", type=Path, help="results folder; the same command continues what was interrupted")
    take_running(parser)


def command(args: argparse.Namespace) -> int:
    """Estimates the probability; what an interrupt leaves is gone on with by the same command."""
    from biped.show.certify import document_of
    from biped.show.markdown import write
    from biped.show.terminal import progress
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
    answer(args, found.as_dict(), document)
    return DONE if found.reached else UNDECIDED


def _reference(args: argparse.Namespace) -> int:
    from biped.show.certify import reference_document
    from biped.show.terminal import progress
    from biped.studies.certify.reference import validate

    if args.reference < 2:
        raise InputError(f"--reference {args.reference}: expected at least 2 repeats")
    with workers_of(args) as jobs:
        found = [one._asdict() for one in validate(args.reference, jobs, progress)]
    answer(args, {"problems": found}, reference_document(found))
    return DONE
