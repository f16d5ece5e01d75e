"""A gait file: its gains; and the settings that come with a gait, a reading or a robot.

Settings lie below the scenario's own keys in this order. A gait that comes with settings was made for them: of a
reading it takes only the tables that no gait file has.
"""

from pathlib import Path
from typing import Any

from msgspec import to_builtins
from msgspec.structs import replace

from biped.base.errors import InputError, echo
from biped.base.files import description_of, label, layered, locate, read_toml
from biped.base.typed import Name, Section
from biped.scenario.devices import Actuation
from biped.scenario.family import Knot, gains_at
from biped.scenario.gains import GAINS, NOT_NEEDED, OUT_OF_PLANE, Gains
from biped.scenario.general import HABITS
from biped.scenario.keys import Backstep, Scenario, Sensing, Simulation, Start
from biped.scenario.toward import Toward, between
from biped.scenario.transitions import take_transitions
from biped.scenario.valid import Fail, Origin, convert, known_keys, table_of
from biped.scenario.world import Ground


class GaitStart(Section, frozen=True):
    """How a walk begins by itself: `[start]` of a gait file, which counts where a scenario does not say.

    Attributes:
        posture: That the gait walks from, as in a scenario.
    """

    posture: Name = "flat"


Kinds = dict[str, type[Section]]
GAIT: Kinds = {"sensing": Sensing, "actuation": Actuation, "backstep": Backstep, "start": GaitStart}
"""Tables of a scenario that a gait file may have too."""
READING: Kinds = {
    "sensing": Sensing,
    "actuation": Actuation,
    "start": Start,
    "ground": Ground,
    "simulation": Simulation,
}
"""Tables of a scenario that a reading of the thesis may have too."""
ALL: Kinds = GAIT | READING
OPTIONAL = frozenset(name for name in ALL if getattr(Scenario(), name) is None)
"""Of these there is none by default: that there is one says something, whatever its numbers."""

Settings = dict[str, dict[str, Any]]
"""Table, key, value."""


def is_setting(key: str) -> bool:
    """Whether a dotted key of a scenario is one that a gait file may have too."""
    table, _, rest = key.partition(".")
    return table in GAIT and rest.partition(".")[0] in GAIT[table].__struct_fields__


def typed(tables: dict[str, Any], kinds: Kinds, origin: Origin) -> Settings:
    """The settings in a file's tables, checked.

    Args:
        tables: As written.
        kinds: Tables that the file may have.
        origin: Where each key was written.

    Raises:
        InputError: A setting is unknown, of the wrong type or impossible.
    """
    known_keys(tables, Scenario, "", origin.fault)
    settings = {}
    for name, table in tables.items():
        section = table_of(table, kinds[name], name, origin)
        settings[name] = {key: getattr(section, key) for key in table}
    return settings


def read_reading(path: Path) -> tuple[Settings, Origin]:
    """Reads a reading of the thesis, readings/*.toml, and where each of its settings was written.

    Raises:
        InputError: A setting is unknown, of the wrong type or impossible.
    """
    data, keys = layered(path, "readings")
    data.pop("description", None)
    origin = Origin(path, keys)
    if others := [name for name in data if name not in READING]:
        raise origin.fault(others[0], f"expected one of {', '.join(READING)}")
    return typed(data, READING, origin), origin


def lay_below(data: dict[str, Any], keys: dict[str, Path], settings: Settings, origin: Origin) -> None:
    """Lays settings below what a scenario says itself, in place.

    Args:
        data: The scenario as plain data.
        keys: Where each of its keys was written.
        settings: What is laid below it.
        origin: Where that was written.
    """
    for name, table in settings.items():
        mine = data.setdefault(name, {})
        if not isinstance(mine, dict):
            continue  # the scenario's own fault, for which it is blamed
        for key, value in table.items():
            if key not in mine:
                mine[key] = value
                keys[f"{name}.{key}"] = origin.keys[f"{name}.{key}"]
            elif isinstance(mine[key], dict) and isinstance(value, Section):
                mine[key] = to_builtins(value) | mine[key]  # what a table leaves unsaid is the gait's, not a default


