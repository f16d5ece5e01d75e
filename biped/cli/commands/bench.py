"""`biped bench`: run time against error, and what things cost."""

import argparse
from importlib import import_module
from pathlib import Path

from biped.base.replacing import may_add
from biped.cli.common import DONE, FAILED, answer, reason_of, warn
from biped.cli.parser import Commands, command_parser, take_json


def add(commands: Commands) -> None:
    """Adds the parser of `biped bench`."""
    parser = command_parser(commands, "bench", "measure run time, accuracy and cost", command)
    what = (
        "what to measure. throughput: ticks a second, and the cost of each feature; walking: accuracy of a walk "
        "against run time; mechanisms: the same of chapter II's mechanisms; tolerances: error of adaptive steps "
        "against their tolerance; robot: the bench experiments of Figs 4.7 and 4.8; campaigns: processes here "
        "against a cluster; policy: a learned policy against bare steps and network calls; engines: a step in Drake "
        "against one in MuJoCo; regress: whether a recorded result or cost changed"
    )
    parser.add_argument("what", choices=list(BENCHES), help=what)
    parser.add_argument("--out", type=Path, help="folder for the figures of walking, mechanisms, tolerances, robot")
    quick = (
        "mechanisms: fewer repeats and settings; throughput: without scenes and costs of features; campaigns: fewer "
        "runs; policy: without the many runs"
    )
    parser.add_argument("--quick", action="store_true", help=quick)
    parser.add_argument("--update", action="store_true", help="regress: record the costs measured now")
    parser.add_argument("--reason", help="regress: why costs changed (needed by --update)")
    file = (
        "regress: file of references (default: that of the shipped scenarios); policy: a card (default: that of the "
        "shipped policy)"
    )
    parser.add_argument("--file", type=Path, help=file)
    take_json(parser)


def command(args: argparse.Namespace) -> int:
    """Measures one thing."""
    if args.out is not None:
        may_add(args.out, "--out")
    return BENCHES[args.what](args)


def _throughput(args: argparse.Namespace) -> int:
    from biped.show.bench import show_throughput
    from biped.show.replay import record_runs
    from biped.studies.bench.throughput import everything

    measured = everything(args.quick, record_runs)
    answer(args, measured.as_dict(), show_throughput, measured)
    return DONE


def _walking(args: argparse.Namespace) -> int:
    from biped.show.bench import show_walking
    from biped.studies.bench.walking import compare

    result = compare()
    if args.out is not None:
        from biped.show.figures.walking import plot_walking

        plot_walking(result, args.out)
    answer(args, result, show_walking, result)
    return DONE


def _chapter2(args: argparse.Namespace) -> int:
    """Hands over to the benches of chapter II, a library of its own that only whoever asks for it loads."""
    options = [*(["--quick"] if args.quick else []), *(["--json"] if args.json else [])]
    folder = [] if args.out is None else ["--out", str(args.out)]
    return import_module("biped.dynamics.bench.__main__").main([args.what, *options, *folder])


def _campaigns(args: argparse.Namespace) -> int:
    from biped.show.bench import show_campaigns
    from biped.studies.bench.campaigns import measure

    costs = measure(args.quick, warn)
    answer(args, {"campaigns": [cost.as_dict() for cost in costs]}, show_campaigns, costs)
    return DONE if all(cost.same for cost in costs) else FAILED


def _policy(args: argparse.Namespace) -> int:
    from biped.show.bench import show_policy
    from biped.studies.bench.policy import SHIPPED, policy_cost

    card = SHIPPED if args.file is None else args.file
    cost = policy_cost(card, args.quick)
    answer(args, {"card": str(card), **cost._asdict()}, show_policy, card, cost)
    return DONE


def _engines(args: argparse.Namespace) -> int:
    from biped.show.bench import show_engines
    from biped.studies.bench.engines import step_costs

    costs = step_costs()
    answer(args, {kind: cost.as_dict() for kind, cost in costs.items()}, show_engines, costs)
    return DONE


def _regress(args: argparse.Namespace) -> int:
    from biped.show.bench import show_regress
    from biped.studies.bench.regress import guard

    guarded = guard(args.file, reason_of(args))
    answer(args, guarded.as_dict(), show_regress, guarded)
    return DONE if guarded.passed else FAILED


BENCHES = {
    "throughput": _throughput,
    "walking": _walking,
    "mechanisms": _chapter2,
    "tolerances": _chapter2,
    "robot": _chapter2,
    "campaigns": _campaigns,
    "policy": _policy,
    "engines": _engines,
    "regress": _regress,
}
"""Benchmarks by name, and the functions that run them."""
