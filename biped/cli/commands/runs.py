"""`biped run`, `check` and `worker`: scenarios are run."""

from __future__ import annotations

import argparse
from itertools import product
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING

from biped.base.errors import InputError
from biped.base.writing import may_write
from biped.cli import common

if TYPE_CHECKING:
    from biped.studies.run import Recorder, ScenarioResult


def add_run(commands: common.Commands) -> None:
    """Adds the parser of `biped run`."""
    what = "run scenarios and write metrics and trajectories"
    parser = common.command_parser(commands, "run", what, run_command, simulates=True)
    common.take_scenarios(parser)
    parser.add_argument("--out", type=Path, help="results folder (default: a new one below runs/)")
    parser.add_argument("--record", action="store_true", help="also write a recording for the rerun viewer")
    live = "watch one run in MuJoCo's viewer in real time and push with the mouse; nothing is written"
    parser.add_argument("--live", action="store_true", help=live)
    parser.add_argument(
        "--only", type=common.whole, metavar="N", help="run only run N of the ensemble, exactly as before"
    )
    parser.add_argument("--shard", metavar="I/N", help="run share I of N of a campaign; all shares have the same --out")
    common.take_same_platform(parser)


def run_command(args: argparse.Namespace) -> int:
    """Runs scenarios one after the other."""
    from biped.studies.run import plan_of, run

    if args.live:
        return _live(args)
    common.one_folder(args)
    if args.shard is not None:
        return _shard(args)
    if len(args.scenario) > 1:
        for name in args.scenario:  # before the first of them takes its time
            plan_of(name, common.changes_of(args))
    results = []
    with common.workers_of(args) as jobs:
        for name in args.scenario:
            done = run(
                name, common.changes_of(args), jobs, args.out, _recorder(args), args.only,
                progress=common.progress, tell=common.warn, same=args.same_platform,
            )  # fmt: skip
            results.append(done.result)
            _show(args, done)
    if args.json:
        common.print_all(results)
    return common.code_of(results)


def _live(args: argparse.Namespace) -> int:
    """One run in a window; what a hand pushes cannot be repeated, so nothing is kept of it."""
    from biped.show.viewer import watch
    from biped.studies.run import plan_of

    for given, option in ((args.record, "--record"), (args.out, "--out"), (args.json, "--json")):
        if given:
            raise InputError(f"{option}: --live keeps nothing of a run that was pushed by hand; expected one of them")
    if len(args.scenario) > 1:
        raise InputError(f"--live: expected one scenario, got {len(args.scenario)}")
    plan = plan_of(args.scenario[0], common.changes_of(args))
    only = args.only or 0
    if not 0 <= only < len(plan):
        raise InputError(f"--only {only}: expected the number of a run, 0 … {len(plan) - 1}")
    seen = watch(plan, only, tell=print)
    print(f"{seen.said}; {seen.seconds:.2f} s, pushed by hand for {seen.pushed} ticks")
    return common.DONE


def _show(args: argparse.Namespace, done: ScenarioResult) -> None:
    from biped.ensemble.failures import FAILURES
    from biped.robot.safety import packaged
    from biped.scenario.general import differing
    from biped.show.results import document_of
    from biped.studies.run import TRACEBACK

    if not args.json:
        common.show(document_of(done.result, done.plan.scenario.description))
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
    from biped.studies.run import Shared, run_shard

    if args.out is None or args.only is not None or len(args.scenario) > 1:
        raise InputError(
            "--shard: expected with one scenario and --out, the folder that all shards share, and without --only"
        )
    shard = shard_of(args.shard)
    with common.workers_of(args) as jobs:
        done = run_shard(
            args.scenario[0], common.changes_of(args), shard, jobs, args.out, _recorder(args),
            common.progress, common.warn, args.same_platform,
        )  # fmt: skip
    if isinstance(done, Shared):
        if args.json:
            common.print_json(done.as_dict())
        else:
            others = f"{done.left} of all runs are missing" if done.left else "others are at work on the last ones"
            print(f"shard {done.shard} of {done.scenario}: {done.runs} runs in {done.folder}/; {others}")
        return common.DONE
    _show(args, done)
    if args.json:
        common.print_all([done.result])
    return common.code_of([done.result])


def _recorder(args: argparse.Namespace) -> Recorder | None:
    """The function that writes a recording, if one is asked for."""
    if not args.record:
        return None
    from biped.show.replay import record_runs

    return record_runs


