"""`biped plot`: figures of a run or campaign."""

from __future__ import annotations

import argparse

from biped.cli.common import DONE
from biped.show.replay import plot_results


def command(args: argparse.Namespace) -> int:
    """Draws them and prints their names."""
    for path in plot_results(args.run):
        print(path)
    return DONE
