"""`biped run`: runs scenarios and writes their results."""

from __future__ import annotations

import argparse

from biped.cli.common import DONE, FAILED, changes_of, jobs_of, one_folder, print_all
from biped.show.terminal import progress, show_result
from biped.studies.run import plan_of, run


def command(args: argparse.Namespace) -> int:
    """Runs scenarios one after the other."""
    one_folder(args)
    jobs = jobs_of(args)
    if len(args.scenario) > 1:
        for name in args.scenario:  # before the first of them takes its time
            plan_of(name, changes_of(args))
    results = []
    for name in args.scenario:
        done = run(name, changes_of(args), jobs, args.out, only=args.only, progress=progress)
        results.append(done.result)
        if args.record and done.folder is not None:
            from biped.show.replay import record_runs

            record_runs(done.folder / "recording.rrd", done.plan, done.result, done.trajectories)
        if not args.json:
            show_result(done.result, done.plan.scenario.description)
            print(f"  results in {done.folder}/")
    if args.json:
        print_all(results)
    return DONE if all(result["passed"] for result in results) else FAILED
