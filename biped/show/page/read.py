"""Reading what a command wrote, whoever sent it: checked against what the page relies on, texts harmless."""

import json
from pathlib import Path
from typing import Any

import msgspec

from biped.base.errors import InputError
from biped.base.files import label
from biped.base.typed import convert
from biped.show.words import harmless

_MOST = 200_000_000
"""[bytes] of a file that is read."""


def read_as(file: Path, kind: Any, what: str, again: str) -> Any:
    """The object in a JSON file.

    Args:
        file: The file.
        kind: msgspec's type of what is relied on.
        what: What it is expected to be, in words.
        again: The command that makes it anew.

    Raises:
        InputError: It cannot be read or is something else.
    """
    try:
        if file.stat().st_size > _MOST:
            raise InputError(f"{label(file)}: expected {what} of at most {_MOST // 1_000_000} MB")
        found = harmless(json.loads(file.read_bytes()))
        convert(found, kind)
    except OSError as error:
        raise InputError(f"{label(file)}: cannot be read: {str(error.strerror).lower()}") from None
    except (ValueError, RecursionError, msgspec.MsgspecError) as error:
        why = " ".join(str(error).split())[:200]
        raise InputError(f"{label(file)}: expected {what}: {why}; make it again with: {again}") from None
    return found
