"""`biped plot`: figures of a run or campaign."""

import argparse
from pathlib import Path

from biped.cli.common import DONE
from biped.cli.parser import Commands, command_parser


def add(commands: Commands) -> None:
    """Adds the parser of `biped plot`."""
    parser = command_parser(commands, "plot", "draw figures of a run or campaign", command)
    parser.add_argument("run", type=Path, help="results folder")


def command(args: argparse.Namespace) -> int:
    """Draws them and prints their names."""
    from biped.show.replay import plot_results

    for path in plot_results(args.run):
        print(path)
    return DONE
