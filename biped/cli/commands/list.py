"""`biped list`: what has a name."""

from __future__ import annotations

import argparse

from biped.base.catalogue import listing
from biped.cli.common import DONE
from biped.cli.parser import Commands, command_parser


def add(commands: Commands) -> None:
    """Adds the parser of `biped list`."""
    command_parser(commands, "list", "models, controllers and scenarios, with a line each", command)


def command(args: argparse.Namespace) -> int:
    """Prints models, controllers and scenarios with a line each."""
    lines = listing()
    width = max(len(name) for _, name, _ in lines)
    kind = ""
    for this, name, text in lines:
        if this != kind:
            print(f"{this}/")
            kind = this
        print(f"  {name:<{width}}  {text}")
    return DONE
