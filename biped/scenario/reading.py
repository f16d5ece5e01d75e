"""From a scenario file and the command line's changes to a checked `Scenario`; every complaint names file and key."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import msgspec
from msgspec.structs import replace

from biped.base.errors import InputError
from biped.base.files import canonical, description_of, label, layered, locate, merge, nearest, read_toml
from biped.scenario import thesis
from biped.scenario.gains import GAINS, Gains
from biped.scenario.keys import Scenario
from biped.scenario.valid import convert, known_keys, possible

COMMAND_LINE = Path("--set")


def read_scenario(name: str, changes: Sequence[str] = ()) -> Scenario:
    """Reads, layers, overrides and checks a scenario; the thesis's numbers of another gait or place are left out.

    Args:
        name: A scenario's name or path.
        changes: `key.path=VALUE` strings, VALUE being TOML or a bare word.

    Raises:
        InputError: Anything in it is unknown, of the wrong type, impossible or missing.
    """
    data, origin, path = _layers(name, changes)
    scenario = _checked(data, origin, path)
    return replace(scenario, thesis=thesis.about(data, origin)) if scenario.thesis else scenario


def _layers(name: str, changes: Sequence[str]) -> tuple[dict[str, Any], dict[str, Path], Path]:
    path = locate("scenarios", name, "")
    data, origin = layered(path, "scenarios")
    for change in changes:
        merge(data, _change(change), origin, COMMAND_LINE)
    _on_robot(data, origin)
    return data, origin, path


def _on_robot(data: dict[str, Any], origin: dict[str, Path]) -> None:
    """Lays what the robot's description says of scenarios under what this one says.

    The step back is none of a robot's habits: its numbers are the robot's, but a scenario asks for it.
    """
    name = data.get("model", "human")
    beside = origin["model"].parent if "model" in origin else None
    try:
        path = description_of(locate("models", name, "", beside))
    except (InputError, AttributeError):
        return  # a model that is not there, or no name at all, is refused where the scenario is checked
    habits = read_toml(path).get("scenario", {})
    if not isinstance(habits, dict):
        raise InputError(f"{label(path)}: scenario: expected a table, [scenario], got {habits!r}")
    if "backstep" not in data:
        habits.pop("backstep", None)
    _lay_under(data, habits, origin, path)


def _lay_under(data: dict[str, Any], below: dict[str, Any], origin: dict[str, Path], path: Path, at: str = "") -> None:
    for key, value in below.items():
        if key not in data:
            merge(data, {key: value}, origin, path, at)
        elif isinstance(value, dict) and isinstance(data[key], dict):
            _lay_under(data[key], value, origin, path, f"{at}{key}.")


@contextmanager
def blaming(name: str, changes: Sequence[str] = ()) -> Iterator[None]:
    """Names the file in complaints about a key of this scenario that come up after it was read."""
    try:
        yield
    except InputError as error:
        if error.key is None:
            raise
        _, origin, path = _layers(name, changes)
        raise InputError(f"{source(error.key, origin, path)}: {error}") from error


def _change(text: str) -> dict[str, Any]:
    key, equals, value = text.partition("=")
    key = key.strip()
    if not equals or not re.fullmatch(r"[\w-]+(\.[\w-]+)*", key):
        raise InputError(f"--set {text}: expected KEY=VALUE, such as ground.slope=2 or start.posture=flat")
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
    key = key.partition("[")[0]
    while key:
        if key in origin:
            return label(origin[key])
        key = key.rpartition(".")[0]
    return label(path)


def _checked(data: dict[str, Any], origin: dict[str, Path], path: Path) -> Scenario:
    def fail(key: str, what: str) -> InputError:
        return InputError(f"{source(key, origin, path)}: {key}: {what}")

    known_keys(data, Scenario, "", fail)
    scenario = convert(data, Scenario, fail)
    possible(scenario, fail)
    # A controller, model or law named in a file is looked for beside that file too.
    beside = {key: origin[key].parent for key in ("model", "controller", "law") if key in origin}

    def named(kind: str, name: str, key: str, folder: Path | None) -> str:
        return canonical(kind, locate(kind, name, f"{source(key, origin, path)}: {key}", folder))

    found: dict[str, Any] = {
        key: named(f"{key}s", getattr(scenario, key), key, beside.get(key)) for key in ("model", "controller")
    }
    if scenario.change:
        folder = origin["change"].parent if "change" in origin else None
        gaits = [change.controller for change in scenario.change]
        found["change"] = tuple(
            change if gait is None
            else replace(change, controller=named("controllers", gait, f"change[{i}].controller", folder))
            for i, (change, gait) in enumerate(zip(scenario.change, gaits, strict=True))
        )  # fmt: skip
    if scenario.law is not None:
        found["law"] = _law(scenario.law, beside.get("law"), fail)
    return replace(scenario, **found)


def _law(text: str, beside: Path | None, fail) -> str:
    file, colon, name = text.rpartition(":")
    if not colon or not file.endswith(".py") or not name.isidentifier():
        raise fail("law", f"expected 'path.py:Class', got '{text}'")
    for candidate in (Path(file), (beside or Path()) / file):
        if candidate.is_file():
            return f"{candidate.resolve()}:{name}"
    there = [str(p) for base in {Path(), beside or Path()} for p in sorted(base.glob("*.py"))]
    raise fail(
        "law",
        f"no file '{file}'; expected a Python file, relative to the scenario or the working folder: "
        f"{nearest(file, there)}",
    )


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
    known_keys(data, Gains, "", fail)
    gains = convert(data, Gains, fail)
    if override.speed is not None:
        from biped.scenario.family import Knot, gains_at

        knots = convert(speeds, tuple[Knot, ...], lambda key, what: fail(f"speeds{key}", what))
        gains = replace(gains, **gains_at(knots, override.speed, fail))
    gains = gains.replaced(override)
    missing = [name for name in GAINS if getattr(gains, name) is None]
    if missing:
        raise InputError(f"{label(path)}: {missing[0]}: missing; a gait has {', '.join(GAINS)}")
    return gains


def to_toml(scenario: Scenario) -> str:
    """A scenario, every default written out, as a scenario file."""
    import tomli_w

    return tomli_w.dumps(_without_none(msgspec.to_builtins(scenario)))


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
