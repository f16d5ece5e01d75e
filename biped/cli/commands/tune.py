"""`biped tune`: gains that serve a scenario's conditions."""

from __future__ import annotations

import argparse
from pathlib import Path

from biped.cli.common import DONE, print_json, warn, workers_of
from biped.show.terminal import progress
from biped.show.tune import show, show_least
from biped.studies.tune.tuned import tune


def command(args: argparse.Namespace) -> int:
    """Searches; how the search goes is drawn anew after every generation."""
    if args.least is not None:
        return _least(args)
    with workers_of(args) as jobs:
        found = tune(args.scenario, args.changes, jobs, args.out, progress, _draw, warn)
    if args.json:
        print_json(found.as_dict())
    else:
        show(found)
    return DONE


def _least(args: argparse.Namespace) -> int:
    """Goes back from a found gait to the scenario's own; the figure is drawn anew after every step."""
    from biped.studies.tune.least import least

    with workers_of(args) as jobs:
        found = least(args.scenario, args.least, args.changes, jobs, args.out, progress, _draw_least, warn)
    if args.json:
        print_json(found.as_dict())
    else:
        show_least(found)
    return DONE


def _draw_least(steps: list, folder: Path) -> None:
    from biped.show.figures.least import plot_least

    plot_least(steps, folder / "least.png")


def _draw(journal: list, folder: Path) -> None:
    from biped.show.figures.convergence import plot_search

    plot_search(journal, folder / "convergence.png")
