"""`biped run`: runs scenarios and writes their results."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from biped.base.errors import InputError
from biped.cli.common import DONE, changes_of, code_of, one_folder, print_all, print_json, warn, workers_of
from biped.cli.parser import Commands, command_parser, take_same_platform, take_scenarios, whole

if TYPE_CHECKING:
    from biped.ensemble.plan import Plan
    from biped.measure.trajectory import Trajectory
    from biped.studies.making import ScenarioResult


def add(commands: Commands) -> None:
    """Adds the parser of `biped run`."""
    what = "run scenarios and write metrics and trajectories"
    parser = command_parser(commands, "run", what, command, simulates=True)
    take_scenarios(parser)
    parser.add_argument("--out", type=Path, help="results folder (default: a new one below runs/)")
    parser.add_argument("--record", action="store_true", help="also write a recording for the rerun viewer")
    live = "watch one run in MuJoCo's viewer in real time and push with the mouse; nothing is written"
    parser.add_argument("--live", action="store_true", help=live)
    parser.add_argument("--only", type=whole, metavar="N", help="run only run N of the ensemble, exactly as before")
    parser.add_argument("--shard", metavar="I/N", help="run share I of N of a campaign; all shares have the same --out")
    take_same_platform(parser)


def command(args: argparse.Namespace) -> int:
    """Runs scenarios one after the other."""
    from biped.show.terminal import progress
    from biped.studies.planned import plan_of
    from biped.studies.run import run

    if args.live:
        return _live(args)
    one_folder(args)
    if args.shard is not None:
        return _shard(args)
    if len(args.scenario) > 1:
        for name in args.scenario:  # before the first of them takes its time
            plan_of(name, changes_of(args))
    results = []
    with workers_of(args) as jobs:
        for name in args.scenario:
            done = run(
                name, changes_of(args), jobs, args.out, _record if args.record else None, args.only,
                progress=progress, tell=warn, same=args.same_platform,
            )  # fmt: skip
            results.append(done.result)
            _show(args, done)
    if args.json:
        print_all(results)
    return code_of(results)


def _live(args: argparse.Namespace) -> int:
    """One run in a window; what a hand pushes cannot be repeated, so nothing is kept of it."""
    from biped.show.live import watch
    from biped.studies.planned import plan_of

    for given, option in ((args.record, "--record"), (args.out, "--out"), (args.json, "--json")):
        if given:
            raise InputError(f"{option}: --live keeps nothing of a run that was pushed by hand; expected one of them")
    if len(args.scenario) > 1:
        raise InputError(f"--live: expected one scenario, got {len(args.scenario)}")
    plan = plan_of(args.scenario[0], changes_of(args))
    only = args.only or 0
    if not 0 <= only < len(plan):
        raise InputError(f"--only {only}: expected the number of a run, 0 … {len(plan) - 1}")
    seen = watch(plan, only, tell=print)
    print(f"{seen.said}; {seen.seconds:.2f} s, pushed by hand for {seen.pushed} ticks")
    return DONE


def _show(args: argparse.Namespace, done: ScenarioResult) -> None:
    from biped.ensemble.failures import FAILURES
    from biped.robot.safety import packaged
    from biped.scenario.options import differing
    from biped.show.results import document_of
    from biped.show.terminal import show
    from biped.studies.making import TRACEBACK

    if not args.json:
        show(document_of(done.result, done.plan.scenario.description))
        model, s = done.plan.model, done.plan.scenario
        if s.law is not None and not packaged(model) and (words := differing(model, s.simulation)):
            print(f"  physics: {words}")
        print(f"  results in {done.folder}/")
        if done.folder is not None and done.raised:
            where = TRACEBACK if len(done.rows) == 1 else FAILURES
            print(f"  a law failed: {done.folder / where} says where, everything up to there is kept")


def _shard(args: argparse.Namespace) -> int:
    """Makes a share of a campaign; whoever makes the last one shows what came of all."""
    from biped.ensemble.chunks import shard_of
    from biped.show.terminal import progress
    from biped.studies.run import Shared, run_shard

    if args.out is None or args.only is not None or len(args.scenario) > 1:
        raise InputError(
            "--shard: expected with one scenario and --out, the folder that all shards share, and without --only"
        )
    shard = shard_of(args.shard)
    with workers_of(args) as jobs:
        done = run_shard(
            args.scenario[0], changes_of(args), shard, jobs, args.out, _record if args.record else None,
            progress, warn, args.same_platform,
        )  # fmt: skip
    if isinstance(done, Shared):
        if args.json:
            print_json(done.as_dict())
        else:
            others = f"{done.left} of all runs are missing" if done.left else "others are at work on the last ones"
            print(f"shard {done.shard} of {done.scenario}: {done.runs} runs in {done.folder}/; {others}")
        return DONE
    _show(args, done)
    if args.json:
        print_all([done.result])
    return code_of([done.result])


def _record(path: Path, plan: Plan, result: dict[str, Any], trajectories: dict[int, Trajectory]) -> None:
    from biped.show.replay import record_runs

    record_runs(path, plan, result, trajectories)
