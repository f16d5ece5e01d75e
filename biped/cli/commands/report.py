"""`biped report`: campaigns as a Markdown page."""

from __future__ import annotations

import argparse

from biped.cli.common import DONE
from biped.show.markdown import write_report


def command(args: argparse.Namespace) -> int:
    """Writes the page and prints its name."""
    write_report(args.run, args.out, args.title)
    print(args.out)
    return DONE
