"""Python's values as what stands after `--set`."""

import json
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from biped.base.errors import InputError


def setting(key: str, value: Any) -> str:
    """A change as `KEY=VALUE`.

    Args:
        key: Dotted key of a scenario.
        value: Number, string, path, sequence, array or mapping of such.

    Raises:
        InputError: The value is none of these.
    """
    return f"{key}={_toml(key, value)}"


def _toml(key: str, value: Any) -> str:
    if hasattr(value, "tolist"):  # numpy's numbers and arrays
        value = value.tolist()
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int | float):
        return repr(value)
    if isinstance(value, str | Path):
        return json.dumps(str(value), ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, Mapping):
        items = (f"{_name(str(name))} = {_toml(f'{key}.{name}', inner)}" for name, inner in value.items())
        return "{" + ", ".join(items) + "}"
    if isinstance(value, list | tuple | range):
        return "[" + ", ".join(_toml(key, inner) for inner in value) + "]"
    raise InputError(f"{key}: expected a number, a string, a list or a table, got {type(value).__name__} {value!r:.60}")


def _name(text: str) -> str:
    return text if re.fullmatch(r"[\w-]+", text, re.ASCII) else json.dumps(text, ensure_ascii=False)
