"""Parts that several commands share: exit codes, texts of arguments, and JSON."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from biped.base.errors import InputError

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


def one_folder(args: argparse.Namespace) -> None:
    """Several scenarios cannot share `--out`.

    Raises:
        InputError: They are to.
    """
    if args.out is not None and len(args.scenario) > 1:
        raise InputError("--out: expected with one scenario only; several make folders of their own below runs/")


def print_json(result: Mapping[str, Any]) -> None:
    """Prints one object."""
    from biped.base.json import dumps

    print(dumps(result))


def answer(args: argparse.Namespace, result: Mapping[str, Any], document: Document) -> None:
    """Prints a result: as one object where `--json` asks for it, else as a document."""
    from biped.show.terminal import show

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
