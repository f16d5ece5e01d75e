"""`biped check`: runs scenarios and compares them with what they expect."""

import argparse
from itertools import product
from pathlib import Path
from time import perf_counter

from biped.base.errors import InputError
from biped.base.replacing import may_write
from biped.cli.common import changes_of, code_of, engines_of, print_all, warn, workers_of
from biped.cli.parser import Commands, command_parser, take_same_platform, take_scenarios


def add(commands: Commands) -> None:
    """Adds the parser of `biped check`."""
    parser = command_parser(
        commands, "check", "run scenarios and compare the results with what they expect", command, simulates=True
    )
    take_scenarios(parser)
    take_same_platform(parser)
    parser.add_argument("--engines", metavar="E,E", help="check in several engines, e.g. mujoco,drake; all must pass")
    parser.add_argument("--junit", type=Path, metavar="FILE", help="also write JUnit XML")
    parser.add_argument("--summary", type=Path, metavar="FILE", help="also write a table in Markdown, for a CI summary")


def command(args: argparse.Namespace) -> int:
    """Checks scenarios; nothing is written but the files that are asked for."""
    from biped.ensemble.checks import JUNIT, write_junit
    from biped.show.results import KIND as SUMMARY
    from biped.show.results import verdict_of, write_summary
    from biped.show.terminal import progress, show
    from biped.studies.folders import writing
    from biped.studies.planned import plan_of
    from biped.studies.run import run

    for path, option, kind in ((args.junit, "--junit", JUNIT), (args.summary, "--summary", SUMMARY)):
        if path is not None:
            may_write(path, option, kind)
            if not path.absolute().parent.is_dir():
                raise InputError(f"{option} {path}: cannot be written: expected a file in a folder that exists")
    engines = [[f"engine={name}"] for name in engines_of(args)] or [[]]
    for name in args.scenario:
        if not plan_of(name, changes_of(args)).scenario.expect:
            raise InputError(f"{name}: expect: missing; a scenario to check says what it expects, e.g. "
                             "falls = { max = 0 }")  # fmt: skip
    results, seconds = [], []
    with workers_of(args) as jobs:
        for name, engine in product(args.scenario, engines):
            same, begun = args.same_platform, perf_counter()
            done = run(name, [*changes_of(args), *engine], jobs, None, write=False, progress=progress, tell=warn,
                       same=same)  # fmt: skip
            seconds.append(perf_counter() - begun)
            results.append(done.result)
            if not args.json:
                words = [done.plan.scenario.description, f"in {done.plan.scenario.engine}" if len(engines) > 1 else ""]
                show(verdict_of(done.result, ", ".join(filter(None, words))))
    if args.junit is not None:
        with writing(f"--junit {args.junit}"):
            write_junit(args.junit, results, seconds)
    if args.summary is not None:
        with writing(f"--summary {args.summary}"):
            write_summary(args.summary, results)
    if args.json:
        print_all(results)
    return code_of(results)
