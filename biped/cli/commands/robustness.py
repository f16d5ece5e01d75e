"""`biped certify`, `find`, `stability` and `standard`: how likely a fall is, and what a gait withstands."""

import argparse
from pathlib import Path

from biped.base.errors import InputError
from biped.base.files import label
from biped.cli import common
from biped.scenario.engines import ENGINES, HOME, MUJOCO


def add_certify(commands: common.Commands) -> None:
    """Adds the parser of `biped certify`."""
    parser = common.command_parser(
        commands, "certify", "estimate how likely a fall is, however rare, with an interval", certify_command,
        simulates=True,
        description="Estimates the probability that a run of a scenario falls, over everything that it draws at "
        "random, with a 95 % interval. It counts plain runs. Where falls are rare, it shifts the random force of runs "
        "towards a fall; without a random force it splits runs. With --out an interrupted command is continued. Exit "
        "code 3: the interval is wider than --relative.",
    )  # fmt: skip
    parser.add_argument("scenario", nargs="?", help="name in scenarios/, or path of a scenario file")
    known = "test the estimator: estimate problems of known probability, each so many times (100: several minutes)"
    parser.add_argument("--reference", type=common.whole, metavar="REPEATS", help=known)
    common.take_changes(parser)
    common.take_engine(parser)
    relative = "stop when half the 95 %% interval is this share of the probability (default: 0.3)"
    parser.add_argument("--relative", type=common.number, metavar="SHARE", default=0.3, help=relative)
    parser.add_argument(
        "--most", type=common.whole, metavar="N", default=20_000, help="largest number of runs (default: 20000)"
    )
    parser.add_argument(
        "--size",
        type=common.whole,
        metavar="N",
        default=100,
        help="with splitting: number of runs at each level (default: 100)",
    )
    score = "with splitting: how nearness to a fall is measured: learned (default), margin, drop or lean"
    parser.add_argument("--score", default="learned", help=score)
    parser.add_argument(
        "--method",
        choices=["counting", "splitting", "shifting"],
        help="how to estimate (default: counting; where falls are rare shifting, or splitting without a force)",
    )
    parser.add_argument("--out", type=Path, help="results folder; the same command continues what was interrupted")
    common.take_running(parser)


def certify_command(args: argparse.Namespace) -> int:
    """Estimates the probability; what an interrupt leaves is gone on with by the same command."""
    from biped.show.certify import document_of
    from biped.show.document import write_markdown
    from biped.studies.certify import certify
    from biped.studies.certify.estimation import Accuracy

    if (args.reference is None) == (args.scenario is None):
        raise InputError("certify: expected a scenario, or --reference REPEATS alone")
    if args.reference is not None:
        return _estimated_problems(args)
    accuracy = Accuracy(args.relative, args.most, args.size, args.score, args.method)
    with common.workers_of(args) as jobs:
        found = certify(args.scenario, common.changes_of(args), jobs, args.out, accuracy, common.progress, common.warn)
    document = document_of(found.as_dict())
    write_markdown(document, found.folder, "certify.md")
    common.answer(args, found.as_dict(), document)
    return common.DONE if found.reached else common.UNDECIDED


def _estimated_problems(args: argparse.Namespace) -> int:
    from biped.show.certify import reference_document
    from biped.studies.certify.reference import validate

    if args.reference < 2:
        raise InputError(f"--reference {args.reference}: expected at least 2 repeats")
    with common.workers_of(args) as jobs:
        found = [one._asdict() for one in validate(args.reference, jobs, args.method, common.progress)]
    common.answer(args, {"problems": found}, reference_document(found))
    return common.DONE


