"""Changes of a scenario from the command line: `--set KEY=VALUE`, entries of lists and of a gait's lists included."""

import re
from collections.abc import Mapping, Sequence
from copy import deepcopy
from pathlib import Path
from typing import Any

from biped.base.errors import InputError, safe
from biped.base.files import DEEPEST, label, locate, merge, parse_toml
from biped.base.typed import Section
from biped.scenario.gains import Gains
from biped.scenario.gait import read_gains
from biped.scenario.valid import COMMAND_LINE
from biped.scenario.vary import ENTRY

_WHOSE_LISTS = {"controller", "gains.speed"}
"""Keys that say which gait's lists are meant."""


def lay_changes(data: dict[str, Any], origin: dict[str, Path], changes: Sequence[str]) -> None:
    """Lays changes over a scenario in place, in their order; entries of a gait's lists last, of whichever gait it has.

    Args:
        data: The scenario, its layers merged.
        origin: The file of each dotted key, which is changed too.
        changes: `key.path=VALUE` strings, VALUE being TOML or a bare word.

    Raises:
        InputError: One is none, or an entry is not there.
    """
    parsed = [_change_of(text) for text in changes]
    for change in sorted(parsed, key=lambda change: _has_entries(change.get("gains"))):
        if _has_entries(change.get("gains")):
            _lay_lists(data, origin, change["gains"])
        merge(data, _in_lists(data, change), origin, COMMAND_LINE, emptied=True)


def _are_entries(change: Any) -> bool:
    """Whether a change is of entries of a list alone, by their numbers."""
    return isinstance(change, dict) and bool(change) and all(ENTRY.fullmatch(part) for part in change)


def _has_entries(change: Any) -> bool:
    """Whether entries of a list are part of a change, such as theta_l.2."""
    return isinstance(change, dict) and (_are_entries(change) or any(map(_has_entries, change.values())))


def _lay_lists(data: dict[str, Any], origin: dict[str, Path], change: Mapping[str, Any]) -> None:
    """Lays those of the gait's own lists whose entries change under the scenario's gains."""
    gait, mine = data.get("controller"), data.get("gains", {})
    if not isinstance(gait, str) or not isinstance(mine, dict):
        return  # what reads the scenario says so
    randomise = data.get("randomise")
    draw = randomise.get("draw") if isinstance(randomise, dict) else None
    for table, varied in (("sweep", data.get("sweep")), ("randomise.draw", draw)):
        if isinstance(varied, dict) and not _WHOSE_LISTS.isdisjoint(varied):
            raise InputError(f"--set gains: expected whole lists while {table} has several gaits, each with its own; "
                             "to change an entry, give one controller, at one gains.speed")  # fmt: skip
    beside = origin["controller"].parent if "controller" in origin else None
    speed = change.get("speed", mine.get("speed"))
    path = locate("controllers", gait, "controller", beside)
    whole = read_gains(path, Gains(speed=speed) if isinstance(speed, int | float) else Gains())
    merge(data, {"gains": _lists_of(whole, change, mine, path)}, origin, COMMAND_LINE)


def _lists_of(gains: Any, change: Mapping[str, Any], mine: Any, path: Path, at: str = "gains.") -> dict[str, Any]:
    out: dict[str, Any] = {}
    for name, inner in change.items():
        there = mine.get(name) if isinstance(mine, dict) else None
        value = getattr(gains, name, None)
        if not _has_entries(inner) or name not in getattr(gains, "__struct_fields__", ()):
            continue
        if value is None and there is None:
            raise InputError(f"--set {at}{name}: {label(path)} has none, so none of its entries can change")
        if isinstance(value, tuple) and there is None:
            out[name] = list(value)
        elif isinstance(value, Section):
            out[name] = _lists_of(value, inner, there, path, f"{at}{name}.")
    return out


_PART = r"[\w-]+|\"[^\"\\\n]*\"|'[^'\n]*'"
"""Of a dotted key, as TOML has it."""
_SETTING = re.compile(rf"\s*(?P<key>(?:{_PART})(?:\s*\.\s*(?:{_PART}))*)\s*=(?P<value>.*)", re.DOTALL)


def _change_of(text: str) -> dict[str, Any]:
    written, shown = _SETTING.fullmatch(text), safe(text)
    if written is None:
        raise InputError(f"--set {shown}: expected KEY=VALUE, such as ground.slope=2 or start.posture=flat")
    value = written["value"]
    if not value.strip():
        raise InputError(f"--set {shown}: expected a value after =, such as 2, flat or [1, 2]")
    parts = [part[1:-1] if part[0] in "\"'" else part for part in re.findall(_PART, written["key"])]
    if len(parts) > DEEPEST:
        raise InputError(f"--set {shown}: expected a key of at most {DEEPEST} parts")
    try:
        parsed = parse_toml(f"value = {value}")
        if len(parsed) > 1:
            raise InputError(f"--set {shown}: expected one value, got several lines")
    except ValueError:
        if not re.fullmatch(r"[^\s\"'\[\]{}=,]+", value.strip()):
            what = safe(value)
            raise InputError(f"--set {shown}: '{what}' is neither a TOML value nor a single word") from None
        parsed = {"value": value.strip()}
    table: dict[str, Any] = {parts[-1]: parsed["value"]}
    for part in reversed(parts[:-1]):
        table = {part: table}
    return table


def _in_lists(below: Any, change: dict[str, Any], at: str = "") -> dict[str, Any]:
    """A change whose entries of lists, such as push.0.force, stand in the whole list that it changes."""
    out: dict[str, Any] = {}
    for part, value in change.items():
        there = below.get(part) if isinstance(below, dict) else None
        key = f"{at}{part}"
        if not isinstance(value, dict):
            out[part] = value
        elif isinstance(there, list) and _are_entries(value):
            out[part] = _with_entries(there, value, key)
        else:
            out[part] = _in_lists(there, value, f"{key}.")
    return out


def _with_entries(entries: list[Any], change: dict[str, Any], key: str) -> list[Any]:
    """A list with some of its entries changed, by their numbers."""
    out = deepcopy(entries)
    for number, value in change.items():
        if int(number) >= len(out):
            raise InputError(
                f"--set {key}.{number}: expected an entry of {key}, which has {len(out)}; they count from 0"
            )
        there = out[int(number)]
        changed = _in_lists({number: there}, {number: value}, f"{key}.")[number]
        if isinstance(changed, dict) and isinstance(there, dict):
            merge(there, changed, {}, COMMAND_LINE, emptied=True)
        else:
            out[int(number)] = changed
    return out
