"""The command line: the only module that knows argv, exit codes and the terminal."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Sequence
from pathlib import Path

from biped.base.errors import BipedError, InputError
from biped.cli.arguments import parsed

DONE, FAILED, BAD_INPUT, STOPPED = 0, 1, 2, 130


def _changes(args: argparse.Namespace) -> list[str]:
    return [*args.changes, *([f"engine={args.engine}"] if args.engine else [])]


def _jobs(args: argparse.Namespace) -> int:
    from biped.ensemble.campaign import cores

    if args.jobs is None:
        return cores()
    if args.jobs < 1:
        raise InputError(f"--jobs {args.jobs}: expected at least 1")
    return args.jobs


def _run(args: argparse.Namespace) -> int:
    from biped.studies import run as commands

    if args.out is not None and len(args.scenario) > 1:
        raise InputError("--out: expected with one scenario only; several make folders of their own below runs/")
    jobs = _jobs(args)
    if len(args.scenario) > 1:
        for name in args.scenario:  # before the first of them takes its time
            commands.plan_of(name, _changes(args))
    results = []
    for name in args.scenario:
        result, where, description = commands.run(
            name, _changes(args), jobs, args.out, record=args.record, only=args.only
        )
        results.append(result)
        if not args.json:
            from biped.show.terminal import show_result

            show_result(result, description)
            print(f"  results in {where}/")
    if args.json:
        _print_json(results)
    return DONE if all(result["passed"] for result in results) else FAILED


def _check(args: argparse.Namespace) -> int:
    from biped.ensemble.checks import write_junit
    from biped.studies import run as commands

    jobs = _jobs(args)
    if args.junit is not None and not args.junit.absolute().parent.is_dir():
        raise InputError(f"--junit {args.junit}: cannot be written: expected a file in a folder that exists")
    for name in args.scenario:
        if not commands.plan_of(name, _changes(args)).scenario.expect:
            raise InputError(f"{name}: expect: missing; a scenario to check says what it expects, e.g. "
                             "falls = { max = 0 }")  # fmt: skip
    results = []
    for name in args.scenario:
        result, _, description = commands.run(name, _changes(args), jobs, None, write=False)
        results.append(result)
        if not args.json:
            from biped.show.terminal import console, show_checks

            verdict = "[green]ok[/green]" if result["passed"] else "[red]FAILED[/red]"
            console().print(f"[bold]{result['scenario']}[/bold] {verdict}: {description}")
            show_checks(result)
    if args.junit is not None:
        try:
            write_junit(args.junit, results)
        except OSError as error:
            raise InputError(f"--junit {args.junit}: cannot be written: {error.strerror}") from None
    if args.json:
        _print_json(results)
    return DONE if all(result["passed"] for result in results) else FAILED


def _regress(args: argparse.Namespace) -> int:
    from biped.studies.regress import command

    outcome = command.regress(args.scenario, _jobs(args), args.file, _reason(args))
    if args.json:
        _print_json([outcome.as_dict()])
    else:
        from biped.show.regress import show

        show(outcome)
    if outcome.stopped:
        raise KeyboardInterrupt
    return DONE if outcome.passed else FAILED


def _reason(args: argparse.Namespace) -> str | None:
    """Why references change, or None if they are not to change."""
    reason = (args.reason or "").strip()
    if args.update and not reason:
        raise InputError('--update: --reason missing; expected why results changed, e.g. --reason "new solver"')
    if args.reason is not None and not args.update:
        raise InputError("--reason: expected with --update only; nothing is recorded without it")
    return reason if args.update else None


def _tune(args: argparse.Namespace) -> int:
    from biped.studies.tune.command import tune

    result = tune(args.scenario, args.changes, _jobs(args), args.out)
    if args.json:
        _print_json([result])
    else:
        print(Path(result["gait"]).read_text(encoding="utf-8"))
        print(f"{result['runs']} runs, {result['runs_per_second']:.1f} a second; gait in {result['gait']}")
    return DONE


def _compare(args: argparse.Namespace) -> int:
    from biped.ensemble.folder import new_folder
    from biped.studies import comparison
    from biped.studies.run import RUNS, title_of

    if args.engine is not None:
        raise InputError("--engine: compare runs both engines; expected no --engine")
    if args.out is not None and len(args.scenario) > 1:
        raise InputError("--out: expected with one scenario only; several make folders of their own below runs/")
    made = []
    for name in args.scenario:
        title = title_of(name)
        made.append(comparison.compare(name, title, args.changes, _jobs(args)))
        where = args.out or new_folder(RUNS, f"compare-{title}")
        comparison.write(made[-1], where)
        if not args.json:
            print(f"figure, recording and numbers in {where}/")
    results = [one.as_dict() for one in made]
    if args.json:
        _print_json(results)
    else:
        from biped.show.side_by_side import show

        show(made)
    return DONE if all(result["passed"] for result in results) else FAILED


def _print_json(results: list[dict]) -> None:
    from biped.base.json import dumps

    if len(results) == 1:
        print(dumps(results[0]))
    else:
        print(dumps({"passed": all(result["passed"] for result in results), "results": results}))


def _view(args: argparse.Namespace) -> int:
    import subprocess

    from biped.show.replay import recording_of

    path = recording_of(args.run)
    print(f"opening {path}")
    return subprocess.call([sys.executable, "-m", "rerun", str(path)])


def _plot(args: argparse.Namespace) -> int:
    from biped.show.replay import plot_results

    for path in plot_results(args.run):
        print(path)
    return DONE


def _report(args: argparse.Namespace) -> int:
    from biped.show.markdown import write_report

    write_report(args.run, args.out, args.title)
    print(args.out)
    return DONE


def _bench(args: argparse.Namespace) -> int:
    if args.what == "walking":
        from biped.studies.bench import walking

        walking.run(json=args.json, out=args.out)
        return DONE
    if args.what == "mechanisms":
        from biped.studies.bench import mechanisms

        mechanisms.run(json=args.json, figures=args.out, quick=args.quick)
        return DONE
    if args.what == "regress":
        from biped.studies.bench import regress

        return DONE if regress.run(json=args.json, file=args.file, reason=_reason(args)) else FAILED
    from biped.studies.bench import throughput

    throughput.run(json=args.json, quick=args.quick)
    return DONE


def _stability(args: argparse.Namespace) -> int:
    if args.reference == (args.scenario is not None):
        raise InputError("stability: expected a scenario, or --reference alone")
    if args.reference:
        from biped.studies.stability import reference

        reference.show(args.json)
        return DONE
    from biped.studies.stability import command

    stable = command.run(args.scenario, args.changes, args.engine, _jobs(args), args.basin, args.out, args.json)
    return DONE if stable else FAILED


def _list(args: argparse.Namespace) -> int:
    from biped.base.catalogue import listing

    lines = listing()
    width = max(len(name) for _, name, _ in lines)
    kind = ""
    for this, name, text in lines:
        if this != kind:
            print(f"{this}/")
            kind = this
        print(f"  {name:<{width}}  {text}")
    return DONE


_COMMANDS = {
    "run": _run,
    "check": _check,
    "regress": _regress,
    "compare": _compare,
    "tune": _tune,
    "view": _view,
    "plot": _plot,
    "report": _report,
    "bench": _bench,
    "stability": _stability,
    "list": _list,
}


def _somewhere() -> None:
    """Complains once where everything would: names of files mean nothing in a folder that was deleted."""
    try:
        os.getcwd()
    except OSError:
        raise InputError("the working folder was deleted; expected to be called from one that exists") from None


def main(argv: Sequence[str] | None = None) -> int:
    """Runs one command; returns the exit code."""
    try:
        _somewhere()
        args = parsed(argv)
        return _COMMANDS[args.command](args)
    except BipedError as error:
        print(f"biped: {' '.join(str(error).split())}", file=sys.stderr)
        return BAD_INPUT if isinstance(error, InputError) else FAILED
    except KeyboardInterrupt:
        print("biped: stopped; what was finished is kept, and the same command with --out goes on from there",
              file=sys.stderr)  # fmt: skip
        return STOPPED
    except BrokenPipeError:
        return DONE


if __name__ == "__main__":
    sys.exit(main())
