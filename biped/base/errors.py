"""The one family of errors that users see, and words of somebody else made safe to print in them."""

import re
from collections.abc import Iterable, Sequence
from typing import Any


class BipedError(Exception):
    """Base of every error biped raises on purpose; the command line prints it without a traceback."""


class InputError(BipedError):
    """Something the user wrote cannot be used (exit code 2).

    Args:
        message: One paragraph: file, key, what was expected, the nearest valid name.
        key: Key of the scenario that the message begins with, where the file it comes from is yet to be named.
    """

    def __init__(self, message: str, key: str | None = None):
        super().__init__(message)
        self.key = key


class RunError(BipedError):
    """A run could not be carried to its end (exit code 1): says time, quantity and cause."""


_HIDDEN = re.compile(
    "[\x00-\x1f\x7f-\x9f\u061c\u200b-\u200f\u2028-\u202e\u2060-\u2069\ufeff\ufff9-\ufffb\ud800-\udfff\U000e0000-\U000e007f]"
)
"""Characters that move a terminal's cursor, turn the direction of writing, or are invisible."""

ECHO, PARAGRAPH = 120, 1200
"""Most characters of a value that is repeated to whoever wrote it, and of a whole complaint."""


def plain(text: Any) -> str:
    """The text with everything that a terminal would obey, or hide, written out by its number."""
    return _HIDDEN.sub(_written_out, str(text))


def _written_out(found: re.Match[str]) -> str:
    code = ord(found[0])
    return f"\\x{code:02x}" if code < 0x100 else f"\\u{code:04x}" if code < 0x10000 else f"\\U{code:08x}"


def short(text: Any, most: int = ECHO) -> str:
    """The text, its middle left out where it is longer than `most` characters."""
    text = str(text)
    if len(text) <= most:
        return text
    head = (most - 1) * 2 // 3
    return f"{text[:head]}…{text[len(text) - (most - 1 - head) :]}"


def safe(text: Any) -> str:
    """A name or text that somebody wrote, to be repeated in a complaint."""
    return short(plain(text))


def echo(value: Any) -> str:
    """A value as its author may have written it, on one line and not too long."""
    if isinstance(value, int) and value.bit_length() > 64:
        return f"a whole number of {value.bit_length()} bits"
    if isinstance(value, list | tuple) and len(value) > ECHO:
        return f"a list of {len(value)}"
    try:
        return short(plain(repr(value)))
    except (ValueError, RecursionError):  # such an integer deep inside
        return f"a {type(value).__name__}"


def markdown_table(head: Sequence[str], rows: Iterable[Sequence[Any]]) -> str:
    """A table in Markdown, of cells that are Markdown already."""
    lines = (f"| {' | '.join(map(str, cells))} |" for cells in (head, *rows))
    return "\n".join([next(lines), "|" + "---|" * len(head), *lines])


def why(error: Exception) -> str:
    """A library's words on what it found, on one line and not too long."""
    return " ".join(str(error).split())[:200]


def paragraph(text: Any) -> str:
    """A complaint as one paragraph that is safe to print."""
    return short(plain(" ".join(str(text).split())), PARAGRAPH)
