"""The command line: the only module that knows argv, exit codes and the terminal."""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import NoReturn

from biped import __version__
from biped.errors import BipedError, InputError

DONE, FAILED, BAD_INPUT, STOPPED = 0, 1, 2, 130


class _Parser(argparse.ArgumentParser):
    """Complains like everything else here: by an `InputError`."""

    def error(self, message: str) -> NoReturn:
        """See `argparse.ArgumentParser.error`."""
        from biped.files import nearest

        unknown = re.match(r"argument COMMAND: invalid choice: '(.*?)'", message)
        if unknown:
            known = list(_COMMANDS)
            raise InputError(
                f"command '{unknown[1]}': expected one of {', '.join(known)}; {nearest(unknown[1], known)}"
            )
        raise InputError(f"{message.removeprefix('argument ')}; see: {self.prog} --help")


def _whole(text: str) -> int:
    try:
        return int(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"expected a whole number, got '{text}'") from None


def _parser() -> _Parser:
    parser = _Parser(
        prog="biped",
        description="Does this walking controller really work? Runs walking scenarios, measures and checks them.",
        epilog="Exit code 0: done, all expectations met; 1: a run or a check failed; 2: bad input.",
    )
    parser.add_argument("--version", action="version", version=f"biped {__version__}")
    commands = parser.add_subparsers(dest="command", metavar="COMMAND", required=True)

    def scenarios(name: str, what: str) -> argparse.ArgumentParser:
        command = commands.add_parser(name, help=what, description=what)
        command.add_argument("scenario", nargs="+", help="name in scenarios/, or path of a scenario file")
        command.add_argument("--set", dest="changes", metavar="KEY=VALUE", action="append", default=[],
                             help="change a key, e.g. ground.slope=2 (VALUE is TOML; repeatable)")  # fmt: skip
        command.add_argument("--engine", help="engine to run in")
        command.add_argument("--jobs", type=_whole, help="processes for ensembles (default: all cores)")
        command.add_argument("--json", action="store_true", help="print one JSON object and nothing else")
        return command

    run = scenarios("run", "run scenarios; write metrics, trajectory and, if wanted, a recording")
    run.add_argument("--out", type=Path, help="results folder (default: a new one below runs/)")
    run.add_argument("--record", action="store_true", help="also write a recording for the rerun viewer")
    run.add_argument("--only", type=_whole, metavar="N", help="replay run N of the ensemble alone")
    check = scenarios("check", "run scenarios and compare with their [expect]")
    check.add_argument("--junit", type=Path, metavar="FILE", help="also write JUnit XML")
    regress = commands.add_parser("regress", help="compare scenarios with their recorded reference numbers",
                                  description="Runs a fixed part of scenarios and compares with recorded numbers: "
                                  "digit by digit where they were recorded, elsewhere the physics.")  # fmt: skip
    regress.add_argument("scenario", nargs="*", help="name in scenarios/, or path (default: every shipped scenario)")
    regress.add_argument("--update", action="store_true", help="record what differs as the new reference")
    regress.add_argument("--reason", help="why results changed; kept in the file (needed by --update)")
    regress.add_argument("--file", type=Path, help="file of references (default: that of the shipped scenarios)")
    regress.add_argument("--jobs", type=_whole, help="processes (default: all cores)")
    regress.add_argument("--json", action="store_true", help="print one JSON object and nothing else")
    compare = scenarios("compare", "run scenarios in both engines: every metric side by side, with its gap")
    compare.add_argument("--out", type=Path, help="folder for figures and recordings (default: new ones below runs/)")
    tune = commands.add_parser("tune", help="find gains that serve a scenario's conditions",
                               description="Finds gains that serve the conditions in a scenario's [tune].")  # fmt: skip
    tune.add_argument("scenario", help="name in scenarios/, or path of a scenario file with a [tune] table")
    tune.add_argument("--set", dest="changes", metavar="KEY=VALUE", action="append", default=[],
                      help="change a key (repeatable)")  # fmt: skip
    tune.add_argument("--jobs", type=_whole, help="processes (default: all cores)")
    tune.add_argument("--out", type=Path, help="results folder; an interrupted search in it is continued")
    tune.add_argument("--json", action="store_true", help="print one JSON object and nothing else")
    view = commands.add_parser("view", help="open a recording in the rerun viewer")
    view.add_argument("run", nargs="?", type=Path, help="results folder or .rrd (default: the newest recording)")
    plot = commands.add_parser("plot", help="draw figures of a run or campaign")
    plot.add_argument("run", type=Path, help="results folder")
    report = commands.add_parser("report", help="write a Markdown report of campaigns, with figures")
    report.add_argument("run", type=Path, nargs="+", help="results folders")
    report.add_argument("--out", type=Path, default=Path("report.md"), help="the file (default: report.md)")
    report.add_argument("--title", default="Campaigns", help="its heading")
    bench = commands.add_parser("bench", help="run time against error, and what things cost")
    bench.add_argument("what", choices=["throughput", "walking", "mechanisms", "regress"],
                       help="what to measure; regress: whether a recorded result or cost changed")  # fmt: skip
    bench.add_argument("--out", type=Path, help="walking, mechanisms: folder for figures")
    bench.add_argument(
        "--quick", action="store_true", help="mechanisms: fewer repeats and settings; throughput: no prices of features"
    )
    bench.add_argument("--update", action="store_true", help="regress: record the costs measured now")
    bench.add_argument("--reason", help="regress: why costs changed (needed by --update)")
    bench.add_argument("--file", type=Path, help="regress: file of references (default: that of the shipped scenarios)")
    bench.add_argument("--json", action="store_true", help="print one JSON object and nothing else")
    stability = commands.add_parser("stability", help="a gait as a limit cycle: return map and Floquet multipliers")
    stability.add_argument("scenario", nargs="?", help="name in scenarios/, or path of a scenario file")
    stability.add_argument("--reference", action="store_true", help="solve the walkers whose multipliers are known")
    stability.add_argument("--set", dest="changes", metavar="KEY=VALUE", action="append", default=[],
                           help="change a key (VALUE is TOML; repeatable)")  # fmt: skip
    stability.add_argument("--engine", choices=["mujoco", "home"], help="the only engine (default: both)")
    stability.add_argument("--basin", action="store_true", help="also cut the basin of attraction: lean and speed")
    stability.add_argument("--jobs", type=_whole, help="processes (default: all cores)")
    stability.add_argument("--out", type=Path, help="folder of figure and numbers (default: a new one below runs/)")
    stability.add_argument("--json", action="store_true", help="print one JSON object and nothing else")
    commands.add_parser("list", help="models, controllers and scenarios, with a line each")
    return parser


