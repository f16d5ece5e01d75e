"""`biped run`: runs scenarios and writes their results."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from biped.cli.common import DONE, FAILED, changes_of, jobs_of, one_folder, print_all, warn
from biped.ensemble.folder import FAILURES
from biped.ensemble.plan import Plan
from biped.ensemble.rows import RAISED
from biped.measure.trajectory import Trajectory
from biped.show.terminal import progress, show_result
from biped.studies.run import TRACEBACK, plan_of, run


def command(args: argparse.Namespace) -> int:
    """Runs scenarios one after the other."""
    one_folder(args)
    jobs = jobs_of(args)
    if len(args.scenario) > 1:
        for name in args.scenario:  # before the first of them takes its time
            plan_of(name, changes_of(args))
    results = []
    for name in args.scenario:
        done = run(
            name, changes_of(args), jobs, args.out, _record if args.record else None, args.only,
            progress=progress, tell=warn,
        )  # fmt: skip
        results.append(done.result)
        if not args.json:
            show_result(done.result, done.plan.scenario.description)
            print(f"  results in {done.folder}/")
            if done.folder is not None and any(row.end == RAISED for row in done.rows):
                where = TRACEBACK if len(done.rows) == 1 else FAILURES
                print(f"  a law failed: {done.folder / where} says where, everything up to there is kept")
    if args.json:
        print_all(results)
    return DONE if all(result["passed"] for result in results) else FAILED


def _record(path: Path, plan: Plan, result: dict[str, Any], trajectories: dict[int, Trajectory]) -> None:
    from biped.show.replay import record_runs

    record_runs(path, plan, result, trajectories)
