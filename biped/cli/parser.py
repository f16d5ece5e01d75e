"""Parsers of commands, and the options that several commands take."""

import argparse
import re
from collections.abc import Callable
from typing import Any, NoReturn, TypeAlias

from biped.base.errors import InputError
from biped.base.text import safe

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
