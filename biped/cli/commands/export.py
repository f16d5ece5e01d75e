"""`biped export`: results in other people's formats."""

from __future__ import annotations

import argparse
from pathlib import Path

from biped.cli.common import DONE
from biped.cli.parser import Commands, command_parser


def add(commands: Commands) -> None:
    """Adds the parser of `biped export`."""
    parser = command_parser(commands, "export", "write results in other people's formats", command)
    parser.add_argument("run", type=Path, help="results folder")
    files = "new folder for files as EuroBench's documents describe them"
    parser.add_argument("--eurobench", type=Path, required=True, metavar="DIR", help=files)


def command(args: argparse.Namespace) -> int:
    """Writes them and says how many."""
    from biped.show.eurobench import export

    files = export(args.run, args.eurobench)
    print(f"{len(files)} files in {args.eurobench}/, format as in EuroBench's documents")
    return DONE