def _parsed(argv: Sequence[str] | None) -> argparse.Namespace:
    parser = _parser()
    args, unknown = parser.parse_known_args(argv)
    if unknown:
        from biped.files import nearest

        # The parser of the command that was given is in argparse's own list of sub-parsers.
        (commands,) = (action for action in parser._actions if isinstance(action, argparse._SubParsersAction))
        options = [option for action in commands.choices[args.command]._actions for option in action.option_strings]
        word = unknown[0]
        hint = nearest(word, [option for option in options if option.startswith("--")])
        raise InputError(f"{word}: not something that biped {args.command} takes; {hint}")
    return args


def _changes(args: argparse.Namespace) -> list[str]:
    return [*args.changes, *([f"engine={args.engine}"] if args.engine else [])]


def _jobs(args: argparse.Namespace) -> int:
    from biped.campaign import cores

    if args.jobs is None:
        return cores()
    if args.jobs < 1:
        raise InputError(f"--jobs {args.jobs}: expected at least 1")
    return args.jobs


def _run(args: argparse.Namespace) -> int:
    from biped import commands

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
            from biped.terminal import show_result

            show_result(result, description)
            print(f"  results in {where}/")
    if args.json:
        _print_json(results)
    return DONE if all(result["passed"] for result in results) else FAILED


