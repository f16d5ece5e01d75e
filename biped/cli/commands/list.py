"""`biped list`: what has a name."""

import argparse

from biped.base.files import SUFFIX, locate, names, read_toml
from biped.base.text import plain
from biped.cli.common import DONE
from biped.cli.parser import Commands, command_parser


def add(commands: Commands) -> None:
    """Adds the parser of `biped list`."""
    command_parser(commands, "list", "list models, controllers, readings and scenarios, with a line each", command)


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


def listing() -> list[tuple[str, str, str]]:
    """Every model, controller, reading and scenario that has a name: (kind, name, one line)."""
    return [(kind, name, _one_line(kind, name)) for kind in SUFFIX for name in names(kind)]


def _one_line(kind: str, name: str) -> str:
    path = locate(kind, name, "list")
    if kind == "models":
        comment = path.read_text(encoding="utf-8").partition("<!--")[2].partition("-->")[0].strip()
        return plain(comment.partition(";")[0].partition("\n")[0].strip())
    return plain(read_toml(path).get("description", ""))
