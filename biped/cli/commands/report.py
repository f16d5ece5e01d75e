"""`biped report`: results as a Markdown page, or as an HTML page that people look at."""

import argparse
from pathlib import Path

from biped.cli.common import DONE
from biped.cli.parser import Commands, command_parser


def add(commands: Commands) -> None:
    """Adds the parser of `biped report`."""
    what = "write results as an HTML page, or campaigns as Markdown with figures"
    parser = command_parser(commands, "report", what, command)
    runs = (
        "results folders of run; with --html also of compare, diff, tune, stability and standard, and files of "
        "regress --json"
    )
    parser.add_argument("run", type=Path, nargs="+", help=runs)
    parser.add_argument("--html", type=Path, metavar="FILE", help="write one HTML page, which needs no network")
    parser.add_argument("--out", type=Path, help="the Markdown file (default: report.md, unless --html is given)")
    parser.add_argument("--title", default="Results", help="heading of the report (default: Results)")


def command(args: argparse.Namespace) -> int:
    """Writes the page, or both, and prints their names."""
    if args.html is not None:
        from biped.show.page import write_page

        write_page(args.run, args.html, args.title)
        print(args.html)
    if args.out is not None or args.html is None:
        from biped.show.report import write_report

        out = args.out or Path("report.md")
        write_report(args.run, out, args.title)
        print(out)
    return DONE
