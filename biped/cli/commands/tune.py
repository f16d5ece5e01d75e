"""`biped tune`: gains that serve a scenario's conditions."""

import argparse
from pathlib import Path

from biped.cli.common import DONE, answer, warn, workers_of
from biped.cli.parser import Commands, command_parser, take_changes, take_json, take_trust, take_workers


def add(commands: Commands) -> None:
    """Adds the parser of `biped tune`."""
    parser = command_parser(
        commands, "tune", "search for gains that work under the conditions of a scenario", command, simulates=True,
        description="Searches for gains that work under the conditions in the table [tune] of a scenario. With --out "
        "an interrupted search is continued.",
    )  # fmt: skip
    parser.add_argument(
        "scenario",
        help="a scenario with a table [tune]: name in scenarios/ or path; or a robot's model file (.xml, .urdf), for "
        "which scenarios/tune/any.toml searches",
    )
    take_changes(parser)
    take_trust(parser)
    take_workers(parser)
    parser.add_argument("--out", type=Path, help="results folder; the same command continues what was interrupted")
    least = (
        "instead of a search: put the gains of a found gait back one by one to where its search began, to see which of "
        "them it needs"
    )
    parser.add_argument("--least", metavar="GAIT", help=least)
    take_json(parser)


def command(args: argparse.Namespace) -> int:
    """Searches; how the search goes is drawn anew after every re-check."""
    from biped.show.terminal import progress
    from biped.show.tune import document_of
    from biped.studies.tune.tuned import tune

    if args.least is not None:
        return _least(args)
    from biped.studies.tune.robot import SCENARIO, is_model, search_of

    with workers_of(args) as jobs:
        name, changes = args.scenario, args.changes
        if is_model(name):
            from biped.show.terminal import show
            from biped.show.tune import trials_document

            changes, trials = search_of(name, changes, jobs, progress)
            if not args.json:
                show(trials_document(trials, changes))
            name = SCENARIO
        found = tune(name, changes, jobs, args.out, progress, _draw, warn)
    answer(args, found.as_dict(), document_of(found))
    return DONE


def _least(args: argparse.Namespace) -> int:
    """Goes back from a found gait to the scenario's own; the figure is drawn anew after every step."""
    from biped.show.terminal import progress
    from biped.show.tune import least_document
    from biped.studies.tune.least import least

    with workers_of(args) as jobs:
        found = least(args.scenario, args.least, args.changes, jobs, args.out, progress, _draw_least, warn)
    answer(args, found.as_dict(), least_document(found))
    return DONE


def _draw_least(steps: list, folder: Path) -> None:
    from biped.show.figures.tuning import plot_least

    plot_least(steps, folder / "least.png")


def _draw(journal: list, folder: Path) -> None:
    from biped.show.figures.tuning import plot_search

    if "recheck" in journal[-1]:  # a figure costs as much as a few runs
        plot_search(journal, folder / "convergence.png")
