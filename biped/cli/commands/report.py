"""`biped report`: results as a Markdown page, or as an HTML page that people look at."""

from __future__ import annotations

import argparse
from pathlib import Path

from biped.cli.common import DONE


def command(args: argparse.Namespace) -> int:
    """Writes the page, or both, and prints their names."""
    if args.html is not None:
        from biped.show.page import write_page

        write_page(args.run, args.html, args.title)
        print(args.html)
    if args.out is not None or args.html is None:
        from biped.show.markdown import write_report

        out = args.out or Path("report.md")
        write_report(args.run, out, args.title)
        print(out)
    return DONE