def beside_gait(reading: Settings, gait: Settings) -> Settings:
    """The part of a reading that holds for a gait which comes with these settings; where it begins says nothing."""
    made_for = GAIT.keys() - {"start"} if gait.keys() - {"start"} else frozenset[str]()
    return {name: table for name, table in reading.items() if name not in made_for}


def habits_of(model: Path) -> tuple[dict[str, Any], Path]:
    """Settings for scenarios in the description of a robot, as written, and the file that has them."""
    path = description_of(model)
    habits = read_toml(path).get("scenario", {})
    if not isinstance(habits, dict):
        raise InputError(f"{label(path)}: scenario: expected a table, [scenario], got {echo(habits)}")
    return habits, path


def _usual(habits: tuple[dict[str, Any], Path], name: str) -> tuple[dict[str, Any], Section]:
    """A table of `ALL` by a robot's `habits_of`: as written, and with the defaults of the rest.

    Raises:
        InputError: A setting is unknown, of the wrong type or impossible.
    """
    said, path = habits
    table, origin = said.get(name, {}), Origin(path)
    return table, convert(table, ALL[name], lambda key, what: origin.fault(f"scenario.{name}.{key}", what))


def settings_on(model: Path, gait: Settings, reading: Settings) -> Settings:
    """The settings of a robot with a gait under a reading: the gait's over the reading's over its description's."""
    habits = habits_of(model)
    settings = dict(gait)
    reading = beside_gait(reading, gait)
    for name in ALL:
        if name in OPTIONAL and name not in settings:
            continue
        table, section = _usual(habits, name)
        usual = {key: getattr(section, key) for key in table}
        settings[name] = usual | reading.get(name, {}) | settings.get(name, {})
    return settings


def gait_settings(s: Scenario) -> Settings:
    """The settings of a scenario that a gait found in it was made for: those that are not its robot's own."""
    habits, tables = habits_of(locate("models", s.model, "model")), {}
    for name, kind in GAIT.items():
        defaults, mine = _usual(habits, name)[1], getattr(s, name)
        if mine is None:
            continue
        if name == "start":  # none of it is a robot's own, and "flat" says something where the default is a stand
            if mine.posture and mine.q is None and "start.posture" not in s.randomise.draw:
                tables[name] = {"posture": mine.posture}
            continue
        unsaid = HABITS.get(name, {})  # of any robot: its own limits
        own = {
            key: getattr(mine, key)
            for key in kind.__struct_fields__
            if name in OPTIONAL or getattr(mine, key) not in (getattr(defaults, key), unsaid.get(key))
        }
        if own:
            tables[name] = own
    return tables


def resettled(s: Scenario, old: Settings, new: Settings, varied: set[str]) -> Scenario:
    """A scenario whose gait or reading was exchanged, with the new one's settings instead of the old one's.

    What the scenario says itself stays: a setting other than the old one's (or the default), or one that varies. A
    table that there need not be comes and goes with the gait, unless the scenario says something in it.

    Args:
        s: The scenario, which names the new gait and reading.
        old: `settings_on` its robot with those it was read with.
        new: The same with those it names.
        varied: Dotted keys that have values of their own.
    """
    tables = {}
    for name, kind in ALL.items():
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


def _read(path: Path, way: tuple[Path, ...] = ()) -> tuple[dict[str, Any], Settings, Any, Origin]:
    """Gains, settings and family of a gait file, as written; `way` has the files that move toward it."""
    data, keys = layered(path, "controllers")
    origin = Origin(path, keys)
    for word in ("description", "source"):
        data.pop(word, None)
    settings = {name: data.pop(name) for name in GAIT if name in data}
    take_transitions(data, origin)
    toward, speeds = data.pop("toward", None), data.pop("speeds", ())
    if toward is None:
        return data, settings, speeds, origin

    to, at = table_of(toward, Toward, "toward", origin), "toward.gait"
    other, way = locate("controllers", to.gait, f"{origin.of(at)}: {at}", keys[at].parent), (*way, path.resolve())
    if other.resolve() in way:
        raise origin.fault(at, f"two gaits move toward each other: {label(path)}, {label(other)}")
    theirs, their_settings, their_speeds, their_origin = _read(other, way)
    if speeds or their_speeds:
        raise origin.fault(at, "expected no [[speeds]], neither in this file nor in that gait's")
    if data.get("unit") != theirs.get("unit"):
        raise origin.fault(at, "expected a gait in the same unit")
    known_keys(theirs, Gains, "", their_origin.fault)
    convert(theirs, Gains, their_origin.fault)
    typed(their_settings, GAIT, their_origin)
    their_settings.pop("start", None)  # where a walk begins is no number
    keys |= {f"toward.{key}": file for key, file in their_origin.keys.items()}
    data = between(data, theirs, to.share, "", origin.fault)
    settings = between(settings, their_settings, to.share, "", origin.fault)
    return data, settings, speeds, origin