def add_check(commands: common.Commands) -> None:
    """Adds the parser of `biped check`."""
    parser = common.command_parser(
        commands, "check", "run scenarios and compare the results with what they expect", check_command, simulates=True
    )
    common.take_scenarios(parser)
    common.take_same_platform(parser)
    parser.add_argument("--engines", metavar="E,E", help="check in several engines, e.g. mujoco,drake; all must pass")
    parser.add_argument("--junit", type=Path, metavar="FILE", help="also write JUnit XML")
    parser.add_argument("--summary", type=Path, metavar="FILE", help="also write a table in Markdown, for a CI summary")


def check_command(args: argparse.Namespace) -> int:
    """Checks scenarios; nothing is written but the files that are asked for."""
    from biped.ensemble.checks import JUNIT, write_junit
    from biped.show.results import KIND as SUMMARY
    from biped.show.results import verdict_of, write_summary
    from biped.studies.folders import writing
    from biped.studies.run import plan_of, run

    for path, option, kind in ((args.junit, "--junit", JUNIT), (args.summary, "--summary", SUMMARY)):
        if path is not None:
            may_write(path, option, kind)
            if not path.absolute().parent.is_dir():
                raise InputError(f"{option} {path}: cannot be written: expected a file in a folder that exists")
    engines = [[f"engine={name}"] for name in common.engines_of(args)] or [[]]
    for name in args.scenario:
        if not plan_of(name, common.changes_of(args)).scenario.expect:
            raise InputError(f"{name}: expect: missing; a scenario to check says what it expects, e.g. "
                             "falls = { max = 0 }")  # fmt: skip
    results, seconds = [], []
    with common.workers_of(args) as jobs:
        for name, engine in product(args.scenario, engines):
            begun = perf_counter()
            done = run(
                name, [*common.changes_of(args), *engine], jobs, None, write=False, progress=common.progress,
                tell=common.warn, same=args.same_platform,
            )  # fmt: skip
            seconds.append(perf_counter() - begun)
            results.append(done.result)
            if not args.json:
                words = [done.plan.scenario.description, f"in {done.plan.scenario.engine}" if len(engines) > 1 else ""]
                common.show(verdict_of(done.result, ", ".join(filter(None, words))))
    if args.junit is not None:
        with writing(f"--junit {args.junit}"):
            write_junit(args.junit, results, seconds)
    if args.summary is not None:
        with writing(f"--summary {args.summary}"):
            write_summary(args.summary, results)
    if args.json:
        common.print_all(results)
    return common.code_of(results)


def add_worker(commands: common.Commands) -> None:
    """Adds the parser of `biped worker`."""
    parser = common.command_parser(
        commands, "worker", "run simulations for campaigns on a cluster", worker_command, simulates=True,
        description="Starts workers for a Dask scheduler. Each worker has one thread and is restarted if it dies.",
    )  # fmt: skip
    parser.add_argument("scheduler", help="address of the scheduler, such as tcp://host:8786")
    parser.add_argument("--workers", type=common.whole, default=1, help="number of workers, one core each (default: 1)")
    parser.add_argument(
        "--lifetime", metavar="TIME", help="stop after this time, such as 50m; keep it below the time limit of the job"
    )
    parser.add_argument("--memory", metavar="SIZE", default="auto", help="largest memory of each worker, such as 2GB")
    for part, what in (
        ("ca-file", "certificate of the authority that signed the scheduler's, for a scheduler at tls://…"),
        ("cert", "certificate of this worker, for a scheduler at tls://…"),
        ("key", "key of this worker's certificate"),
    ):
        parser.add_argument(f"--tls-{part}", metavar="FILE", help=what)
    parser.add_argument("--with-parent", action="store_true", help="stop when standard input ends")


def worker_command(args: argparse.Namespace) -> int:
    """Works until the scheduler is gone, the lifetime is over, or it is stopped."""
    from biped.ensemble.cluster.worker import go_with_parent, work

    if args.with_parent:
        go_with_parent()
    files = {"ca-file": args.tls_ca_file, "cert": args.tls_cert, "key": args.tls_key}
    tls = {name: path for name, path in files.items() if path is not None}
    work(args.scheduler, args.workers, args.memory, args.lifetime, tls)
    return common.DONE
