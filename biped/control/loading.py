"""A law of the user's own from its file: loaded if it is trusted, apart from every other law, and blamed by line."""

import importlib.util
import re
import signal
import sys
import threading
import traceback
from collections.abc import Callable
from pathlib import Path
from typing import Any

from biped.base.errors import InputError
from biped.base.files import label, nearest
from biped.base.trust import refusal, trusted
from biped.scenario.laws import changed_since

MOST_SIGNALS = 64
"""Of a law's own."""


def signal_names(signals: Any, fault: Callable[[str], InputError]) -> tuple[str, ...]:
    """Names of a law's own signals, which it has when it is made.

    Args:
        signals: What it has.
        fault: Makes the error.

    Raises:
        InputError: They are not names of numbers.
    """
    if not isinstance(signals, dict):
        raise fault(f"signals: expected a dict of names and numbers, got {in_words(repr, signals):.60}")
    for name in signals:
        if not isinstance(name, str) or not re.fullmatch(r"[A-Za-z]\w{0,59}", name, re.ASCII):
            raise fault(f"signals: expected names of letters, digits and _, got {in_words(repr, name):.80}")
    if len(signals) > MOST_SIGNALS:
        raise fault(f"signals: expected at most {MOST_SIGNALS}, got {len(signals)}")
    return tuple(signals)


def error_text(error: BaseException, file: str) -> str:
    """An exception in words, with the line of the user's file that it came from."""
    lines = [frame.lineno for frame in traceback.extract_tb(error.__traceback__) if frame.filename == file]
    where = f" ({Path(file).name}, line {lines[-1]})" if lines else ""
    return f"{type(error).__name__}: {' '.join(in_words(str, error).split())}{where}"


def in_words(words: Callable[[object], str], value: object) -> str:
    """A law's value or exception in words, even where its own `__str__` or `__repr__` raises."""
    try:
        return f"{words(value):.2000}"
    except BaseException as error:
        if interrupts(error):
            raise
        return f"({type(value).__name__} without words: {words.__name__}() of it raised {type(error).__name__})"


def interrupts(error: BaseException) -> bool:
    """Whether an exception is the user's Ctrl-C; a worker process and a thread never hear it: there a law raised it."""
    hears = threading.current_thread() is threading.main_thread() and signal.getsignal(signal.SIGINT) != signal.SIG_IGN
    return isinstance(error, KeyboardInterrupt) and hears


def _forget(names: set[str], folder: Path) -> None:
    """Forgets helpers from a law's folder: one of the same name beside the next law is another one."""
    for name in names:
        origin = getattr(sys.modules[name], "__file__", None)
        if origin and Path(origin).is_relative_to(folder):
            del sys.modules[name]


def load_law(law: str, sha256: str | None = None) -> type:
    """The class that `path.py:Class` names.

    Args:
        law: File and class.
        sha256: What the law must be (`biped.scenario.laws.digest`); None: whatever it is.

    Raises:
        InputError: The file is not trusted, has changed, cannot be imported or has no such class.
    """
    file, _, name = law.rpartition(":")
    shown = label(Path(file))
    # The one door that every law goes through: whoever forgets to ask earlier ends here.
    if not trusted(Path(file)):
        raise InputError(f"law: {refusal(Path(file))}", "law")
    if changed := changed_since(law, sha256):
        raise InputError(f"law: {changed}", "law")
    spec = importlib.util.spec_from_file_location(f"biped_law_{Path(file).stem}", file)
    if spec is None:
        raise InputError(f"law: {shown} cannot be loaded as a Python file", "law")
    module = importlib.util.module_from_spec(spec)
    # Dataclasses and pickle look a class's module up by name; helpers may lie beside the file.
    sys.modules[spec.name] = module
    before = set(sys.modules)
    sys.path.append(str(Path(file).parent))
    try:
        # What is read is what runs: the loader would prefer compiled code that lies beside it.
        exec(compile(Path(file).read_bytes(), file, "exec", dont_inherit=True), module.__dict__)
    except BaseException as error:
        if interrupts(error):
            raise
        raise InputError(f"law: importing {shown} raised {error_text(error, file)}", "law") from error
    finally:
        sys.path.pop()
        _forget(set(sys.modules) - before, Path(file).parent)
    kind = getattr(module, name, None)
    if not isinstance(kind, type):
        there = [n for n, value in vars(module).items() if isinstance(value, type)]
        raise InputError(f"law: {shown} has no class '{name}'; {nearest(name, there)}", "law")
    return kind
