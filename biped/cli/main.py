"""The command line's way in: argv becomes the arguments of a command, which is carried out, and an exit code.

A command NAME is two functions in a module of `biped.cli.commands`, and is found there: `add_NAME(commands)` adds its
parser, and `NAME_command(args)` carries it out and returns the exit code. Nothing slow is imported before that.
"""

import argparse
import os
import sys
from collections.abc import Sequence
from importlib import import_module
from pkgutil import iter_modules

from biped.base import VERSION
from biped.base.errors import InputError, safe
from biped.base.trust import trusting
from biped.cli import commands as folder
from biped.cli.common import BAD_INPUT, FAILED, STOPPED, Parser, commands_of
from biped.cli.streams import DEBUG, SETTING, complain, import_mujoco, safe_streams


def _somewhere() -> None:
    """Complains once where everything would: names of files mean nothing in a folder that was deleted."""
    try:
        os.getcwd()
    except OSError:
        raise InputError("the working folder was deleted; expected to be called from one that exists") from None


def build() -> Parser:
    """The parser of the whole command line."""
    parser = Parser(
        prog="biped",
        description="Does this walking controller really work? Runs walking scenarios, measures and checks them.",
        epilog="Exit codes: 0 if all is done and every expectation is met, 1 if a run or a check failed, 2 for bad "
        "input, 3 if there were too few runs to decide a check. With --debug, errors come with a traceback. 'biped "
        "COMMAND --help' explains a command; 'biped demo' is the place to begin.",
    )
    parser.add_argument("--version", action="version", version=f"biped {VERSION}")
    commands = parser.add_subparsers(dest="command", metavar="COMMAND", required=True)
    modules = [import_module(found.name) for found in iter_modules(folder.__path__, f"{folder.__name__}.")]
    found = {name: add for module in modules for name, add in vars(module).items() if name.startswith("add_")}
    for name in sorted(found):
        found[name](commands)
    return parser


def parsed(argv: Sequence[str] | None) -> argparse.Namespace:
    """The arguments of one command.

    Raises:
        InputError: They are not what a command takes.
    """
    for word in sys.argv[1:] if argv is None else argv:
        try:
            word.encode()
        except UnicodeEncodeError:
            raise InputError(f"{safe(word)}: expected arguments in UTF-8") from None
    parser = build()
    args, unknown = parser.parse_known_args(argv)
    if unknown:
        from biped.base.files import nearest

        options = [option for action in commands_of(parser)[args.command]._actions for option in action.option_strings]
        word = unknown[0]
        hint = nearest(word, [option for option in options if option.startswith("--")])
        raise InputError(f"{safe(word)}: unknown option of biped {args.command}; {hint}")
    return args


def main(argv: Sequence[str] | None = None) -> int:
    """Runs one command; returns the exit code."""
    # 9x9 problems gain nothing from BLAS threads and lose milliseconds under load; must precede numpy's import.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    with safe_streams():
        return _main(list(sys.argv[1:] if argv is None else argv))


def _main(argv: list[str]) -> int:
    debug = DEBUG in argv
    try:
        _somewhere()
        args = parsed([word for word in argv if word != DEBUG])
        with trusting(getattr(args, "trust", False)):
            if getattr(args, "simulates", False) or (SETTING in os.environ and args.command not in ("list", "new")):
                import_mujoco()
            code = args.execute(args)
        sys.stdout.flush()  # here, where it can be said if the disk is full
        return code
    except KeyboardInterrupt:
        print("biped: stopped; what was finished is kept, and the same command with --out continues from there",
              file=sys.stderr)  # fmt: skip
        return STOPPED
    except Exception as error:  # the last handler: whatever went wrong, nobody gets a traceback who did not ask
        return BAD_INPUT if complain(error, debug) else FAILED


if __name__ == "__main__":
    sys.exit(main())
