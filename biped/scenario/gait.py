"""A gait file: gains, perhaps a family of them, and the settings that they were made for."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from msgspec import to_builtins
from msgspec.structs import replace

from biped.base.errors import InputError
from biped.base.files import description_of, label, layered, locate, read_toml
from biped.base.text import echo
from biped.scenario.actuation import Actuation
from biped.scenario.gains import GAINS, OUT_OF_PLANE, Gains
from biped.scenario.keys import Backstep, Scenario, Sensing
from biped.scenario.origin import Origin
from biped.scenario.section import Section
from biped.scenario.valid import convert, known_keys

SETTINGS: dict[str, type[Section]] = {"sensing": Sensing, "actuation": Actuation, "backstep": Backstep}
"""Tables of a scenario that a gait file may have too."""
OPTIONAL = frozenset(name for name in SETTINGS if getattr(Scenario(), name) is None)
"""Of these there is none by default: that there is one says something, whatever its numbers."""

Settings = dict[str, dict[str, Any]]
"""What a gait was made for: table, key, value."""


def _read(path: Path) -> tuple[dict[str, Any], dict[str, Any], Any, Origin]:
    """Gains, settings and family of a gait file, as written."""
    data, keys = layered(path, "controllers")
    for word in ("description", "source"):
        data.pop(word, None)
    settings = {name: data.pop(name) for name in SETTINGS if name in data}
    return data, settings, data.pop("speeds", ()), Origin(path, keys)


def read_gains(path: Path, override: Gains) -> Gains:
    """Reads a controller file (and what it extends) and lays a scenario's own gains over it.

    Raises:
        InputError: A gain is missing, unknown or of the wrong type.
    """
    data, _, speeds, origin = _read(path)
    known_keys(data, Gains, "", origin.fault)
    gains = convert(data, Gains, origin.fault)
    if override.speed is not None:
        from biped.scenario.family import Knot, gains_at

        knots = convert(speeds, tuple[Knot, ...], lambda key, what: origin.fault(f"speeds{key}", what))
        gains = replace(gains, **gains_at(knots, override.speed, origin.fault))
    gains = gains.replaced(override)
    missing = [name for name in gains.missing() if name not in ("speed", *OUT_OF_PLANE)]
    if missing:
        table = missing[0].partition(".")[0] if "." in missing[0] else ""
        names = getattr(gains, table).__struct_fields__ if table else GAINS
        whole = f"[{table}]" if table else "a gait"
        raise InputError(f"{label(path)}: {missing[0]}: missing; {whole} has {', '.join(names)}")
    return gains


class Gaits(dict[tuple[str, Gains], Gains]):
    """Complete gains by the name of a gait and what a scenario lays over it; files are read once.

    Raises:
        InputError: Where one is asked for: there is no such gait, or a gain is missing, unknown or of the wrong type.
    """

    def __missing__(self, key: tuple[str, Gains]) -> Gains:
        controller, own = key
        self[key] = read_gains(locate("controllers", controller, "controller"), own)
        return self[key]


def speeds_of(path: Path) -> tuple[float, float] | None:
    """Smallest and largest speed [m/s] of a gait file's family, `[[speeds]]`; None if it has none."""
    _, _, speeds, origin = _read(path)
    if not speeds:
        return None
    from biped.scenario.family import Knot

    knots = convert(speeds, tuple[Knot, ...], lambda key, what: origin.fault(f"speeds{key}", what))
    return min(knot.at for knot in knots), max(knot.at for knot in knots)


def in_the_plane(gains: Gains, model: str, at: str = "") -> None:
    """Makes sure that a gait is one of a biped that moves in the plane.

    Args:
        gains: The gait.
        model: Whose.
        at: What its key begins with: `change[0].` of one that a change goes over to.

    Raises:
        InputError: It has tables of one that moves in space.
    """
    for table in OUT_OF_PLANE:
        if getattr(gains, table) is not None:
            raise InputError(f"{at}gains.{table}: expected none: model '{model}' moves in the plane; [{table}] is of "
                             "bipeds that move in space", f"{at}gains.{table}")  # fmt: skip


def out_of_the_plane(gains: Gains, model: str, at: str = "") -> None:
    """Makes sure that a gait is one of a biped that moves in space; arguments as of `in_the_plane`.

    Raises:
        InputError: A table is missing.
    """
    for table in OUT_OF_PLANE:
        if getattr(gains, table) is None:
            raise InputError(f"{at}gains.{table}: missing: model '{model}' moves in space, which asks for "
                             f"{' and '.join(f'[{name}]' for name in OUT_OF_PLANE)} in its gait file "
                             "(controllers/human3d.toml has them)", f"{at}gains.{table}")  # fmt: skip


