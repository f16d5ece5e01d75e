"""Validation of users' files: known keys, right types, finite numbers, and the file in which each key was written."""

import math
import re
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from types import UnionType
from typing import Any, NamedTuple, get_args, get_origin, get_type_hints

import msgspec

from biped.base import typed
from biped.base.errors import InputError, echo, safe
from biped.base.files import label, nearest
from biped.scenario.goals import Bound
from biped.scenario.metrics import METRICS
from biped.scenario.randomise import Distribution

MOST_DIGITS = 2**63
"""Beyond it lies no whole number that a file can mean."""

Fail = Callable[[str, str], InputError]
"""From a dotted key and what is wrong with it to the error, which names the file that the key comes from."""


def fault(key: str, what: str) -> InputError:
    """The error of a key that comes from no file."""
    return InputError(f"{key}: {what}", key)


def convert(data: Any, kind: type, fail: Fail) -> Any:
    """Converts plain data to a typed record, turning the library's complaint into ours."""
    try:
        return typed.convert(data, kind)
    except msgspec.ValidationError as error:
        text, _, place = str(error).partition(" - at `$")
        key = place.rstrip("`").lstrip(".")
        raise fail(key or kind.__name__.lower(), humane(text) + _got(data, key, text)) from None


def _got(data: Any, key: str, text: str) -> str:
    """The offending value, where the library's complaint does not say what it got."""
    if "got" in text or "missing" in text or "..." in key:
        return ""
    for part in re.findall(r"\w+", key):
        data = data[int(part)] if part.isdigit() else data[part]
    return f", got {echo(data)}"


def humane(text: str) -> str:
    """A complaint of the library in a user's words."""
    words = {"Object missing required field ": "missing key ", "`float | array`": "a number or a list",
             "`bool | float | str`": "a number, a string, true or false",
             "`float | str`": "a number or a share of the runs",
             "`float`": "a number", "`int`": "a whole number", "`str`": "a string", "`object`": "a table",
             "`array`": "a list", "`bool`": "true or false", "got `null`": "got nothing"}  # fmt: skip
    text = text.replace(" | null`", "`")  # TOML has no null
    for word, ours in words.items():
        text = text.replace(word, ours)
    text = re.sub(r"-?\d{6,}(\.0)?", lambda number: f"{float(number[0]):g}", text)
    return text[0].lower() + text[1:]


def known_keys(data: Any, kind: type, at: str, fail: Fail) -> None:
    """Rejects keys that no field has, and numbers that are not finite, with the nearest valid name."""
    hints = get_type_hints(kind)
    for key, value in data.items():
        dotted = f"{at}{key}"
        if key not in hints:
            raise fail(safe(dotted), f"unknown key; {nearest(key, sorted(hints))}")
        _finite(value, dotted, fail)
        if key in ("draw", "sweep") and isinstance(value, dict):
            _variations(value, dotted, fail)
        elif key in ("expect", "thesis") and isinstance(value, dict):
            _metrics(value, key, fail)
        elif key in ("limits", "floors") and isinstance(value, dict):
            _numbers_of_a_run(value, dotted, fail)
        elif (listed := _listed(hints[key])) is not None:
            if not isinstance(value, list) or not all(isinstance(table, dict) for table in value):
                raise fail(dotted, f"expected a list of tables, each headed [[{dotted}]]")
            for i, table in enumerate(value):
                known_keys(table, listed, f"{dotted}[{i}].", fail)
        elif isinstance(value, dict) and (record := _record(hints[key])) is not None:
            known_keys(value, record, f"{dotted}.", fail)
        elif isinstance(value, dict) and (named := _named_records(hints[key])) is not None:
            for name, inner in value.items():
                _table(inner, named, f"{dotted}.{name}", "{ }", fail)
        elif isinstance(value, str) and (choices := _choices(hints[key])) and value not in choices:
            raise fail(dotted, f"expected one of {', '.join(choices)}, got '{safe(value)}'; {nearest(value, choices)}")


def _metrics(value: dict, key: str, fail: Fail) -> None:
    """Checks [expect] or [thesis]: names of metrics, and bounds or numbers."""
    for name, inner in value.items():
        dotted = f"{key}.{name}"
        if name not in METRICS:
            raise fail(safe(dotted), f"unknown metric; {nearest(name, list(METRICS))}")
        if key == "thesis":
            _finite(inner, dotted, fail)
            if isinstance(inner, bool) or not isinstance(inner, int | float):
                raise fail(dotted, f"expected a number, got {echo(inner)}")
        else:
            _table(inner, Bound, dotted, "{ min = 0.7, max = 1.0 }", fail)


def _numbers_of_a_run(value: dict, at: str, fail: Fail) -> None:
    """Checks the limits or floors of a search: names of metrics that a single run has."""
    known = [metric.name for metric in METRICS.values() if metric.kind == "mean"]
    for name in value:
        if name not in known:
            raise fail(safe(f"{at}.{name}"), f"expected a metric that is not a count of runs; {nearest(name, known)}")


