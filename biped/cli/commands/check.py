"""`biped check`: runs scenarios and compares them with what they expect."""

from __future__ import annotations

import argparse
from pathlib import Path

from biped.base.errors import InputError
from biped.base.replacing import may_write
from biped.base.writing import reason
from biped.cli.common import changes_of, code_of, print_all, warn, workers_of
from biped.cli.parser import Commands, command_parser, take_same_platform, take_scenarios


def add(commands: Commands) -> None:
    """Adds the parser of `biped check`."""
    parser = command_parser(commands, "check", "run scenarios and compare with their [expect]", command, simulates=True)
    take_scenarios(parser)
    take_same_platform(parser)
    parser.add_argument("--junit", type=Path, metavar="FILE", help="also write JUnit XML")


def command(args: argparse.Namespace) -> int:
    """Checks scenarios; nothing is written but the JUnit file."""
    from biped.ensemble.checks import JUNIT, write_junit
    from biped.show.results import verdict_of
    from biped.show.terminal import progress, show
    from biped.studies.planned import plan_of
    from biped.studies.run import run

    if args.junit is not None:
        may_write(args.junit, "--junit", JUNIT)
        if not args.junit.absolute().parent.is_dir():
            raise InputError(f"--junit {args.junit}: cannot be written: expected a file in a folder that exists")
    for name in args.scenario:
        if not plan_of(name, changes_of(args)).scenario.expect:
            raise InputError(f"{name}: expect: missing; a scenario to check says what it expects, e.g. "
                             "falls = { max = 0 }")  # fmt: skip
    results = []
    with workers_of(args) as jobs:
        for name in args.scenario:
            same = args.same_platform
            done = run(name, changes_of(args), jobs, None, write=False, progress=progress, tell=warn, same=same)
            results.append(done.result)
            if not args.json:
                show(verdict_of(done.result, done.plan.scenario.description))
    if args.junit is not None:
        try:
            write_junit(args.junit, results)
        except OSError as error:
            raise InputError(f"--junit {args.junit}: cannot be written: {reason(error)}") from None
    if args.json:
        print_all(results)
    return code_of(results)