def read_settings(path: Path) -> tuple[Settings, Origin]:
    """Reads the settings that a gait was made for, and where each was written.

    Raises:
        InputError: A setting is unknown, of the wrong type or impossible.
    """
    _, tables, _, origin = _read(path)
    known_keys(tables, Scenario, "", origin.fault)
    settings = {}
    for name, table in tables.items():
        if not isinstance(table, dict):
            raise origin.fault(name, f"expected a table, got {echo(table)}")
        section = convert(table, SETTINGS[name], lambda key, what, at=name: origin.fault(f"{at}.{key}", what))
        settings[name] = {key: getattr(section, key) for key in table}
    return settings, origin


def habits_of(model: Path) -> tuple[dict[str, Any], Path]:
    """What the description of a robot says of scenarios, as written, and the file that says it."""
    path = description_of(model)
    habits = read_toml(path).get("scenario", {})
    if not isinstance(habits, dict):
        raise InputError(f"{label(path)}: scenario: expected a table, [scenario], got {echo(habits)}")
    return habits, path


def _usual(habits: tuple[dict[str, Any], Path], name: str) -> tuple[dict[str, Any], Section]:
    """What a robot's `habits_of` say of a table of `SETTINGS`: as written, and with the defaults of the rest.

    Raises:
        InputError: A setting is unknown, of the wrong type or impossible.
    """
    said, path = habits
    table, origin = said.get(name, {}), Origin(path)
    return table, convert(table, SETTINGS[name], lambda key, what: origin.fault(f"scenario.{name}.{key}", what))


def settings_on(model: Path, controller: Path) -> Settings:
    """The settings of a robot with a gait: what its description says, and over that what the gait was made for."""
    habits = habits_of(model)
    settings, _ = read_settings(controller)
    for name in SETTINGS:
        if name in OPTIONAL and name not in settings:
            continue
        table, section = _usual(habits, name)
        settings[name] = {key: getattr(section, key) for key in table} | settings.get(name, {})
    return settings


def lay_below(data: dict[str, Any], origin: dict[str, Path], path: Path) -> None:
    """Lays a gait's settings below what a scenario says itself, in place.

    Args:
        data: The scenario as plain data.
        origin: Where each of its keys was written.
        path: The gait file.

    Raises:
        InputError: A setting is unknown, of the wrong type or impossible.
    """
    settings, theirs = read_settings(path)
    if "law" in data:
        settings.pop("backstep", None)  # it belongs to the thesis's leg states
    for name, table in settings.items():
        mine = data.setdefault(name, {})
        if not isinstance(mine, dict):
            continue  # the scenario's own fault, for which it is blamed
        for key, value in table.items():
            if key not in mine:
                mine[key] = value
                origin[f"{name}.{key}"] = theirs.keys[f"{name}.{key}"]
            elif isinstance(mine[key], dict) and isinstance(value, Section):
                mine[key] = to_builtins(value) | mine[key]  # what a table leaves unsaid is the gait's, not a default


def made_for(s: Scenario) -> Settings:
    """The settings of a scenario that a gait found in it was made for: those that are not its robot's own."""
    habits, tables = habits_of(locate("models", s.model, "model")), {}
    for name, kind in SETTINGS.items():
        defaults, mine = _usual(habits, name)[1], getattr(s, name)
        if mine is None:
            continue
        own = {
            key: getattr(mine, key)
            for key in kind.__struct_fields__
            if name in OPTIONAL or getattr(mine, key) != getattr(defaults, key)
        }
        if own:
            tables[name] = own
    return tables


def resettled(s: Scenario, old: Settings, new: Settings, varied: set[str]) -> Scenario:
    """A scenario whose gait was exchanged, with the new gait's settings instead of the old one's.

    What the scenario says itself stays: a setting other than the old gait's (or the default), or one that varies. A
    table that there need not be comes and goes with the gait, unless the scenario says something in it.

    Args:
        s: The scenario, which names the new gait.
        old: Settings of its robot with the gait it was read with.
        new: Settings of its robot with the gait it names.
        varied: Dotted keys that have values of their own.
    """
    tables = {}
    for name, kind in SETTINGS.items():
        mine = getattr(s, name)
        was, will = (kind(**gait[name]) if name in gait else None for gait in (old, new))
        if mine == was and not any(key.startswith(f"{name}.") for key in varied):
            tables[name] = will
        elif mine is not None:
            tables[name] = _exchanged(mine, was or kind(), will or kind(), name, varied)
    return replace(s, **tables)


def _exchanged(mine: Section, was: Section, will: Section, name: str, varied: set[str]) -> Section:
    """A table with what it had of the old gait, also in tables within it, as the new one has it.

    Args:
        mine: The table.
        was: As the old gait has it.
        will: As the new one does.
        name: Its dotted key.
        varied: Dotted keys that have values of their own.
    """
    moved = {}
    for key in mine.__struct_fields__:
        dotted = f"{name}.{key}"
        now, before, after = (getattr(table, key) for table in (mine, was, will))
        if dotted in varied:
            continue
        if isinstance(now, Section) and type(now) is type(before) is type(after):
            moved[key] = _exchanged(now, before, after, dotted, varied)
        elif now == before:
            moved[key] = after
    return replace(mine, **moved)
