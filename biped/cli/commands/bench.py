"""`biped bench`: run time against error, and what things cost."""

from __future__ import annotations

import argparse
import sys

from biped.cli.common import DONE, FAILED, print_json, reason_of, warn


def command(args: argparse.Namespace) -> int:
    """Measures one thing."""
    return {
        "throughput": _throughput,
        "walking": _walking,
        "mechanisms": _mechanisms,
        "tolerances": _tolerances,
        "robot": _robot,
        "campaigns": _campaigns,
        "regress": _regress,
    }[args.what](args)


def _throughput(args: argparse.Namespace) -> int:
    from biped.show.bench.throughput import show
    from biped.show.replay import record_runs
    from biped.studies.bench.throughput import everything

    measured = everything(args.quick, record_runs)
    if args.json:
        print_json(measured.as_dict())
    else:
        show(measured)
    return DONE


def _walking(args: argparse.Namespace) -> int:
    from biped.show.bench.walking import show
    from biped.studies.bench.walking import compare

    result = compare()
    if args.out is not None:
        from biped.show.figures.walking import plot_walking

        plot_walking(result, args.out)
    if args.json:
        print_json(result)
    else:
        show(result)
    return DONE


def _mechanisms(args: argparse.Namespace) -> int:
    from dataclasses import asdict

    from biped.show.bench.mechanisms import draw, show
    from biped.studies.bench.mechanisms import measure

    watched = sys.stderr.isatty()
    report = measure(args.quick, lambda line: print(line, file=sys.stderr) if watched else None)
    if args.json:
        print_json(asdict(report))
    else:
        show(report)
    if args.out is not None:
        draw(report, args.out)
    return DONE


def _robot(args: argparse.Namespace) -> int:
    from biped.studies.bench.robot import measure

    report = measure()
    if args.out is not None:
        from biped.show.figures.robot import plot_bench

        plot_bench(report, args.out)
    if args.json:
        print_json(report.as_dict())
    else:
        from biped.show.bench.robot import show

        show(report)
    return DONE


def _campaigns(args: argparse.Namespace) -> int:
    from biped.show.bench.campaigns import show
    from biped.studies.bench.campaigns import measure

    costs = measure(args.quick, warn)
    if args.json:
        print_json({"campaigns": [cost.as_dict() for cost in costs]})
    else:
        show(costs)
    return DONE if all(cost.same for cost in costs) else FAILED


def _tolerances(args: argparse.Namespace) -> int:
    from dataclasses import asdict

    from biped.show.bench.tolerances import show
    from biped.studies.bench.tolerances import measure

    watched = sys.stderr.isatty()
    reached = measure(progress=lambda line: print(line, file=sys.stderr) if watched else None)
    if args.json:
        print_json({"runs": [asdict(r) for r in reached]})
    else:
        show(reached)
    if args.out is not None:
        from biped.show.figures.tolerances import draw

        draw(reached, args.out)
    return DONE


def _regress(args: argparse.Namespace) -> int:
    from biped.show.bench.regress import show
    from biped.studies.bench.regress import guard

    guarded = guard(args.file, reason_of(args))
    if args.json:
        print_json(guarded.as_dict())
    else:
        show(guarded)
    return DONE if guarded.passed else FAILED
