"""`biped standard`: gaits and the standard tests, searched to failure."""

import argparse
from pathlib import Path

from biped.base.errors import InputError
from biped.base.files import label
from biped.cli.common import DONE, answer, changes_of, engines_of, workers_of
from biped.cli.parser import Commands, command_parser, take_changes, take_engine, take_running


def add(commands: Commands) -> None:
    """Adds the parser of `biped standard`."""
    parser = command_parser(
        commands, "standard", "search for the largest slopes, pushes and steps that gaits withstand", command,
        description="Searches for the largest value of each test in scenarios/standard that a gait withstands, by "
        "ensembles with intervals, and puts all gaits into one table. With --out an interrupted table is continued.",
    )  # fmt: skip
    parser.add_argument("gait", nargs="+", help="a gait: name in controllers/ or path; or a law for any robot: its "
        "name, path.py:Class, or a policy's card")  # fmt: skip
    test = "only this test: name in scenarios/standard, or path of a scenario with [standard] (repeatable)"
    parser.add_argument("--test", metavar="NAME", action="append", default=[], help=test)
    parser.add_argument(
        "--atlas",
        action="store_true",
        help="all of a row of docs/atlas.md instead: its tests, the growth of small pushes, the gait sensitivity norm",
    )
    take_changes(parser, "change a key of all tests, e.g. model=robot (repeatable)")
    take_engine(parser)
    parser.add_argument(
        "--engines", metavar="E,E", help="test in several engines, e.g. mujoco,home; each has its own column"
    )
    parser.add_argument("--out", type=Path, help="folder for standard.json and standard.md (default: below runs/)")
    take_running(parser)


def command(args: argparse.Namespace) -> int:
    """Puts gaits to the tests; what an interrupt leaves is gone on with by the same command."""
    from biped.ensemble.guard import new_folder
    from biped.show.atlas import rows_of
    from biped.show.document import Paragraph
    from biped.show.standing import document_of, write
    from biped.show.terminal import progress
    from biped.studies.folders import RUNS
    from biped.studies.standard.atlas import atlas
    from biped.studies.standard.study import standard

    engines = engines_of(args)
    if args.atlas and (args.test or engines):
        raise InputError("--atlas: expected neither --test nor --engines: a row has tests of its own")
    out: Path = args.out or new_folder(RUNS, "standard")
    with workers_of(args) as jobs:
        if args.atlas:
            found = atlas(args.gait, changes_of(args), jobs, out, progress)
        else:
            found = standard(args.gait, args.test, changes_of(args), jobs, out, progress, engines).as_dict()
    write(found, out)
    document = rows_of(found) if args.atlas else document_of(found)
    answer(args, found, (*document, Paragraph(f"standard.json and standard.md in {label(out)}/")))
    return DONE
