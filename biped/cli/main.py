"""The command line's way in: the only module that knows argv and exit codes. Every command is a module of its own."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from importlib import import_module

from biped.base.errors import BipedError, InputError
from biped.cli.arguments import parsed
from biped.cli.common import BAD_INPUT, DONE, FAILED, STOPPED


def _somewhere() -> None:
    """Complains once where everything would: names of files mean nothing in a folder that was deleted."""
    try:
        os.getcwd()
    except OSError:
        raise InputError("the working folder was deleted; expected to be called from one that exists") from None


def main(argv: Sequence[str] | None = None) -> int:
    """Runs one command; returns the exit code."""
    # 9x9 problems gain nothing from BLAS threads and lose milliseconds under load; must precede numpy's import.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    try:
        _somewhere()
        args = parsed(argv)
        return import_module(f"biped.cli.commands.{args.command}").command(args)
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