def add_find(commands: common.Commands) -> None:
    """Adds the parser of `biped find`."""
    parser = common.command_parser(
        commands, "find", "search for distinct ways to fall, and write each as a scenario", find_command,
        simulates=True,
        description="Searches for runs of a scenario that fall, also where falls are rare. For each way to fall it "
        "keeps the likeliest run, makes it likelier while it still falls in the same way, and writes it as a "
        "scenario for CI. With --out an interrupted command is continued. Exit code 1: something falls.",
    )  # fmt: skip
    parser.add_argument("scenario", help="name in scenarios/, or path of a scenario file")
    common.take_changes(parser)
    common.take_engine(parser)
    against = "only falls in which another gait or law stays up: the key to change, e.g. controller=robust"
    parser.add_argument("--against", metavar="KEY=VALUE", help=against)
    parser.add_argument(
        "--failures", type=common.whole, default=10, help="largest number of ways to fall (default: 10)"
    )
    parser.add_argument(
        "--most", type=common.whole, default=3000, help="largest number of runs of the search (default: 3000)"
    )
    parser.add_argument("--out", type=Path, help="results folder; the same command continues what was interrupted")
    common.take_running(parser)


def find_command(args: argparse.Namespace) -> int:
    """Finds ways to fall; what an interrupt leaves is gone on with by the same command."""
    from biped.show.certify import ways_document
    from biped.show.document import write_markdown
    from biped.studies.find import find

    with common.workers_of(args) as jobs:
        found = find(
            args.scenario,
            common.changes_of(args),
            args.against,
            jobs,
            args.out,
            args.failures,
            args.most,
            common.progress,
            common.warn,
        )
    document = ways_document(found.as_dict())
    write_markdown(document, found.folder, "find.md")
    common.answer(args, found.as_dict(), document)
    return common.FAILED if found.found else common.DONE


def add_stability(commands: common.Commands) -> None:
    """Adds the parser of `biped stability`."""
    what = "analyse a gait as a limit cycle: return map and Floquet multipliers"
    parser = common.command_parser(commands, "stability", what, stability_command, simulates=True)
    parser.add_argument("scenario", nargs="?", help="name in scenarios/, or path of a scenario file")
    parser.add_argument(
        "--reference", action="store_true", help="test the method: solve walkers whose multipliers are known"
    )
    common.take_changes(parser)
    common.take_trust(parser)
    parser.add_argument("--engine", choices=list(ENGINES), help="use only this engine (default: mujoco, then home)")
    parser.add_argument(
        "--basin", action="store_true", help="also compute a section of the basin of attraction, over lean and speed"
    )
    growth = "only compute how pushes of one tick grow from stride to stride; for any robot, law and engine"
    parser.add_argument("--growth", action="store_true", help=growth)
    norm = "only compute the gait sensitivity norm: how much a small push or step changes the steps after it"
    parser.add_argument("--norm", action="store_true", help=norm)
    common.take_workers(parser)
    parser.add_argument("--out", type=Path, help="folder for figure and numbers (default: a new one below runs/)")
    common.take_json(parser)


def stability_command(args: argparse.Namespace) -> int:
    """Studies a scenario's gait, or solves the walkers whose multipliers are known."""
    if args.reference == (args.scenario is not None):
        raise InputError("stability: expected a scenario, or --reference alone")
    if args.growth or args.norm:
        return _small(args)
    return _known_cycles(args) if args.reference else _gait(args)


def _small(args: argparse.Namespace) -> int:
    """Small disturbances of any walk: their growth, or what they do to its steps."""
    from biped.show.stability import growth_document, sensitivity_document
    from biped.studies.stability.growth import growth
    from biped.studies.stability.sensitivity import sensitivity

    if args.reference or args.basin or (args.growth and args.norm):
        raise InputError("stability: expected --growth or --norm, and with it neither --reference nor --basin")
    with common.workers_of(args) as jobs:
        if args.growth:
            found = growth(args.scenario, common.changes_of(args), jobs)
            document = growth_document(found)
        else:
            found = sensitivity(args.scenario, common.changes_of(args), jobs)
            document = sensitivity_document(found)
    common.answer(args, found.as_dict(), document)
    return common.DONE


