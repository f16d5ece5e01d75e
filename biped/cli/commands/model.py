"""`biped model`: what is recognised in a model file, and all that is wrong with it."""

from __future__ import annotations

import argparse

from biped.cli.common import DONE, FAILED, print_json


def command(args: argparse.Namespace) -> int:
    """Prints what the robot in a file is; the exit code says whether it can be run."""
    from biped.studies.robot import look

    found = look(args.file)
    if args.json:
        print_json(found.as_dict())
    else:
        from biped.show.robot import show_robot

        show_robot(found)
    return FAILED if found.faults else DONE
