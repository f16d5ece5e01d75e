"""`biped model`: what is recognised in a model file, and all that is wrong with it."""

import argparse

from biped.cli.common import DONE, FAILED, answer
from biped.cli.parser import Commands, command_parser, take_json, take_trust


def add(commands: Commands) -> None:
    """Adds the parser of `biped model`."""
    parser = command_parser(
        commands, "model", "show what is recognised in a model file, and every fault in it", command,
        simulates=True,
        description="Shows what is recognised in a model file, and lists every fault at once, each with what to "
        "write.",
    )  # fmt: skip
    parser.add_argument(
        "file", nargs="+", help="name in models/, or path of an MJCF or URDF file; several files make a table"
    )
    parser.add_argument(
        "--stand", action="store_true", help="also try whether each robot stands, in the physics of its file"
    )
    take_trust(parser)
    take_json(parser)


def command(args: argparse.Namespace) -> int:
    """Prints what the robot in a file is; the exit code says whether it can be run."""
    from biped.robot.report import look
    from biped.show.robot import document_of

    if args.stand or len(args.file) > 1:
        return _table(args)
    found = look(args.file[0])
    answer(args, found.as_dict(), document_of(found))
    return FAILED if found.faults else DONE


def _table(args: argparse.Namespace) -> int:
    """Prints files in a row each; the exit code says whether all are robots, and stand if that was asked."""
    from biped.show.robot import models_document
    from biped.studies.models import survey

    rows = survey(args.file, args.stand)
    answer(args, {"models": [row._asdict() for row in rows]}, models_document(rows))
    return FAILED if any(row.refused or row.stood is False for row in rows) else DONE
