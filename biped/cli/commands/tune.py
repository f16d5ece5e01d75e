"""`biped tune`: gains that serve a scenario's conditions."""

from __future__ import annotations

import argparse
from pathlib import Path

from biped.cli.common import DONE, print_json, warn, workers_of
from biped.show.terminal import progress
from biped.show.tune import show
from biped.studies.tune.tuned import tune


def command(args: argparse.Namespace) -> int:
    """Searches; how the search goes is drawn anew after every generation."""
    with workers_of(args) as jobs:
        found = tune(args.scenario, args.changes, jobs, args.out, progress, _draw, warn)
    if args.json:
        print_json(found.as_dict())
    else:
        show(found)
    return DONE


def _draw(journal: list, folder: Path) -> None:
    from biped.show.figures.convergence import plot_search

    plot_search(journal, folder / "convergence.png")
