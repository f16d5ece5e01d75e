"""`biped compare`, `diff`, `regress` and `readings`: results beside others, recorded ones and the thesis."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from biped.base.errors import InputError
from biped.base.files import label
from biped.base.writing import may_fill, may_write
from biped.cli import common
from biped.scenario.engines import ENGINES, engines_named

if TYPE_CHECKING:
    from biped.studies.causes import Why
    from biped.studies.comparison import Comparison


def add_compare(commands: common.Commands) -> None:
    """Adds the parser of `biped compare`."""
    what = "run scenarios in several engines and show every metric side by side"
    parser = common.command_parser(commands, "compare", what, compare_command)
    common.take_scenarios(parser)
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


def compare_command(args: argparse.Namespace) -> int:
    """Compares scenarios; each leaves numbers, figures and a recording."""
    from biped.show.comparisons import comparison_document, draw
    from biped.studies.comparison import DEFAULT, OWN, compare, write
    from biped.studies.run import title_of

    if args.against:
        return _against(args)
    if args.engine is not None:
        raise InputError("--engine: compare runs several engines; expected --engines")
    engines = DEFAULT if args.engines is None else tuple(engines_named(args.engines))
    common.one_folder(args)
    if args.out is not None:
        may_fill(args.out, "--out", OWN)
    made = []
    with common.workers_of(args) as jobs:
        for name in args.scenario:
            title = title_of(name)
            made.append(compare(name, title, args.changes, jobs, engines))
            where = common.folder_of(args, f"compare-{title}")
            write(made[-1], where)
            draw(made[-1], where)
            if not args.json:
                print(f"figures, recording and numbers in {where}/")
    results = [one.as_dict() for one in made]
    if not args.json:
        common.show(comparison_document(made))
    for one, result in zip(made, results, strict=True) if args.why else ():
        result["why"] = [found.as_dict() for found in _why(one, args)]
    if args.json:
        common.print_all(results)
    return common.DONE if all(result["passed"] for result in results) else common.FAILED


def _why(comparison: Comparison, args: argparse.Namespace) -> Iterator[Why]:
    """The causes of what parts one engine from each of the others."""
    from biped.show.comparisons import causes_document
    from biped.studies.causes import causes, movable

    moved = movable(comparison.engines)
    for engine, towards in comparison.first.items():
        if engine != moved:
            changes = [*args.changes, f"engine={moved}"]
            found = causes(comparison.scenario, changes, towards, moved, engine)
            if not args.json:
                common.show(causes_document(found))
            yield found


def _against(args: argparse.Namespace) -> int:
    """The causes of what parts a setting of an engine from another."""
    from biped.ensemble.campaign import simulate
    from biped.show.comparisons import causes_document
    from biped.studies.causes import causes, movable
    from biped.studies.run import plan_of, title_of

    if args.engines is not None or args.out is not None:
        raise InputError("--against: expected without --engines and --out: one engine is compared with itself")
    own, found = common.changes_of(args), []
    for name in args.scenario:
        towards = simulate(plan_of(name, [*own, *args.against]).run(0))
        engine = plan_of(name, own).scenario.engine
        movable([engine])
        found.append(causes(name, own, towards, title_of(name), " ".join(args.against)))
        if not args.json:
            common.show(causes_document(found[-1]))
    if args.json:
        common.print_all([one.as_dict() for one in found])
    return common.DONE


def add_diff(commands: common.Commands) -> None:
    """Adds the parser of `biped diff`."""
    parser = common.command_parser(
        commands, "diff", "compare two results, gaits or laws, run by run", diff_command,
        description="Compares two results folders, or runs a scenario with each of two gaits or laws and compares "
        "them. Runs are paired by seed, and every metric has its change with an interval. Exit code 1: something "
        "became worse.",
    )  # fmt: skip
    first = "before: a results folder, a gait (name or path), a law (path.py:Class) or a policy's card"
    parser.add_argument("first", help=first)
    parser.add_argument("second", help="after: the same kind of thing")
    parser.add_argument("--scenario", help="the scenario to run with both gaits or laws: name in scenarios/ or path")
    common.take_changes(parser, "change a key of that scenario (repeatable)")
    parser.add_argument("--metrics", metavar="NAME,…", default="", help="compare only these metrics (default: all)")
    margin = "a smaller relative change does not matter (default: 0.05)"
    parser.add_argument("--margin", type=float, default=0.05, help=margin)
    sequential = "run pair after pair until it is decided which gait or law walks more often"
    parser.add_argument("--sequential", action="store_true", help=sequential)
    parser.add_argument(
        "--error",
        type=common.number,
        default=0.05,
        help="with --sequential: probability of a wrong decision (default: 0.05)",
    )
    ratio = (
        "with --sequential: one is better if it alone walks in this many times as many pairs as the other alone does "
        "(default: 3)"
    )
    parser.add_argument("--ratio", type=common.number, default=3.0, help=ratio)
    parser.add_argument(
        "--most", type=common.whole, default=500, help="with --sequential: largest number of pairs (default: 500)"
    )
    parser.add_argument(
        "--out",
        type=Path,
        help="folder for diff.json and diff.md (for gaits and laws by default a new one below runs/)",
    )
    parser.add_argument("--html", type=Path, metavar="FILE", help="also write an HTML page")
    common.take_running(parser)


def diff_command(args: argparse.Namespace) -> int:
    """Compares; worse is a failure, what cannot be said is not."""
    from biped.base.statistics import Rates
    from biped.show.comparisons import difference_document, write
    from biped.studies.diff import of_controllers, of_folders, until_decided

    only = [name.strip() for name in args.metrics.split(",") if name.strip()]
    folders = [Path(word) for word in (args.first, args.second)]
    stored = [(folder / "result.json").is_file() for folder in folders]
    out: Path | None = args.out
    if out is not None:
        may_fill(out, "--out", ("diff.json", "first", "second"))
    if args.html is not None:
        from biped.show.page import KIND

        may_write(args.html, "--html", KIND)
    if args.sequential and (any(stored) or only):
        raise InputError("--sequential: expected two gaits or laws and a --scenario, and no --metrics")
    if all(stored):
        if args.scenario is not None or args.changes:
            raise InputError("diff: --scenario and --set: expected with gaits or laws only, results are what they are")
        found = of_folders(folders[0], folders[1], args.margin, only)
    else:
        _same_kind(args, stored)
        if args.scenario is None:
            raise InputError(
                "diff: --scenario missing; expected what to run with each gait, e.g. --scenario level_fast --set "
                "randomise.runs=50 --set start.jitter=0.002"
            )
        with common.workers_of(args) as jobs:
            what = args.first, args.second, args.scenario, args.changes, jobs, out
            if args.sequential:
                rates = Rates(args.error, args.ratio)
                found, out = until_decided(*what, rates, args.most, args.margin, common.progress, common.warn)
            else:
                found, out = of_controllers(*what, args.margin, only, common.progress, common.warn)
    if out is not None:
        write(found, out)
    if args.html is not None:
        from biped.show.page import write_sections
        from biped.show.page.comparisons import section_of_difference

        write_sections([section_of_difference(found.as_dict())], args.html, "What changed")
    if args.json:
        common.print_json(found.as_dict())
    else:
        common.show(difference_document(found))
        if out is not None:
            print(f"  diff.json and diff.md in {label(out)}/")
        if args.html is not None:
            print(f"  page in {label(args.html)}")
    return common.DONE if found.passed else common.FAILED


def _same_kind(args: argparse.Namespace, stored: list[bool]) -> None:
    """Refuses a results folder beside a gait, and a folder that holds no results.

    Raises:
        InputError: So it is.
    """
    for word, there in zip((args.first, args.second), stored, strict=True):
        folder = Path(word)
        if any(stored) and not there:
            raise InputError(f"{word}: expected a results folder (with result.json) as the other is")
        if not there and folder.is_dir():
            raise InputError(f"{word}: expected a results folder (with result.json), got another folder")


def add_regress(commands: common.Commands) -> None:
    """Adds the parser of `biped regress`."""
    parser = common.command_parser(
        commands, "regress", "compare scenarios with their recorded reference numbers", regress_command, simulates=True,
        description="Runs a fixed part of each scenario and compares with recorded numbers: digit by digit on the "
        "kind of machine that recorded them, and within physical tolerances elsewhere.",
    )  # fmt: skip
    parser.add_argument("scenario", nargs="*", help="name in scenarios/, or path (default: every shipped scenario)")
    parser.add_argument("--update", action="store_true", help="record the numbers that differ as the new reference")
    parser.add_argument("--reason", help="why results changed; kept in the file (needed by --update)")
    engine = "run all scenarios in this engine and compare with its references (default: each in its own engine)"
    parser.add_argument("--engine", choices=list(ENGINES), help=engine)
    parser.add_argument("--file", type=Path, help="file of references (default: the one of the shipped scenarios)")
    parser.add_argument("--markdown", action="store_true", help="print what changed as Markdown, sorted by cause")
    common.take_running(parser)


def regress_command(args: argparse.Namespace) -> int:
    """Compares, and records where that was asked for."""
    from biped.show.references import document_of, moved_table
    from biped.studies.regress import regress

    with common.workers_of(args) as jobs:
        outcome = regress(args.scenario, jobs, args.file, common.reason_of(args), common.progress, args.engine)
    if args.markdown and not args.json:
        print(moved_table(outcome))
    else:
        common.answer(args, outcome.as_dict(), document_of(outcome.as_dict()))
    if outcome.stopped:
        raise KeyboardInterrupt
    return common.DONE if outcome.passed else common.FAILED


def add_readings(commands: common.Commands) -> None:
    """Adds the parser of `biped readings`."""
    parser = common.command_parser(
        commands, "readings", "compare readings of the thesis with the numbers that it prints", readings_command,
        description="Compares readings of the thesis with all numbers that it prints, then confirms the best and the "
        "shipped ones on seeds that no search has used. With --out an interrupted study is continued.",
    )  # fmt: skip
    parser.add_argument("--tries", type=common.whole, default=100, help="readings to try (default: 100)")
    runs = "runs of each claim in the confirmation (default: 30)"
    parser.add_argument("--confirm", metavar="RUNS", type=common.whole, default=30, help=runs)
    out = "folder for journals, readings.json and readings.md (default: below runs/)"
    parser.add_argument("--out", type=Path, help=out)
    common.take_workers(parser)
    common.take_json(parser)


def readings_command(args: argparse.Namespace) -> int:
    """Searches, then confirms; what an interrupt leaves is gone on with by the same command."""
    from biped.show.readings import confirmation, data_of, distribution, write
    from biped.studies.readings import confirm, search

    for name, count, least in (("--tries", args.tries, 0), ("--confirm", args.confirm, 1)):
        if count < least:
            raise InputError(f"{name} {count}: expected at least {least}")
    out = common.folder_of(args, "readings")
    with common.workers_of(args) as jobs:
        tried = search(args.tries, jobs, out, common.progress)
        confirmed = confirm(tried, args.confirm, jobs, out, common.progress)
    found = data_of(tried, confirmed)
    write(found, out)
    if args.json:
        common.print_json(found)
    else:
        print(f"{distribution(tried)}\n\n{confirmation(confirmed)}\n\n  readings.json and readings.md in {label(out)}/")
    return common.DONE