def _variations(value: dict, at: str, fail: Fail) -> None:
    """Checks [randomise.draw] or [sweep]; that their keys exist is for `biped.scenario.vary`."""
    for key, inner in value.items():
        dotted = safe(f'{at}."{key}"')
        if isinstance(inner, dict) and (at == "sweep" or any(isinstance(one, dict) for one in inner.values())):
            raise fail(
                safe(f"{at}.{key}"),
                f'expected the dotted key of what varies in quotes, such as {at}."ground.slope"',
            )
        if at == "sweep":
            _finite(inner, dotted, fail)
            if not isinstance(inner, list) or any(isinstance(one, list | dict) for one in inner):
                raise fail(dotted, f"expected a list of numbers or words, got {echo(inner)}")
        else:
            _table(inner, Distribution, dotted, "{ uniform = [0.5, 1.0] }", fail)


def _table(value: Any, kind: type, at: str, example: str, fail: Fail) -> None:
    if not isinstance(value, dict):
        raise fail(at, f"expected a table such as {example}, got {echo(value)}")
    known_keys(value, kind, f"{at}.", fail)
    convert(value, kind, lambda inside, what: fail(f"{at}.{inside}", what))


def _record(hint: Any) -> type | None:
    """The record that a field holds, if it holds one, perhaps optionally."""
    kinds = [kind for kind in (hint, *get_args(hint)) if isinstance(kind, type) and issubclass(kind, msgspec.Struct)]
    return kinds[0] if kinds and get_origin(hint) in (None, UnionType) else None


def _listed(hint: Any) -> type | None:
    """The records of a list of tables."""
    lists = [part for part in (hint, *get_args(hint)) if get_origin(part) is tuple]
    return _record(get_args(lists[0])[0]) if lists else None


def _named_records(hint: Any) -> type | None:
    """The records that a table of freely named records holds."""
    return _record(get_args(hint)[1]) if get_origin(hint) is dict else None


def _choices(hint: Any) -> list[str]:
    return [choice for part in (hint, *get_args(hint)) for choice in get_args(part) if isinstance(choice, str)]


def _finite(value: Any, key: str, fail: Fail) -> None:
    if isinstance(value, float) and not math.isfinite(value):
        raise fail(key, f"expected a finite number, got {value}")
    if isinstance(value, int) and not -MOST_DIGITS <= value < MOST_DIGITS:
        raise fail(key, f"expected a number of fewer digits, got {echo(value)}")
    if isinstance(value, dict):
        for name, inner in value.items():
            _finite(inner, f"{key}.{safe(name)}", fail)
    if isinstance(value, list):
        for i, inner in enumerate(value):
            _finite(inner, f"{key}[{i}]", fail)


COMMAND_LINE = Path("--set")


class Origin(NamedTuple):
    """Where keys come from.

    Attributes:
        file: The scenario file; None if the scenario was not read from one.
        keys: File (or `COMMAND_LINE`) of each dotted key that somebody wrote.
    """

    file: Path | None = None
    keys: Mapping[str, Path] = {}

    def of(self, key: str) -> str:
        """The file (or --set) that a dotted key comes from; the scenario file if nobody wrote it."""
        asked = at = key.partition("[")[0].replace('"', "")
        while at:
            # Whoever wrote another key of a table did not write this one.
            if at in self.keys and (at == asked or not any(key.startswith(f"{at}.") for key in self.keys)):
                return label(self.keys[at])
            at = at.rpartition(".")[0]
        return "scenario" if self.file is None else label(self.file)

    def fault(self, key: str, what: str) -> InputError:
        """The error of a key: file, key, what is wrong."""
        return InputError(f"{self.of(key)}: {key}: {what}")

    @contextmanager
    def naming(self, table: str = "") -> Iterator[None]:
        """Names the file in complaints about a key that come up after the scenario was read.

        Args:
            table: One whose keys are known by a complaint that begins with them.
        """
        try:
            yield
        except InputError as error:
            begins = table and re.match(rf"{table}[^:]*(?=: )", str(error))
            key = begins[0] if begins else error.key
            if key is None or self.file is None:
                raise
            raise InputError(f"{self.of(key)}: {error}") from error


def table_of(data: Any, kind: type, name: str, origin: Origin) -> Any:
    """A file's table `[name]` as a typed record.

    Raises:
        InputError: It is no table, or a key is missing, unknown or of the wrong type.
    """
    if not isinstance(data, dict):
        raise origin.fault(name, f"expected a table, [{name}], got {echo(data)}")

    def fail(key: str, what: str) -> InputError:
        return origin.fault(f"{name}.{key}", what)

    known_keys(data, kind, "", fail)
    return convert(data, kind, fail)


UNKNOWN = Origin()
