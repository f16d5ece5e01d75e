"""`biped export`: results in other people's formats."""

import argparse
from pathlib import Path

from biped.cli.common import DONE
from biped.cli.parser import Commands, command_parser


def add(commands: Commands) -> None:
    """Adds the parser of `biped export`."""
    parser = command_parser(commands, "export", "write results in formats of other programs", command)
    parser.add_argument("run", type=Path, help="results folder")
    wanted = parser.add_mutually_exclusive_group(required=True)
    files = "a new folder for EuroBench's files (docs/eurobench.md)"
    wanted.add_argument("--eurobench", type=Path, metavar="DIR", help=files)
    one = "an MCAP file of one run, for Foxglove and PlotJuggler (needs the package mcap)"
    wanted.add_argument("--mcap", type=Path, metavar="FILE", help=one)
    number = "with --mcap: number of the run (default: the only one, or the walker of median speed)"
    parser.add_argument("--only", type=int, metavar="RUN", help=number)


def command(args: argparse.Namespace) -> int:
    """Writes them and says how many."""
    if args.mcap is not None:
        from biped.show import mcap

        print(f"{mcap.export(args.run, args.mcap, args.only)} messages in {args.mcap}")
        return DONE
    from biped.show import eurobench

    files = eurobench.export(args.run, args.eurobench)
    print(f"{len(files)} files in {args.eurobench}/, format as in EuroBench's documents")
    return DONE
