"""From a scenario file and the command line's changes to a checked `Scenario`; every complaint names file and key."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import msgspec
from msgspec.structs import replace

from biped.base import typed
from biped.base.errors import InputError, safe
from biped.base.files import canonical, layered, locate, merge, parse_toml
from biped.scenario.gait import (
    Settings,
    beside_gait,
    habits_of,
    lay_below,
    out_of_the_plane,
    read_gains,
    read_reading,
    read_settings,
    whole_backstep,
)
from biped.scenario.general import is_free, lay_under, leave_backstep, make_general, model_of, name_law, taken
from biped.scenario.keys import Scenario
from biped.scenario.laws import THESIS, changed_since, check_form, digest, find_law, is_card, own_law
from biped.scenario.overrides import lay_changes
from biped.scenario.possible import possible, suits_seven_links
from biped.scenario.valid import COMMAND_LINE, Fail, Origin, convert, known_keys

ABOUT = ("model", "controller", "law", "gains", "change", "backstep", "push", "truth", "ground.slope")
"""Keys that say which gait of which biped walks where."""


def about(data: Mapping[str, Any], origin: Mapping[str, Path]) -> dict[str, float]:
    """The numbers of [thesis] that are about a scenario: nothing of `ABOUT` differs from the file that gives them.

    Args:
        data: The scenario, its layers merged, as plain data that is a valid scenario.
        origin: File of each dotted key; numbers given with --set are about whatever they are given for.
    """
    files = {origin[f"thesis.{name}"] for name in data.get("thesis", {})}
    mine = _about(data)
    apart = {file for file in files if file.is_file() and _about(_layered(file)) != mine}
    return {name: value for name, value in data.get("thesis", {}).items() if origin[f"thesis.{name}"] not in apart}


def _layered(file: Path) -> dict[str, Any]:
    data, origin = layered(file, "scenarios")
    name_law(data, origin)
    return data


def _about(data: Mapping[str, Any]) -> list[Any]:
    """Settings of a scenario that the thesis is about (`ABOUT`), and which of them vary."""
    s = typed.convert(data, Scenario)
    varied = {**s.sweep, **s.randomise.draw}
    told = [getattr(s, key) for key in ABOUT if "." not in key]
    return [*told, s.ground.slope, {key: varied[key] for key in varied if f"{key}.".startswith(_PREFIXES)}]


_PREFIXES = tuple(f"{key}." for key in ABOUT)


class Read(NamedTuple):
    """A scenario as read.

    Attributes:
        scenario: Checked.
        origin: Where each of its keys was written.
    """

    scenario: Scenario
    origin: Origin


def read(name: str, changes: Sequence[str] = (), looking: bool = False) -> Read:
    """Reads, layers, overrides and checks a scenario; the thesis's numbers of another gait or place are left out.

    Args:
        name: A scenario's name or path.
        changes: `key.path=VALUE` strings, VALUE being TOML or a bare word. A law among them is one that the user named:
            it is trusted.
        looking: It is of results that are looked at and not run: its law need be neither there nor trusted.

    Raises:
        InputError: Anything in it is unknown, of the wrong type, impossible or missing.
    """
    path = locate("scenarios", name, "")
    data, origin = layered(path, "scenarios")
    lay_changes(data, origin, changes)
    scenario, whence = _checked(data, origin, path, looking)
    return Read(replace(scenario, thesis=about(data, origin)) if scenario.thesis else scenario, whence)


def read_scenario(name: str, changes: Sequence[str] = (), looking: bool = False) -> Scenario:
    """The same as `read`, without the places where keys were written."""
    return read(name, changes, looking).scenario


class _Kind(NamedTuple):
    """How scenarios of a kind of robot are read.

    Attributes:
        files: Keys that name a file which it cannot do without.
        lay: Lays under a scenario, beside the settings of its gait, what else says something of it.
        check: Rejects what such a scenario has no use for.
    """

    files: tuple[str, ...]
    lay: Callable[[dict[str, Any], dict[str, Path], Settings, Callable[[str], Path]], None]
    check: Callable[[Scenario, Fail], None]


def _lay_habits(data: dict[str, Any], origin: dict[str, Path], settings: Settings, find: Callable[[str], Path]) -> None:
    """Lays what the reading, then what the robot's description says of scenarios under what this one and its gait say.

    The step back is none of a robot's habits: its numbers are the robot's, but a scenario asks for it.
    """
    if isinstance(data.get("reading"), str):
        below, theirs = read_reading(find("reading"))
        lay_below(data, origin, beside_gait(below, settings), theirs)
    if (model := model_of(data, origin)) is None:
        return
    habits, path = habits_of(model)
    leave_backstep(habits, data)
    lay_under(data, habits, origin, path)
    name_law(data, origin)


_SEVEN_LINKS = _Kind(("model", "controller"), _lay_habits, suits_seven_links)
_ANY = _Kind(("model",), lambda *_: None, taken)  # its habits were laid when it was told


def _checked(data: dict[str, Any], keys: dict[str, Path], path: Path, looking: bool = False) -> Read:
    origin = Origin(path, keys)
    fail = origin.fault
    known_keys(data, Scenario, "", fail)
    name_law(data, keys)
    law = data.get("law")
    if isinstance(law, str) and not looking:
        check_form(law, fail)
        if is_card(law):
            from biped.scenario.card import lay_card

            lay_card(data, keys, path, fail)
    # A controller or model named in a file is looked for beside that file too.
    beside = {key: keys[key].parent for key in ("model", "controller", "reading") if key in keys}

    def found(kind: str, name: str, key: str, folder: Path | None) -> Path:
        return locate(kind, name, f"{origin.of(key)}: {key}", folder)

    def lay_gait(gait: Any) -> Settings:
        if not isinstance(gait, str):
            return {}  # the conversion says so
        settings, theirs = read_settings(found("controllers", gait, "controller", beside.get("controller")))
        if "law" in data and data["law"] != THESIS:
            settings.pop("backstep", None)  # it belongs to the thesis's leg states
        lay_below(data, keys, settings, theirs)
        return settings

    settings: Settings = {}
    named_here = bool(data.get("controller"))
    if named_here:
        settings = lay_gait(data["controller"])  # above what is said of its robot
    kind = _ANY if make_general(data, keys) else _SEVEN_LINKS
    gait = data.get("controller", Scenario().controller)
    if not named_here and (gait or "controller" in kind.files):
        settings = lay_gait(gait)
    kind.lay(data, keys, settings, lambda key: found(f"{key}s", data[key], key, beside.get(key)))
    known_keys(data, Scenario, "", fail)
    scenario = convert(data, Scenario, fail)
    possible(scenario, fail)
    if scenario.law == THESIS and scenario.controller and kind is _ANY:
        # Before its settings, which would be to blame for a gait that is of the plane.
        gait = found("controllers", scenario.controller, "controller", beside.get("controller"))
        free = (model := model_of(data, keys)) is not None and is_free(model)
        if free or scenario.backstep is not None:
            gains = read_gains(gait, scenario.gains)
            if free:
                out_of_the_plane(gains, scenario.model)
            if scenario.backstep is not None and gains.unit is not None:
                whole_backstep(data["backstep"], fail)
    kind.check(scenario, fail)
    named: dict[str, Any] = {
        key: canonical(f"{key}s", found(f"{key}s", getattr(scenario, key), key, beside.get(key)))
        for key in ("model", "controller", "reading")
        if getattr(scenario, key) or key in kind.files
    }
    if scenario.change:
        folder = keys["change"].parent if "change" in keys else None
        gaits = [change.controller for change in scenario.change]
        named["change"] = tuple(
            change if gait is None
            else replace(change, controller=canonical(
                "controllers", found("controllers", gait, f"change[{i}].controller", folder)))
            for i, (change, gait) in enumerate(zip(scenario.change, gaits, strict=True))
        )  # fmt: skip
    if own_law(scenario.law) and not looking:
        named |= _law(scenario, keys, path, fail)
    return Read(replace(scenario, **named), origin)


def _law(scenario: Scenario, keys: dict[str, Path], path: Path, fail: Fail) -> dict[str, str]:
    """The scenario's law with the whole path of its file, and its digest."""
    said_by = keys.get("law")
    law = find_law(scenario.law or "", None if said_by == COMMAND_LINE else (said_by or path).parent, fail)
    # A digest is of the law that was written beside it.
    if keys.get("law_sha256") == said_by and (changed := changed_since(law, scenario.law_sha256)):
        raise fail("law", changed)
    return {"law": law, "law_sha256": digest(law)}


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


def from_text(text: str, where: Path) -> Scenario:
    """The scenario that `to_toml` wrote out.

    Args:
        text: It.
        where: What the text is called in errors.

    Raises:
        InputError: It is no scenario, or names what is not there.
    """
    try:
        return _checked(parse_toml(text), {}, where).scenario
    except ValueError as error:
        raise InputError(f"{where}: not a TOML file: {safe(error)}") from None


def changed(scenario: Scenario, part: dict[str, Any], where: Path) -> Scenario:
    """The scenario with part of another laid over it, checked like a file called `where`.

    Raises:
        InputError: Anything in the part is unknown, of the wrong type or impossible.
    """
    data = _without_none(msgspec.to_builtins(scenario))
    keys: dict[str, Path] = {}
    merge(data, _without_none(part), keys, where)
    return _checked(data, keys, where).scenario
