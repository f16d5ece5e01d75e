"""`biped list`: what has a name."""

from __future__ import annotations

import argparse

from biped.base.catalogue import listing
from biped.cli.common import DONE


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
