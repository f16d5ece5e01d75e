"""Results as JSON: a number that does not exist is null."""

import json
import math
from typing import Any


def dumps(value: Any, indent: int | None = None) -> str:
    """JSON of a result; a number that does not exist is null."""
    return json.dumps(_without_nan(value), indent=indent, ensure_ascii=False, allow_nan=False)


def _without_nan(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _without_nan(inner) for key, inner in value.items()}
    if isinstance(value, list | tuple):
        return [_without_nan(inner) for inner in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def with_nan(record: dict[str, Any]) -> dict[str, Any]:
    """A record that was read, null being a number that does not exist."""
    return {key: math.nan if inner is None else inner for key, inner in record.items()}