def _known_cycles(args: argparse.Namespace) -> int:
    from biped.show.stability import known_document
    from biped.studies.stability.reference import solve_all

    cycles = solve_all()
    common.answer(args, {name: known.as_dict() for name, known in cycles.items()}, known_document(cycles))
    return common.DONE


def _gait(args: argparse.Namespace) -> int:
    from biped.base.writing import dumps, may_fill, write_text
    from biped.ensemble.guard import complaining
    from biped.show.document import Paragraph
    from biped.show.figures.studies import plot_stability
    from biped.show.stability import document_of
    from biped.studies.stability import study

    if args.out is not None:
        may_fill(args.out, "--out", ("stability.json",))
    engines = (MUJOCO, HOME) if args.engine is None else (args.engine,)
    with common.workers_of(args) as jobs:
        studied = study(args.scenario, args.changes, engines, jobs, args.basin)
    result = studied.as_dict()
    folder = common.folder_of(args, f"{studied.scenario}-stability")
    plot_stability(studied, folder)
    if args.basin:
        from biped.show.figures.studies import plot_basin

        plot_basin(studied, folder)
    with complaining(folder / "stability.json"):
        write_text(folder / "stability.json", dumps(result, indent=1))
    common.answer(args, result, (*document_of(studied), Paragraph(f"results in {folder}/")))
    return common.DONE if studied.stable else common.FAILED


def add_standard(commands: common.Commands) -> None:
    """Adds the parser of `biped standard`."""
    parser = common.command_parser(
        commands, "standard", "search for the largest slopes, pushes and steps that gaits withstand", standard_command,
        description="Searches for the largest value of each test in scenarios/standard that a gait withstands, by "
        "ensembles with intervals, and puts all gaits into one table. With --out an interrupted table is continued.",
    )  # fmt: skip
    parser.add_argument("gait", nargs="+", help="a gait: name in controllers/ or path; or a law for any robot: its "
        "name, path.py:Class, or a policy's card")  # fmt: skip
    parser.add_argument("--test", metavar="NAME", action="append", default=[], help="only this test: name in "
        "scenarios/standard, path of a scenario with [standard], or a folder of them that ends in /, e.g. "
        "upright/cells/ (repeatable)")  # fmt: skip
    parser.add_argument(
        "--atlas",
        action="store_true",
        help="all of a row of docs/atlas.md instead: its tests, the growth of small pushes, the gait sensitivity norm",
    )
    common.take_changes(parser, "change a key of all tests, e.g. model=robot (repeatable)")
    common.take_engine(parser)
    parser.add_argument(
        "--engines", metavar="E,E", help="test in several engines, e.g. mujoco,home; each has its own column"
    )
    parser.add_argument("--out", type=Path, help="folder for standard.json and standard.md (default: below runs/)")
    common.take_running(parser)


def standard_command(args: argparse.Namespace) -> int:
    """Puts gaits to the tests; what an interrupt leaves is gone on with by the same command."""
    from biped.show.atlas import rows_of
    from biped.show.document import Paragraph
    from biped.show.standing import document_of, write
    from biped.studies.standard import standard

    engines = common.engines_of(args)
    if args.atlas and (args.test or engines):
        raise InputError("--atlas: expected neither --test nor --engines: a row has tests of its own")
    out = common.folder_of(args, "standard")
    with common.workers_of(args) as jobs:
        if args.atlas:
            from biped.studies.standard.atlas import atlas

            found = atlas(args.gait, common.changes_of(args), jobs, out, common.progress)
        else:
            found = standard(
                args.gait, args.test, common.changes_of(args), jobs, out, common.progress, engines
            ).as_dict()
    write(found, out)
    document = rows_of(found) if args.atlas else document_of(found)
    common.answer(args, found, (*document, Paragraph(f"standard.json and standard.md in {label(out)}/")))
    return common.DONE
