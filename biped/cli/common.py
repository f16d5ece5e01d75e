"""Parts that several commands share: parsers, their options and what these ask for, exit codes, and JSON."""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn, TypeAlias

from biped.base.errors import InputError, safe

if TYPE_CHECKING:
    from biped.ensemble.backend import Jobs
    from biped.show.document import Document


DONE, FAILED, BAD_INPUT, UNDECIDED, STOPPED = 0, 1, 2, 3, 130
"""Exit codes."""


def changes_of(args: argparse.Namespace) -> list[str]:
    """`--set` changes, `--engine` among them."""
    return [*args.changes, *([f"engine={args.engine}"] if args.engine else [])]


def jobs_of(args: argparse.Namespace) -> int:
    """Number of processes.

    Raises:
        InputError: It is none.
    """
    from biped.ensemble.campaign import cores

    if args.jobs is None:
        return cores()
    if args.jobs < 1:
        raise InputError(f"--jobs {args.jobs}: expected at least 1")
    return args.jobs


def engines_of(args: argparse.Namespace) -> list[str]:
    """Engines of `--engines`; none where it is not there.

    Raises:
        InputError: One is unknown or named twice, or `--engine` is there too.
    """
    from biped.scenario.engines import engines_named

    if args.engines is not None and args.engine is not None:
        raise InputError("--engines: expected without --engine, which names one")
    return [] if args.engines is None else list(engines_named(args.engines))


@contextmanager
def workers_of(args: argparse.Namespace) -> Iterator[Jobs]:
    """Who carries out: processes, or the cluster that was asked for, which is let go when the block ends.

    Raises:
        InputError: There is no such cluster.
    """
    if args.cluster is not None and args.jobs is not None:
        raise InputError("--jobs: expected without --cluster, which has workers of its own")
    from biped.ensemble.campaign import workers_at

    jobs = jobs_of(args) if args.cluster is None else None
    with workers_at(jobs, args.cluster, getattr(args, "same_platform", False), warn) as workers:
        yield workers


def reason_of(args: argparse.Namespace) -> str | None:
    """Why references change, or None if they are not to change.

    Raises:
        InputError: One of --update and --reason stands without the other.
    """
    reason = (args.reason or "").strip()
    if args.update and not reason:
        raise InputError('--update: --reason missing; expected why results changed, e.g. --reason "new solver"')
    if args.reason is not None and not args.update:
        raise InputError("--reason: expected with --update only; nothing is recorded without it")
    return reason if args.update else None


def folder_of(args: argparse.Namespace, title: str) -> Path:
    """The results folder that the user asks for, or else a new one below runs/."""
    from biped.ensemble.guard import new_folder
    from biped.studies.folders import RUNS

    return args.out or new_folder(RUNS, title)


def one_folder(args: argparse.Namespace) -> None:
    """Several scenarios cannot share `--out`.

    Raises:
        InputError: They are to.
    """
    if args.out is not None and len(args.scenario) > 1:
        raise InputError("--out: expected with one scenario only; several make folders of their own below runs/")


def print_json(result: Mapping[str, Any]) -> None:
    """Prints one object."""
    from biped.base.writing import dumps

    print(dumps(result))


def show(document: Document) -> None:
    """Draws a document on the terminal."""
    from biped.show import terminal

    terminal.show(document)


def progress(title: str, total: int, done: int) -> AbstractContextManager[Any]:
    """A progress bar on stderr; see `biped.show.terminal.progress`."""
    from biped.show import terminal

    return terminal.progress(title, total, done)


def answer(args: argparse.Namespace, result: Mapping[str, Any], document: Document) -> None:
    """Prints a result: as one object where `--json` asks for it, else as a document."""
    if args.json:
        print_json(result)
    else:
        show(document)


def print_all(results: Sequence[Mapping[str, Any]]) -> None:
    """Prints one object: a scenario's result, or those of several with their common verdict."""
    from biped.ensemble.results import without_rows

    shown = [without_rows(result) for result in results]
    print_json(shown[0] if len(results) == 1 else {"passed": all_passed(results), "results": shown})


def all_passed(results: Sequence[Mapping[str, Any]]) -> bool | None:
    """Whether all results passed; None if none failed, but of some nothing was expected or a check is undecided."""
    verdicts = [result["passed"] for result in results]
    return False if False in verdicts else None if None in verdicts else True


def code_of(results: Sequence[Mapping[str, Any]]) -> int:
    """The exit code of results: `FAILED` if one failed, else `UNDECIDED` if a check is, else `DONE`."""
    if all_passed(results) is False:
        return FAILED
    undecided = any(check["passed"] is None for result in results for check in result["checks"])
    return UNDECIDED if undecided else DONE


