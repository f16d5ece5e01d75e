"""`biped diff`: what changed between two results, gaits or laws."""

import argparse
from pathlib import Path

from biped.base.errors import InputError
from biped.base.files import label
from biped.base.replacing import may_fill, may_write
from biped.cli.common import DONE, FAILED, print_json, warn, workers_of
from biped.cli.parser import Commands, command_parser, number, take_changes, take_running, whole


def add(commands: Commands) -> None:
    """Adds the parser of `biped diff`."""
    parser = command_parser(
        commands, "diff", "compare two results, gaits or laws, run by run", command,
        description="Compares two results folders, or runs a scenario with each of two gaits or laws and compares "
        "them. Runs are paired by seed, and every metric has its change with an interval. Exit code 1: something "
        "became worse.",
    )  # fmt: skip
    first = "before: a results folder, a gait (name or path) or a law (path.py:Class)"
    parser.add_argument("first", help=first)
    parser.add_argument("second", help="after: the same kind of thing")
    parser.add_argument("--scenario", help="the scenario to run with both gaits or laws: name in scenarios/ or path")
    take_changes(parser, "change a key of that scenario (repeatable)")
    parser.add_argument("--metrics", metavar="NAME,…", default="", help="compare only these metrics (default: all)")
    margin = "a smaller relative change does not matter (default: 0.05)"
    parser.add_argument("--margin", type=float, default=0.05, help=margin)
    sequential = "run pair after pair until it is decided which gait or law walks more often"
    parser.add_argument("--sequential", action="store_true", help=sequential)
    parser.add_argument(
        "--error", type=number, default=0.05, help="with --sequential: probability of a wrong decision (default: 0.05)"
    )
    ratio = (
        "with --sequential: one is better if it alone walks in this many times as many pairs as the other alone does "
        "(default: 3)"
    )
    parser.add_argument("--ratio", type=number, default=3.0, help=ratio)
    parser.add_argument(
        "--most", type=whole, default=500, help="with --sequential: largest number of pairs (default: 500)"
    )
    parser.add_argument(
        "--out",
        type=Path,
        help="folder for diff.json and diff.md (for gaits and laws by default a new one below runs/)",
    )
    parser.add_argument("--html", type=Path, metavar="FILE", help="also write an HTML page")
    take_running(parser)


def command(args: argparse.Namespace) -> int:
    """Compares; worse is a failure, what cannot be said is not."""
    from biped.base.sequential import Rates
    from biped.show.diff import document_of, write
    from biped.show.terminal import progress, show
    from biped.studies.diff.controllers import of_controllers, until_decided
    from biped.studies.diff.study import of_folders

    only = [name.strip() for name in args.metrics.split(",") if name.strip()]
    folders = [Path(word) for word in (args.first, args.second)]
    stored = [(folder / "result.json").is_file() for folder in folders]
    out: Path | None = args.out
    if out is not None:
        may_fill(out, "--out", ("diff.json", "first", "second"))
    if args.html is not None:
        from biped.show.page import KIND

        may_write(args.html, "--html", KIND)
    if args.sequential and (any(stored) or only):
        raise InputError("--sequential: expected two gaits or laws and a --scenario, and no --metrics")
    if all(stored):
        if args.scenario is not None or args.changes:
            raise InputError("diff: --scenario and --set: expected with gaits or laws only, results are what they are")
        found = of_folders(folders[0], folders[1], args.margin, only)
    else:
        _same_kind(args, stored)
        if args.scenario is None:
            raise InputError(
                "diff: --scenario missing; expected what to run with each gait, e.g. --scenario level_fast --set "
                "randomise.runs=50 --set start.jitter=0.002"
            )
        with workers_of(args) as jobs:
            what = args.first, args.second, args.scenario, args.changes, jobs, out
            if args.sequential:
                rates = Rates(args.error, args.ratio)
                found, out = until_decided(*what, rates, args.most, args.margin, progress, warn)
            else:
                found, out = of_controllers(*what, args.margin, only, progress, warn)
    if out is not None:
        write(found, out)
    if args.html is not None:
        from biped.show.page import write_sections
        from biped.show.page.differing import section_of

        write_sections([section_of(found.as_dict())], args.html, "What changed")
    if args.json:
        print_json(found.as_dict())
    else:
        show(document_of(found))
        if out is not None:
            print(f"  diff.json and diff.md in {label(out)}/")
        if args.html is not None:
            print(f"  page in {label(args.html)}")
    return DONE if found.passed else FAILED


def _same_kind(args: argparse.Namespace, stored: list[bool]) -> None:
    """Refuses a results folder beside a gait, and a folder that holds no results.

    Raises:
        InputError: So it is.
    """
    for word, there in zip((args.first, args.second), stored, strict=True):
        folder = Path(word)
        if any(stored) and not there:
            raise InputError(f"{word}: expected a results folder (with result.json) as the other is")
        if not there and folder.is_dir():
            raise InputError(f"{word}: expected a results folder (with result.json), got another folder")
