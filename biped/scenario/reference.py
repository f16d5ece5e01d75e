"""docs/scenarios.md from the keys' own docstrings: `python -m biped.scenario.reference` writes it.

The words around the tables are in docs/scenarios.in.md, where `<!-- keys -->` stands for them.
"""

import re
from collections.abc import Iterator
from functools import cache
from inspect import getdoc
from pathlib import Path
from types import UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin, get_type_hints

import msgspec

from biped.base.errors import markdown_table
from biped.base.typed import LARGEST
from biped.scenario.keys import Scenario

DOCS = Path(__file__).parents[2] / "docs"
PAGE, TEMPLATE, MARK = DOCS / "scenarios.md", DOCS / "scenarios.in.md", "<!-- keys -->"
_UNIT = re.compile(r"\[((?:1/)?\(?(?:m|s|rad|kg|N|J|Hz|degrees)(?:[ /²√]+(?:m|s|rad|kg|N|Hz|degrees)\b[²)]*)*)\](?!\()")
"""A unit in brackets."""
_HEAD = ("key", "default", "values", "meaning")


def page() -> str:
    """The text of docs/scenarios.md."""
    return TEMPLATE.read_text(encoding="utf-8").replace(
        MARK, "\n".join(_tables("", Scenario, "## Top level", {})).rstrip()
    )


def meanings(kind: type) -> dict[str, str]:
    """Descriptions of a record's fields in its docstring, by name."""
    _, _, attributes = (getdoc(kind) or "").partition("Attributes:\n")
    found = re.findall(r"^    (\w+): (.*(?:\n {8}.*)*)", attributes, re.MULTILINE)
    return {name: " ".join(text.split()) for name, text in found}


@cache
def unit_of(key: str) -> str:
    """The unit of a dotted key as its docstring gives it, degrees as °; empty where there is none.

    Args:
        key: Such as `ground.slope` or `push.0.force.1`.
    """
    kind: type | None = Scenario
    unit = ""
    for part in (part for part in key.split(".") if not part.isdigit()):
        if kind is None or part not in (hints := get_type_hints(kind, include_extras=True)):
            return ""
        meaning = meanings(kind).get(part, "")
        found = _UNIT.search(meaning)
        unit = "°" if meaning.startswith("Degrees") else found.group(1) if found else ""
        kind = _record(part, hints[part])[0]
    return unit


def _tables(at: str, kind: type, head: str, shown: dict[type, str]) -> Iterator[str]:
    """One section for the fields of a record, then one for each record within it, unless it was shown before."""
    meaning, hints = meanings(kind), get_type_hints(kind, include_extras=True)
    defaults = {field.name: field for field in msgspec.structs.fields(kind)}
    rows, inner = [], []
    for name, hint in hints.items():
        record, title, path = _record(f"{at}{name}", hint)
        if record is not None and record in shown:
            rows.append((f"`{path}KEY`", "", "", f"As `{shown[record]}KEY`."))
        elif record is None:
            rows.append((f"`{at}{name}`", _default(defaults[name]), _values(hint), meaning[name]))
        else:
            inner.append((record, title, path))
    shown[kind] = at
    summary = (getdoc(kind) or "").partition("Attributes:")[0].strip()
    yield f"{head}\n{summary if at else ''}\n".replace("\n\n", "\n")
    yield markdown_table(_HEAD, ([cell.replace("|", "\\|") for cell in row] for row in rows)) + "\n"
    for record, title, path in inner:
        yield from _tables(path, record, f"### {title}", shown)


def _record(path: str, hint: Any) -> tuple[type | None, str, str]:
    """The record that a field holds, the title of its section, and what its keys begin with."""
    hint = _bare(hint)
    options = [_bare(part) for part in get_args(hint)] if get_origin(hint) in (Union, UnionType) else [hint]
    for option in options:
        if isinstance(option, type) and issubclass(option, msgspec.Struct):
            return option, f"`[{path}]`", f"{path}."
        parts = get_args(option)
        if parts and isinstance(parts[-1 if get_origin(option) is dict else 0], type):
            part = parts[-1 if get_origin(option) is dict else 0]
            if issubclass(part, msgspec.Struct):
                if get_origin(option) is dict:
                    name = {"expect": "METRIC", "draw": '"KEY"', "keys": '"KEY"'}.get(path.rpartition(".")[2], "NAME")
                    return part, f"`[{path}]`", f"{path}.{name}."
                return part, f"`[[{path}]]`", f"{path}."
    return None, "", ""


def _bare(hint: Any) -> Any:
    return get_args(hint)[0] if get_origin(hint) is Annotated else hint


def _default(field: Any) -> str:
    if field.default is msgspec.NODEFAULT:
        return "" if field.default_factory is msgspec.NODEFAULT else "none"
    value = field.default
    if value is None or value in ((), ""):
        return ""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return f'`"{value}"`'
    if isinstance(value, tuple):
        return f"{len(value)} × {value[0]:g}" if len(set(value)) == 1 else ", ".join(f"{one:g}" for one in value)
    return f"{value:g}" if isinstance(value, float) else str(value)


def _values(hint: Any) -> str:
    """The values of a field in words."""
    bounds = [meta for meta in get_args(hint)[1:] if get_origin(hint) is Annotated]
    hint = _bare(hint)
    kind, parts = get_origin(hint), get_args(hint)
    if set(parts) == {bool, float, str}:
        return "number, text, true or false"
    if kind in (Union, UnionType):
        return " or ".join(dict.fromkeys(_values(part) for part in parts if part is not type(None)))
    if kind is Literal:
        return ", ".join(f'`"{choice}"`' for choice in parts)
    if kind is tuple:
        if parts[-1] is not Ellipsis:
            each = _values(parts[0])
            return f"{len(parts)} × {each}"
        length = next((meta.min_length for meta in bounds if meta.min_length is not None), None)
        each = _values(parts[0])
        return f"list of {each}" if length is None else f"{length} × {each}"
    if kind is dict:
        return f"table of {_values(parts[1])}"
    words = {bool: "true, false", float: "number", int: "whole number", str: "text", Any: "anything"}
    return words[hint] + "".join(_bound(meta) for meta in bounds)


def _bound(meta: msgspec.Meta) -> str:
    low = [f"{sign} {value:g}" for sign, value in ((">", meta.gt), ("≥", meta.ge)) if _is_bound(value)]
    high = [f"{sign} {value:g}" for sign, value in (("<", meta.lt), ("≤", meta.le)) if _is_bound(value)]
    if _is_bound(meta.ge) and _is_bound(meta.le):
        return f" {meta.ge:g} … {meta.le:g}"
    return "".join(f" {bound}," for bound in low + high).rstrip(",")


def _is_bound(value: float | None) -> bool:
    """Whether a bound says something about this number, not about all numbers."""
    return value is not None and abs(value) < LARGEST


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
