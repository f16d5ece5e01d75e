"""`biped compare`: the same scenario in several engines, and why they differ."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from biped.base.errors import InputError
from biped.base.replacing import may_fill
from biped.cli.common import DONE, FAILED, changes_of, one_folder, print_all, workers_of
from biped.cli.parser import Commands, command_parser, take_scenarios

if TYPE_CHECKING:
    from biped.studies.causes import Why
    from biped.studies.comparison import Comparison


def add(commands: Commands) -> None:
    """Adds the parser of `biped compare`."""
    what = "run scenarios in several engines and show every metric side by side"
    parser = command_parser(commands, "compare", what, command)
    take_scenarios(parser)
    parser.add_argument(
        "--engines", metavar="E,E", help="engines to compare, e.g. mujoco,home,drake (default: home,mujoco)"
    )
    parser.add_argument(
        "--why",
        action="store_true",
        help="find out why they differ: change one physical cause at a time until they agree",
    )
    against = "compare with another setting of a key instead of another engine, and find out why they differ"
    parser.add_argument("--against", metavar="KEY=VALUE", action="append", default=[], help=against)
    parser.add_argument("--out", type=Path, help="folder for figures and recordings (default: new ones below runs/)")


def command(args: argparse.Namespace) -> int:
    """Compares scenarios; each leaves numbers, figures and a recording."""
    from biped.ensemble.guard import new_folder
    from biped.scenario.engines import engines_named
    from biped.show.side_by_side import document_of, draw
    from biped.show.terminal import show
    from biped.studies.comparison import DEFAULT, OWN, compare, write
    from biped.studies.folders import RUNS
    from biped.studies.planned import title_of

    if args.against:
        return _against(args)
    if args.engine is not None:
        raise InputError("--engine: compare runs several engines; expected --engines")
    engines = DEFAULT if args.engines is None else tuple(engines_named(args.engines))
    one_folder(args)
    if args.out is not None:
        may_fill(args.out, "--out", OWN)
    made = []
    with workers_of(args) as jobs:
        for name in args.scenario:
            title = title_of(name)
            made.append(compare(name, title, args.changes, jobs, engines))
            where = args.out or new_folder(RUNS, f"compare-{title}")
            write(made[-1], where)
            draw(made[-1], where)
            if not args.json:
                print(f"figures, recording and numbers in {where}/")
    results = [one.as_dict() for one in made]
    if not args.json:
        show(document_of(made))
    for one, result in zip(made, results, strict=True) if args.why else ():
        result["why"] = [found.as_dict() for found in _why(one, args)]
    if args.json:
        print_all(results)
    return DONE if all(result["passed"] for result in results) else FAILED


def _why(comparison: Comparison, args: argparse.Namespace) -> Iterator[Why]:
    """The causes of what parts one engine from each of the others."""
    from biped.show.side_by_side import causes_document
    from biped.show.terminal import show
    from biped.studies.causes import causes, movable

    moved = movable(comparison.engines)
    for engine, towards in comparison.first.items():
        if engine != moved:
            changes = [*args.changes, f"engine={moved}"]
            found = causes(comparison.scenario, changes, towards, moved, engine)
            if not args.json:
                show(causes_document(found))
            yield found


def _against(args: argparse.Namespace) -> int:
    """The causes of what parts a setting of an engine from another."""
    from biped.ensemble.campaign import simulate
    from biped.show.side_by_side import causes_document
    from biped.show.terminal import show
    from biped.studies.causes import causes, movable
    from biped.studies.planned import plan_of, title_of

    if args.engines is not None or args.out is not None:
        raise InputError("--against: expected without --engines and --out: one engine is compared with itself")
    own, found = changes_of(args), []
    for name in args.scenario:
        towards = simulate(plan_of(name, [*own, *args.against]).run(0))
        engine = plan_of(name, own).scenario.engine
        movable([engine])
        found.append(causes(name, own, towards, title_of(name), " ".join(args.against)))
        if not args.json:
            show(causes_document(found[-1]))
    if args.json:
        print_all([one.as_dict() for one in found])
    return DONE
