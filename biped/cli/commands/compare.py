"""`biped compare`: the same scenario in both engines."""

from __future__ import annotations

import argparse
from pathlib import Path

from biped.base.errors import InputError
from biped.base.replacing import may_fill
from biped.cli.common import DONE, FAILED, one_folder, print_all, workers_of
from biped.cli.parser import Commands, command_parser, take_scenarios


def add(commands: Commands) -> None:
    """Adds the parser of `biped compare`."""
    what = "run scenarios in both engines: every metric side by side, with its gap"
    parser = command_parser(commands, "compare", what, command)
    take_scenarios(parser)
    parser.add_argument("--out", type=Path, help="folder for figures and recordings (default: new ones below runs/)")


def command(args: argparse.Namespace) -> int:
    """Compares scenarios; each leaves numbers, a figure and a recording."""
    from biped.ensemble.guard import new_folder
    from biped.show.side_by_side import draw, show
    from biped.studies.comparison import OWN, compare, write
    from biped.studies.folders import RUNS
    from biped.studies.planned import title_of

    if args.engine is not None:
        raise InputError("--engine: compare runs both engines; expected no --engine")
    one_folder(args)
    if args.out is not None:
        may_fill(args.out, "--out", OWN)
    made = []
    with workers_of(args) as jobs:
        for name in args.scenario:
            title = title_of(name)
            made.append(compare(name, title, args.changes, jobs))
            where = args.out or new_folder(RUNS, f"compare-{title}")
            write(made[-1], where)
            draw(made[-1], where)
            if not args.json:
                print(f"figure, recording and numbers in {where}/")
    results = [one.as_dict() for one in made]
    if args.json:
        print_all(results)
    else:
        show(made)
    return DONE if all(result["passed"] for result in results) else FAILED