def _check(args: argparse.Namespace) -> int:
    from biped import commands
    from biped.checks import write_junit

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
            from biped.terminal import console, show_checks

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
    from biped.regress import command

    outcome = command.regress(args.scenario, _jobs(args), args.file, _reason(args))
    if args.json:
        _print_json([outcome.as_dict()])
    else:
        from biped.regress.show import show

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
    from biped.tune.command import tune

    result = tune(args.scenario, args.changes, _jobs(args), args.out)
    if args.json:
        _print_json([result])
    else:
        print(Path(result["gait"]).read_text(encoding="utf-8"))
        print(f"{result['runs']} runs, {result['runs_per_second']:.1f} a second; gait in {result['gait']}")
    return DONE


def _compare(args: argparse.Namespace) -> int:
    from biped import comparison
    from biped.commands import RUNS, title_of
    from biped.results import new_folder

    if args.engine is not None:
        raise InputError("--engine: compare runs both engines; expected no --engine")
    if args.out is not None and len(args.scenario) > 1:
        raise InputError("--out: expected with one scenario only; several make folders of their own below runs/")
    made = []
    for name in args.scenario:
        title = title_of(name)
        made.append(comparison.compare(name, title, args.changes, _jobs(args)))
        where = args.out or new_folder(RUNS, f"compare-{title.replace('/', '-')}")
        comparison.write(made[-1], where)
        if not args.json:
            print(f"figure, recording and numbers in {where}/")
    results = [one.as_dict() for one in made]
    if args.json:
        _print_json(results)
    else:
        from biped.side_by_side import show

        show(made)
    return DONE if all(result["passed"] for result in results) else FAILED


def _print_json(results: list[dict]) -> None:
    from biped.results import dumps

    if len(results) == 1:
        print(dumps(results[0]))
    else:
        print(dumps({"passed": all(result["passed"] for result in results), "results": results}))


def _view(args: argparse.Namespace) -> int:
    import subprocess

    from biped.recorded import recording_of

    path = recording_of(args.run)
    print(f"opening {path}")
    return subprocess.call([sys.executable, "-m", "rerun", str(path)])


def _plot(args: argparse.Namespace) -> int:
    from biped.recorded import plot_results

    for path in plot_results(args.run):
        print(path)
    return DONE


def _report(args: argparse.Namespace) -> int:
    from biped.report import write_report

    write_report(args.run, args.out, args.title)
    print(args.out)
    return DONE


def _bench(args: argparse.Namespace) -> int:
    if args.what == "walking":
        from biped.bench import walking

        walking.run(json=args.json, out=args.out)
        return DONE
    if args.what == "mechanisms":
        from biped.bench import mechanisms

        mechanisms.run(json=args.json, figures=args.out, quick=args.quick)
        return DONE
    if args.what == "regress":
        from biped.bench import regress

        return DONE if regress.run(json=args.json, file=args.file, reason=_reason(args)) else FAILED
    from biped.bench import throughput

    throughput.run(json=args.json, quick=args.quick)
    return DONE


def _stability(args: argparse.Namespace) -> int:
    if args.reference == (args.scenario is not None):
        raise InputError("stability: expected a scenario, or --reference alone")
    if args.reference:
        from biped.stability import reference

        reference.show(args.json)
        return DONE
    from biped.stability import command

    stable = command.run(args.scenario, args.changes, args.engine, _jobs(args), args.basin, args.out, args.json)
    return DONE if stable else FAILED


def _list(args: argparse.Namespace) -> int:
    from biped.catalogue import listing

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


def main(argv: Sequence[str] | None = None) -> int:
    """Runs one command; returns the exit code."""
    try:
        args = _parsed(argv)
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
