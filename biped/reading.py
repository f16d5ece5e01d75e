"""From a scenario file and the command line's changes to a checked `Scenario`; every complaint names file and key."""

from __future__ import annotations

import math
import re
import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Any, get_args, get_type_hints

import msgspec

from biped.errors import InputError
from biped.files import canonical, label, layered, locate, merge, nearest
from biped.scenario import GAINS, Bound, Distribution, Gains, Push, Scenario

COMMAND_LINE = Path("--set")
_DICTIONARIES = {"expect": Bound, "thesis": None}
_FREE = ("draw", "sweep")
"""Tables whose keys are dotted keys of the scenario; `biped.vary` checks those."""


def read_scenario(name: str, changes: Sequence[str] = ()) -> Scenario:
    """Reads, layers, overrides and checks a scenario.

    Args:
        name: A scenario's name or path.
        changes: `key.path=VALUE` strings, VALUE being TOML or a bare word.

    Raises:
        InputError: Anything in it is unknown, of the wrong type, impossible or missing.
    """
    path = locate("scenarios", name, "scenario")
    data, origin = layered(path, "scenarios")
    for change in changes:
        merge(data, _change(change), origin, COMMAND_LINE)
    return _checked(data, origin, path)


def _change(text: str) -> dict[str, Any]:
    key, equals, value = text.partition("=")
    key = key.strip()
    if not equals or not re.fullmatch(r"[\w-]+(\.[\w-]+)*", key):
        raise InputError(f"--set {text}: expected key.path=VALUE")
    try:
        parsed = tomllib.loads(f"value = {value}")["value"]
    except tomllib.TOMLDecodeError:
        if not re.fullmatch(r"[^\s\"'\[\]{}=,]+", value.strip()):
            raise InputError(f"--set {text}: '{value}' is neither a TOML value nor a single word") from None
        parsed = value.strip()
    parts = key.split(".")
    table: dict[str, Any] = {parts[-1]: parsed}
    for part in reversed(parts[:-1]):
        table = {part: table}
    return table


def source(key: str, origin: dict[str, Path], path: Path) -> str:
    """The file (or --set) that a dotted key comes from."""
    while key:
        if key in origin:
            return label(origin[key])
        key = key.rpartition(".")[0]
    return label(path)


def _checked(data: dict[str, Any], origin: dict[str, Path], path: Path) -> Scenario:
    def fail(key: str, what: str) -> InputError:
        return InputError(f"{source(key, origin, path)}: {key}: {what}")

    _known_keys(data, Scenario, "", fail)
    scenario = convert(data, Scenario, fail)
    _possible(scenario, fail)
    # A controller, model or law named in a file is looked for beside that file too.
    beside = {key: origin[key].parent for key in ("model", "controller", "law") if key in origin}
    found = {}
    for key in ("model", "controller"):
        at = locate(f"{key}s", getattr(scenario, key), f"{source(key, origin, path)}: {key}", beside.get(key))
        found[key] = canonical(f"{key}s", at)
    if scenario.law is not None:
        found["law"] = _law(scenario.law, beside.get("law"), fail)
    return msgspec.structs.replace(scenario, **found)


def _law(text: str, beside: Path | None, fail) -> str:
    file, colon, name = text.rpartition(":")
    if not colon or not file.endswith(".py") or not name.isidentifier():
        raise fail("law", f"expected 'path.py:Class', got '{text}'")
    for candidate in (Path(file), (beside or Path()) / file):
        if candidate.is_file():
            return f"{candidate}:{name}"
    raise fail("law", f"no file '{file}'; expected a Python file, relative to the scenario or the working folder")


def convert(data: Any, kind: type, fail) -> Any:
    """Converts plain data to a typed record, turning the library's complaint into ours."""
    try:
        return msgspec.convert(data, kind)
    except msgspec.ValidationError as error:
        text, _, place = str(error).partition(" - at `$")
        raise fail(place.rstrip("`").lstrip(".") or kind.__name__.lower(), _humane(text)) from None


def _humane(text: str) -> str:
    words = {"`float`": "a number", "`int`": "a whole number", "`str`": "a string", "`object`": "a table",
             "`array`": "a list", "`bool`": "true or false", "got `null`": "got nothing"}  # fmt: skip
    for word, plain in words.items():
        text = text.replace(word, plain)
    return text[0].lower() + text[1:]


def _known_keys(data: Any, kind: type, at: str, fail) -> None:
    """Rejects keys that no field has, and numbers that are not finite, with the nearest valid name."""
    hints = get_type_hints(kind)
    for key, value in data.items():
        dotted = f"{at}{key}"
        if key not in hints:
            raise fail(dotted, f"unknown key; {nearest(key, sorted(hints))}")
        _finite(value, dotted, fail)
        if key in _FREE and isinstance(value, dict):
            for inner in value.values():
                if key == "draw" and isinstance(inner, dict):
                    _known_keys(inner, Distribution, f"{dotted}.*.", fail)
        elif key in _DICTIONARIES and isinstance(value, dict):
            _dictionary(value, key, _DICTIONARIES[key], fail)
        elif key == "push" and isinstance(value, list):
            for i, push in enumerate(value):
                if isinstance(push, dict):
                    _known_keys(push, Push, f"push[{i}].", fail)
        elif isinstance(value, dict) and isinstance(hints[key], type) and issubclass(hints[key], msgspec.Struct):
            _known_keys(value, hints[key], f"{dotted}.", fail)
        elif isinstance(value, str) and (choices := _choices(hints[key])) and value not in choices:
            raise fail(dotted, f"expected one of {', '.join(choices)}, got '{value}'; {nearest(value, choices)}")