def warn(words: str) -> None:
    """Says on stderr what a person should know although nothing failed."""
    print(f"biped: {words}", file=sys.stderr)


Commands: TypeAlias = "argparse._SubParsersAction[argparse.ArgumentParser]"
"""The commands of a command line, to which parsers are added."""


class Parser(argparse.ArgumentParser):
    """An argument parser that raises an `InputError` for whatever it cannot use."""

    def error(self, message: str) -> NoReturn:
        """See `argparse.ArgumentParser.error`."""
        from biped.base.files import nearest

        unknown = re.match(r"argument COMMAND: invalid choice: '(.*?)'", message)
        if unknown:
            known = list(commands_of(self))
            raise InputError(
                f"command '{safe(unknown[1])}': expected one of {', '.join(known)}; {nearest(unknown[1], known)}"
            )
        raise InputError(f"{message.removeprefix('argument ')}; see: {self.prog} --help")


def whole(text: str) -> int:
    """The whole number that an argument is."""
    try:
        return int(text) if len(text) < 20 else int("too many digits")
    except ValueError:
        raise argparse.ArgumentTypeError(f"expected a whole number, got '{safe(text)}'") from None


def number(text: str) -> float:
    """The number that an argument is."""
    try:
        return float(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"expected a number, got '{safe(text)}'") from None


def command_parser(
    commands: Commands, name: str, what: str, execute: Callable[[argparse.Namespace], int], **more: Any
) -> argparse.ArgumentParser:
    """Adds the parser of a command.

    Args:
        commands: Those of the command line.
        name: What is typed.
        what: It does, in a line of `biped --help`.
        execute: Carries it out and returns the exit code.
        **more: `description`, where its own help says more than the line; and defaults, among them `simulates` of a
            command that steps MuJoCo and draws nothing unless asked to.
    """
    parser = commands.add_parser(name, help=what, description=more.pop("description", f"{what[0].upper()}{what[1:]}."))
    parser.set_defaults(execute=execute, **more)
    return parser


def take_scenarios(parser: argparse.ArgumentParser) -> None:
    """Adds what commands take that run scenarios: their names, changes, engine, workers."""
    parser.add_argument("scenario", nargs="+", help="name in scenarios/, or path of a scenario file")
    take_changes(parser, "change a key of the scenario, e.g. ground.slope=2 (VALUE is TOML; repeatable)")
    take_engine(parser)
    take_running(parser)


def take_running(parser: argparse.ArgumentParser) -> None:
    """Adds what commands take that run something: trust, workers, JSON."""
    take_trust(parser)
    take_workers(parser)
    take_json(parser)


def take_engine(parser: argparse.ArgumentParser) -> None:
    """Adds `--engine`."""
    parser.add_argument("--engine", help="simulator: mujoco, home or drake (default: that of the scenario)")


def take_changes(
    parser: argparse.ArgumentParser, what: str = "change a key of the scenario (VALUE is TOML; repeatable)"
) -> None:
    """Adds `--set`."""
    parser.add_argument("--set", dest="changes", metavar="KEY=VALUE", action="append", default=[], help=what)


def take_workers(parser: argparse.ArgumentParser) -> None:
    """Adds who carries out the runs: processes here, or a cluster."""
    parser.add_argument("--jobs", type=whole, help="parallel processes (default: one on each core)")
    where = "run on a cluster: address of a Dask scheduler, local:N, or a file *.toml (docs/clusters.md)"
    parser.add_argument("--cluster", metavar="WHERE", help=where)


def take_same_platform(parser: argparse.ArgumentParser) -> None:
    """Adds `--same-platform`."""
    what = "refuse workers and results of another kind of machine, because their last bits may differ"
    parser.add_argument("--same-platform", action="store_true", help=what)


def take_trust(parser: argparse.ArgumentParser) -> None:
    """Adds `--trust`."""
    parser.add_argument(
        "--trust",
        action="store_true",
        help="run Python laws that the scenario names, and read files outside the folder of the model",
    )


def take_json(parser: argparse.ArgumentParser) -> None:
    """Adds `--json`."""
    parser.add_argument("--json", action="store_true", help="print one JSON object and nothing else")


def commands_of(parser: argparse.ArgumentParser) -> dict[str, argparse.ArgumentParser]:
    """The parsers of the commands by name; argparse has them in its own list of sub-parsers."""
    (commands,) = (action for action in parser._actions if isinstance(action, argparse._SubParsersAction))
    return commands.choices
