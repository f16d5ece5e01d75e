"""The command line's way in: the only module that knows argv and exit codes. Every command is a module of its own."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from importlib import import_module

from biped.base.errors import InputError
from biped.base.trust import trusting
from biped.cli.arguments import parsed
from biped.cli.common import BAD_INPUT, FAILED, STOPPED
from biped.cli.ending import DEBUG, complain
from biped.cli.streams import safe_streams
from biped.cli.windowless import import_mujoco

SIMULATING = ("run", "check", "regress", "stability", "tune", "worker")
"""Commands that step MuJoCo, and draw nothing unless asked to."""


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
    with safe_streams():
        return _main(list(sys.argv[1:] if argv is None else argv))


def _main(argv: list[str]) -> int:
    debug = DEBUG in argv
    try:
        _somewhere()
        args = parsed([word for word in argv if word != DEBUG])
        with trusting(getattr(args, "trust", False)):
            if args.command in SIMULATING:
                import_mujoco()
            code = import_module(f"biped.cli.commands.{args.command}").command(args)
        sys.stdout.flush()  # here, where it can be said if the disk is full
        return code
    except KeyboardInterrupt:
        print("biped: stopped; what was finished is kept, and the same command with --out goes on from there",
              file=sys.stderr)  # fmt: skip
        return STOPPED
    except Exception as error:  # the last handler: whatever went wrong, nobody gets a traceback who did not ask
        return BAD_INPUT if complain(error, debug) else FAILED


if __name__ == "__main__":
    sys.exit(main())