def _dictionary(value: dict, key: str, kind: type | None, fail) -> None:
    from biped.metrics import NAMES

    for name, inner in value.items():
        if name not in NAMES:
            raise fail(f"{key}.{name}", f"unknown metric; {nearest(name, list(NAMES))}")
        if kind is not None and isinstance(inner, dict):
            _known_keys(inner, kind, f"{key}.{name}.", fail)


def _choices(hint: Any) -> list[str]:
    return [choice for choice in get_args(hint) if isinstance(choice, str)]


def _finite(value: Any, key: str, fail) -> None:
    if isinstance(value, float) and not math.isfinite(value):
        raise fail(key, f"expected a finite number, got {value}")
    if isinstance(value, list):
        for i, inner in enumerate(value):
            _finite(inner, f"{key}[{i}]", fail)


def _possible(s: Scenario, fail) -> None:
    """What types cannot say."""
    for i, push in enumerate(s.push):
        if push.at >= s.duration:
            raise fail(f"push[{i}].at", f"expected a time within the run (duration {s.duration} s), got {push.at}")
    start, end = s.interval
    for key, given in (("window.start", s.window.start), ("window.end", s.window.end)):
        if given is not None and given > s.duration:
            raise fail(key, f"expected a time within the run (duration {s.duration} s), got {given}")
    if end <= start:
        raise fail("window", f"expected start < end, got [{start}, {end}] s")
    if s.duration < 2 * s.simulation.timestep:
        raise fail("duration", f"expected at least two time steps of {s.simulation.timestep} s, got {s.duration}")
    steps = 1.0 / (s.simulation.control_rate * s.simulation.timestep)
    if round(steps) < 1 or abs(steps - round(steps)) > 1e-6 * steps:
        raise fail(
            "simulation.control_rate",
            f"expected 1/control_rate to be a whole number of time steps of {s.simulation.timestep} s, "
            f"got {steps:g} steps",
        )
    if s.actuation.null_torque is not None and s.actuation.mode != "joint":
        raise fail("actuation.null_torque", "expected mode = 'joint': generalized forces leave nothing free")
    for name, bound in s.expect.items():
        if bound.min is None and bound.max is None:
            raise fail(f"expect.{name}", "expected min, max or both")
        if bound.min is not None and bound.max is not None and bound.min > bound.max:
            raise fail(f"expect.{name}", f"expected min <= max, got {bound.min} > {bound.max}")
    for key, distribution in s.randomise.draw.items():
        given = [name for name in distribution.__struct_fields__ if getattr(distribution, name) is not None]
        if len(given) != 1:
            raise fail(f'randomise.draw."{key}"', f"expected exactly one of normal, uniform, choice, grid, got {given}")
        if distribution.choice == () or distribution.grid == ():
            raise fail(f'randomise.draw."{key}"', "expected at least one value")
    if len(s.sweep) > 2:
        raise fail("sweep", f"expected one or two keys, got {len(s.sweep)}")
    for key, values in s.sweep.items():
        if not values:
            raise fail(f'sweep."{key}"', "expected at least one value")
        if key in s.randomise.draw:
            raise fail(f'sweep."{key}"', "expected a key that is not drawn at random as well")
    if s.simulation.integrator == "RK4" and s.ground.contact_time < 2 * s.simulation.timestep:
        raise fail("ground.contact_time", "expected at least two time steps")


def read_gains(path: Path, override: Gains) -> Gains:
    """Reads a controller file (and what it extends) and lays a scenario's own gains over it.

    Raises:
        InputError: A gain is missing, unknown or of the wrong type.
    """
    data, origin = layered(path, "controllers")
    for word in ("description", "source"):
        data.pop(word, None)

    def fail(key: str, what: str) -> InputError:
        return InputError(f"{source(key, origin, path)}: {key}: {what}")

    speeds = data.pop("speeds", ())
    _known_keys(data, Gains, "", fail)
    gains = convert(data, Gains, fail)
    if override.speed is not None:
        from biped.family import Knot, gains_at

        knots = convert(speeds, tuple[Knot, ...], lambda key, what: fail(f"speeds{key}", what))
        gains = msgspec.structs.replace(gains, **gains_at(knots, override.speed, fail))
    merged = {name: mine if (mine := getattr(override, name)) is not None else getattr(gains, name) for name in GAINS}
    missing = [name for name, value in merged.items() if value is None]
    if missing:
        raise InputError(f"{label(path)}: {missing[0]}: missing; a gait has {', '.join(merged)}")
    return Gains(**merged)


def to_toml(scenario: Scenario, gains: Gains) -> str:
    """The effective scenario, every default and gain written out, as a scenario file."""
    import tomli_w

    data = msgspec.to_builtins(msgspec.structs.replace(scenario, gains=gains))
    return tomli_w.dumps(_without_none(data))


def _without_none(value: Any) -> Any:
    if isinstance(value, dict):
        return {k: _without_none(v) for k, v in value.items() if v is not None}
    if isinstance(value, list | tuple):
        return [_without_none(v) for v in value]
    return value


def changed(scenario: Scenario, part: dict[str, Any], where: Path) -> Scenario:
    """The scenario with part of another laid over it, checked like a file called `where`.

    Raises:
        InputError: Anything in the part is unknown, of the wrong type or impossible.
    """
    data = _without_none(msgspec.to_builtins(scenario))
    origin: dict[str, Path] = {}
    merge(data, _without_none(part), origin, where)
    return _checked(data, origin, where)
