"""`biped new`: a file to start from."""

from __future__ import annotations

import argparse
import os
from importlib.util import find_spec
from pathlib import Path

from biped.base.errors import InputError
from biped.base.writing import reason, write_text
from biped.cli.common import DONE
from biped.cli.parser import Commands, command_parser

START = "biped.control.planar.start_law"
"""The module that is written; nothing of it is run here."""
NAMED = "my_law.py"
"""Names in the written files that stand for the user's own."""


def add(commands: Commands) -> None:
    """Adds the parser of `biped new`."""
    parser = command_parser(
        commands, "new", "write a file to start from", command,
        description="Writes a control law to start from: the thesis's, in readable Python.",
    )  # fmt: skip
    parser.add_argument("what", choices=["controller"], help="what to start")
    file = "the file, such as my_law.py; one that is there is not overwritten"
    parser.add_argument("file", type=Path, help=file)


def command(args: argparse.Namespace) -> int:
    """Writes it and says how to run it."""
    file: Path = args.file
    if file.suffix != ".py" or not file.stem.isidentifier():
        raise InputError(f"new: {file}: expected the name of a Python module, such as my_law.py")
    if os.path.lexists(file):
        raise InputError(f"new: {file}: is there already; expected another name, nothing is overwritten")
    try:
        write_text(file, start().replace(NAMED, str(file)))
    except OSError as error:
        raise InputError(f"new: {file}: cannot be written: {reason(error)}") from None
    print(f"{file}: the thesis's law in Python; docs/controllers.md says what everything in it is")
    print(f"  biped run level_normal --set law={file}:Law")
    return DONE


def start() -> str:
    """The law to start from."""
    spec = find_spec(START)
    assert spec is not None
    assert spec.origin is not None
    return Path(spec.origin).read_text(encoding="utf-8")