def read_gains(path: Path, override: Gains) -> Gains:
    """Reads a controller file (and what it extends) and lays a scenario's own gains over it.

    Raises:
        InputError: A gain is missing, unknown or of the wrong type.
    """
    data, _, speeds, origin = _read(path)
    known_keys(data, Gains, "", origin.fault)
    gains = convert(data, Gains, origin.fault)
    if override.speed is not None:
        knots = convert(speeds, tuple[Knot, ...], lambda key, what: origin.fault(f"speeds{key}", what))
        gains = replace(gains, **gains_at(knots, override.speed, origin.fault))
    gains = gains.replaced(override)
    missing = [name for name in gains.missing() if name not in ("speed", *NOT_NEEDED, *OUT_OF_PLANE)]
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

    knots = convert(speeds, tuple[Knot, ...], lambda key, what: origin.fault(f"speeds{key}", what))
    return min(knot.at for knot in knots), max(knot.at for knot in knots)


def in_the_plane(gains: Gains, model: str, at: str = "") -> None:
    """Makes sure that a gait is one of a biped that moves in the plane.

    Args:
        gains: The gait.
        model: Whose.
        at: What its key begins with: `change[0].` of one that a change goes over to.

    Raises:
        InputError: It has tables of one that moves in space, its unit, or slopes to the side.
    """
    for table in OUT_OF_PLANE:
        if getattr(gains, table) is not None:
            raise InputError(f"{at}gains.{table}: expected none: model '{model}' moves in the plane; [{table}] is of "
                             "bipeds that move in space", f"{at}gains.{table}")  # fmt: skip
    if gains.unit is not None:
        raise InputError(f"{at}gains.unit: expected none: model '{model}' moves in the plane", f"{at}gains.unit")
    if gains.pace is not None and gains.pace.side:
        raise InputError(f"{at}gains.pace.side: expected 0: model '{model}' moves in the plane, where nothing rises to "
                         "the side", f"{at}gains.pace.side")  # fmt: skip


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


def whole_pace(gains: Gains, at: str) -> None:
    """Makes sure that a gait has all of a pace or nothing, where a change may have named a part.

    Args:
        gains: The gait.
        at: What its key begins with: `change[0].`.

    Raises:
        InputError: A part is missing.
    """
    if gains.pace is not None and (missing := gains.pace.missing()):
        words = f"{', '.join(missing)} missing; [pace] has {', '.join(gains.pace.__struct_fields__)}"
        raise InputError(f"{at}gains.pace: {words}", f"{at}gains.pace")


def read_settings(path: Path) -> tuple[Settings, Origin]:
    """Reads the settings that a gait was made for, and where each was written.

    Raises:
        InputError: A setting is unknown, of the wrong type or impossible.
    """
    _, tables, _, origin = _read(path)
    return typed(tables, GAIT, origin), origin


_IN_UNITS = {"margin": "l", "k_d2": "m g l", "b_d2": "m g l √(l/g)"}
"""Numbers of a step back whose defaults are the human's, in SI."""


def whole_backstep(given: dict[str, Any], fail: Fail) -> None:
    """Rejects a step back that leaves numbers out, beside a gait that counts in units of its walker.

    Args:
        given: What the scenario and its gait say of it.
        fail: Makes the error.

    Raises:
        InputError: It does.
    """
    for name, unit in _IN_UNITS.items():
        if name not in given:
            raise fail(f"backstep.{name}", f"expected a number in {unit}, as its gait counts; its default is in SI")
