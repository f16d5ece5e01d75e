"""A control law that is handed over as a Python object instead of a file's name."""

import inspect
from collections.abc import Callable
from copy import deepcopy
from pathlib import Path
from typing import Any, NamedTuple

from biped.base.errors import InputError


class Factory(NamedTuple):
    """Makes the law of every run.

    Attributes:
        make: Called with a `biped.control.planar.user.Setup` before every run.
        name: What the scenario calls it: `path.py:Class` where a file has it, else a name that no file can have.
        file: The file that its lines are in; empty if there is none.
    """

    make: Callable[[Any], Any]
    name: str
    file: str


class _Copied:
    """Gives every run its own copy of an instance: what one run leaves in it must not reach the next."""

    def __init__(self, instance: Any):
        self.instance = instance

    def __call__(self, setup: Any) -> Any:
        return deepcopy(self.instance)


def factory_of(law: Any) -> Factory:
    """Returns the factory that makes the law of every run.

    Args:
        law: A class, a function that makes a law from a `Setup`, or an instance with a method `torques`.

    Raises:
        InputError: It is none of these.
    """
    if isinstance(law, Factory):
        return law
    if not isinstance(law, type) and callable(getattr(law, "torques", None)):
        return Factory(_Copied(law), f"python:{type(law).__qualname__}", _file(type(law)))
    if not callable(law):
        raise InputError(
            f"law: expected a class, a function or an instance with a method torques(sensed), got {law!r:.60}", "law"
        )
    name, file = getattr(law, "__qualname__", type(law).__qualname__), _file(law)
    plain = isinstance(law, type) and name.isidentifier() and file.endswith(".py") and Path(file).is_file()
    return Factory(law, f"{Path(file).resolve()}:{name}" if plain else f"python:{name}", file)


def _file(kind: Any) -> str:
    try:
        return inspect.getsourcefile(kind) or ""
    except (OSError, TypeError):  # a prompt's or a notebook's
        return ""
