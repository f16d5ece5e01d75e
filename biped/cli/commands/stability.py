"""`biped stability`: a gait as a limit cycle."""

import argparse
from pathlib import Path

from biped.base.errors import InputError
from biped.cli.common import DONE, FAILED, answer, changes_of, workers_of
from biped.cli.parser import Commands, command_parser, take_changes, take_json, take_trust, take_workers
from biped.scenario.engines import ENGINES, HOME, MUJOCO


def add(commands: Commands) -> None:
    """Adds the parser of `biped stability`."""
    what = "analyse a gait as a limit cycle: return map and Floquet multipliers"
    parser = command_parser(commands, "stability", what, command, simulates=True)
    parser.add_argument("scenario", nargs="?", help="name in scenarios/, or path of a scenario file")
    parser.add_argument(
        "--reference", action="store_true", help="test the method: solve walkers whose multipliers are known"
    )
    take_changes(parser)
    take_trust(parser)
    parser.add_argument("--engine", choices=list(ENGINES), help="use only this engine (default: mujoco, then home)")
    parser.add_argument(
        "--basin", action="store_true", help="also compute a section of the basin of attraction, over lean and speed"
    )
    growth = "only compute how pushes of one tick grow from stride to stride; for any robot, law and engine"
    parser.add_argument("--growth", action="store_true", help=growth)
    norm = "only compute the gait sensitivity norm: how much a small push or step changes the steps after it"
    parser.add_argument("--norm", action="store_true", help=norm)
    take_workers(parser)
    parser.add_argument("--out", type=Path, help="folder for figure and numbers (default: a new one below runs/)")
    take_json(parser)


def command(args: argparse.Namespace) -> int:
    """Studies a scenario's gait, or solves the walkers whose multipliers are known."""
    if args.reference == (args.scenario is not None):
        raise InputError("stability: expected a scenario, or --reference alone")
    if args.growth or args.norm:
        return _small(args)
    return _reference(args) if args.reference else _gait(args)


def _small(args: argparse.Namespace) -> int:
    """Small disturbances of any walk: their growth, or what they do to its steps."""
    from biped.show.stability import growth_document, sensitivity_document
    from biped.studies.stability.growth import growth
    from biped.studies.stability.sensitivity import sensitivity

    if args.reference or args.basin or (args.growth and args.norm):
        raise InputError("stability: expected --growth or --norm, and with it neither --reference nor --basin")
    with workers_of(args) as jobs:
        if args.growth:
            found = growth(args.scenario, changes_of(args), jobs)
            document = growth_document(found)
        else:
            found = sensitivity(args.scenario, changes_of(args), jobs)
            document = sensitivity_document(found)
    answer(args, found.as_dict(), document)
    return DONE


def _reference(args: argparse.Namespace) -> int:
    from biped.show.stability import known_document
    from biped.studies.stability.reference import solve_all

    cycles = solve_all()
    answer(args, {name: known.as_dict() for name, known in cycles.items()}, known_document(cycles))
    return DONE


def _gait(args: argparse.Namespace) -> int:
    from biped.base.json import dumps
    from biped.base.replacing import may_fill
    from biped.base.writing import write_text
    from biped.ensemble.guard import complaining, new_folder
    from biped.show.document import Paragraph
    from biped.show.figures.stability import plot_stability
    from biped.show.stability import document_of
    from biped.studies.folders import RUNS
    from biped.studies.stability.study import study

    if args.out is not None:
        may_fill(args.out, "--out", ("stability.json",))
    engines = (MUJOCO, HOME) if args.engine is None else (args.engine,)
    with workers_of(args) as jobs:
        studied = study(args.scenario, args.changes, engines, jobs, args.basin)
    result = studied.as_dict()
    folder = args.out
    if folder is None:
        folder = new_folder(RUNS, f"{studied.scenario}-stability")
    plot_stability(studied, folder)
    if args.basin:
        from biped.show.figures.stability import plot_basin

        plot_basin(studied, folder)
    with complaining(folder / "stability.json"):
        write_text(folder / "stability.json", dumps(result, indent=1))
    answer(args, result, (*document_of(studied), Paragraph(f"results in {folder}/")))
    return DONE if studied.stable else FAILED
