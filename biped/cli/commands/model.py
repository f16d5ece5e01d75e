"""`biped model`: what is recognised in a model file, and all that is wrong with it."""

from __future__ import annotations

import argparse

from biped.cli.common import DONE, FAILED, print_json
from biped.cli.parser import Commands, command_parser, take_json, take_trust


def add(commands: Commands) -> None:
    """Adds the parser of `biped model`."""
    parser = command_parser(
        commands, "model", "what a model file is, and all that is wrong with it", command,
        description="Says what is recognised in a model file, and lists every fault at once, with what to write.",
    )  # fmt: skip
    parser.add_argument("file", help="name in models/, or path of an MJCF or URDF file")
    take_trust(parser)
    take_json(parser)


def command(args: argparse.Namespace) -> int:
    """Prints what the robot in a file is; the exit code says whether it can be run."""
    from biped.robot.report import look

    found = look(args.file)
    if args.json:
        print_json(found.as_dict())
    else:
        from biped.show.robot import show_robot

        show_robot(found)
    return FAILED if found.faults else DONE
