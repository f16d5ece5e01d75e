"""`biped bench`: run time against error, and what things cost."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Mapping
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

from biped.base.errors import InputError
from biped.base.writing import may_add
from biped.cli import common

if TYPE_CHECKING:
    from biped.show.document import Document


def add_bench(commands: common.Commands) -> None:
    """Adds the parser of `biped bench`."""
    parser = common.command_parser(commands, "bench", "measure run time, accuracy and cost", bench_command)
    what = (
        "what to measure. throughput: ticks a second, and the cost of each feature; walking: accuracy of a walk "
        "against run time; mechanisms: the same of chapter II's mechanisms; tolerances: error of adaptive steps "
        "against their tolerance; robot: the bench experiments of Figs 4.7 and 4.8; campaigns: processes here "
        "against a cluster; policy: a learned policy against bare steps and network calls; engines: a step in Drake "
        "against one in MuJoCo; mechanics: walks by who computes the law's matrices; regress: whether a recorded "
        "result or cost changed"
    )
    parser.add_argument("what", choices=[*list(BENCHES)[:2], *CHAPTER_2, *list(BENCHES)[2:]], help=what)
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
    common.take_changes(
        parser, "mechanics: walk any/cells/level with this change, e.g. model=robot.xml (VALUE is TOML; repeatable)"
    )
    common.take_json(parser)


def bench_command(args: argparse.Namespace) -> int:
    """Measures one thing."""
    if args.out is not None:
        may_add(args.out, "--out")
    if args.changes and args.what != "mechanics":
        raise InputError(f"--set: expected none for {args.what}; mechanics takes it")
    if args.what in CHAPTER_2:
        options = [*(["--quick"] if args.quick else []), *(["--json"] if args.json else [])]
        folder = [] if args.out is None else ["--out", str(args.out)]
        return import_module("biped.dynamics.bench.__main__").main([args.what, *options, *folder])
    found, document, passed = BENCHES[args.what](args)
    common.answer(args, found, document)
    return common.DONE if passed else common.FAILED


Measured: TypeAlias = "tuple[Mapping[str, Any], Document, bool]"
"""Plain data, the same as a document, and whether all is well."""


def _throughput(args: argparse.Namespace) -> Measured:
    from biped.show.replay import record_runs
    from biped.show.studies import throughput_document
    from biped.studies.bench.throughput import everything

    measured = everything(args.quick, record_runs)
    return measured.as_dict(), throughput_document(measured), True


def _walking(args: argparse.Namespace) -> Measured:
    from biped.show.studies import walking_document
    from biped.studies.bench.walking import compare

    result = compare()
    if args.out is not None:
        from biped.show.figures.studies import plot_walking

        plot_walking(result, args.out)
    return result, walking_document(result), True


def _campaigns(args: argparse.Namespace) -> Measured:
    from biped.show.studies import campaigns_document
    from biped.studies.bench.costs import campaign_costs

    costs = campaign_costs(args.quick, common.warn)
    same = all(cost.same for cost in costs)
    return {"campaigns": [cost.as_dict() for cost in costs]}, campaigns_document(costs), same


def _policy(args: argparse.Namespace) -> Measured:
    from biped.show.studies import policy_document
    from biped.studies.bench.costs import SHIPPED, policy_cost

    card = SHIPPED if args.file is None else args.file
    cost = policy_cost(card, args.quick)
    return {"card": str(card), **cost._asdict()}, policy_document(card, cost), True


def _engines(args: argparse.Namespace) -> Measured:
    from biped.show.studies import engines_document
    from biped.studies.bench.costs import step_costs

    costs = step_costs()
    return {kind: cost.as_dict() for kind, cost in costs.items()}, engines_document(costs), True


def _mechanics(args: argparse.Namespace) -> Measured:
    from biped.show.studies import costs_document
    from biped.studies.bench.scenes import mechanics_costs

    costs = mechanics_costs(args.changes)
    return costs, costs_document("by who computes the law's mechanics", "run", costs), True


def _regress(args: argparse.Namespace) -> Measured:
    from biped.show.studies import regress_document
    from biped.studies.bench.throughput import guard

    guarded = guard(args.file, common.reason_of(args))
    return guarded.as_dict(), regress_document(guarded), guarded.passed


CHAPTER_2 = ("mechanisms", "tolerances", "robot")
"""Benchmarks of chapter II, a library of its own that only whoever asks for it loads."""
BENCHES: dict[str, Callable[[argparse.Namespace], Measured]] = {
    "throughput": _throughput, "walking": _walking, "campaigns": _campaigns, "policy": _policy, "engines": _engines,
    "mechanics": _mechanics,
    "regress": _regress,
}  # fmt: skip
"""The others by name, and the functions that run them."""
