"""Scenarios of robots of any kind: when one is, what it and its model file say besides, and which keys hold, by law.

A scenario with `[robot]` is one of these; so is one whose model is described with `kind = "general"`, is a URDF, or
lacks the parts of the human while a law of one's own is there to move it, and one whose law is for any robot. The law
`thesis` is for any robot, too, but on a planar biped of seven links it is the law of a scenario that names none. A
scenario that says a key which nobody takes notice of is refused, by name.
"""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

from biped.base.errors import InputError, echo, safe
from biped.base.files import MOST_BYTES, URDF, folder, is_file, label, locate, merge, read_toml
from biped.base.typed import LARGEST
from biped.scenario.engines import ENGINES
from biped.scenario.keys import Scenario, Simulation
from biped.scenario.laws import BUILT_IN, THESIS, Keys, is_card, named_now, own_law
from biped.scenario.valid import Fail

FILE = "file"
"""Of `simulation.physics`."""
DEFAULTS: dict[str, Any] = {
    "timestep": 0.002, "integrator": "Euler", "cone": "pyramidal", "impratio": 1.0, "tolerance": 1e-8,
    "iterations": 100, "ls_iterations": 50, "solver": "Newton",
}  # fmt: skip
"""MuJoCo's, where a file says nothing."""
MOST_FILES = 32
"""Of includes within includes; a file that has more is refused where it is examined."""

_COMMENT = re.compile(r"<!--.*?-->", re.DOTALL)
_ELEMENT = re.compile(r"<(option|include|freejoint|joint)\b([^>]*)>")
_ATTRIBUTE = re.compile(r"""\b([a-z_]+)\s*=\s*["']([^"']*)["']""")


def options_of(model: Path) -> dict[str, Any]:
    """Keys of `[simulation]` that an MJCF file answers, MuJoCo's defaults where it is silent.

    A value that is no number is left as it is written: the scenario's check says what is wrong with it.

    Args:
        model: The file.
    """
    out = dict(DEFAULTS)
    for element, attributes in _elements(model, model.parent, [0]):
        for name, value in attributes.items():
            if element == "option" and name in out:
                out[name] = _typed(value, out[name])
    step = out["timestep"]
    rate = {"control_rate": 1.0 / step} if isinstance(step, float) and step > 0.0 else {}
    return out | rate


def differing(model: Path, simulation: Simulation) -> str:
    """One line about what a file asks for and a run does otherwise; empty where they agree.

    Args:
        model: The MJCF file.
        simulation: Of the scenario.
    """
    if simulation.physics == FILE or model.suffix != ".xml":
        return ""
    file = options_of(model)
    names = [name for name in DEFAULTS if file[name] != getattr(simulation, name) and name != "tolerance"]
    if not names:
        return ""
    theirs = ", ".join(_text(name, file[name]) for name in names)
    ours = ", ".join(_text(name, getattr(simulation, name)) for name in names)
    return f"the file asks for {theirs}; a run has {ours}; simulation.physics = 'file' follows the file"


def _text(name: str, value: Any) -> str:
    if name == "timestep":
        return f"{name} {value:g} s"
    return f"{name} {value}" if isinstance(value, str) else f"{name} {value:g}"


def _elements(path: Path, beside: Path, count: list[int]) -> list[tuple[str, dict[str, str]]]:
    """Options and joints of a file and of what it includes, with their attributes, in their order."""
    count[0] += 1
    try:
        with open(path, encoding="utf-8", errors="replace") as file:
            text = _COMMENT.sub("", file.read(4 * MOST_BYTES))
    except OSError:
        return []  # whoever compiles it says why it cannot be read
    out: list[tuple[str, dict[str, str]]] = []
    for element, text_of in _ELEMENT.findall(text):
        attributes = dict(_ATTRIBUTE.findall(text_of))
        if element != "include":
            out.append((element, attributes))
        elif count[0] < MOST_FILES:
            name = attributes.get("file", "")
            found = next((place / name for place in (path.parent, beside) if name and (place / name).is_file()), None)
            out += _elements(found, beside, count) if found else []
    return out


def _typed(value: str, like: Any) -> Any:
    if isinstance(like, str):
        return value
    try:
        return type(like)(float(value))
    except (ValueError, OverflowError):
        return value


KIND = "general"
HABITS: dict[str, Any] = {
    "controller": "",
    "start": {"posture": ""},
    "ground": {"friction": 1.0},
    "actuation": {"torque_limit": LARGEST},
}
"""Keys and their values where nobody says: no gait, the robot's own start and limits."""
FROM_FILE: dict[str, Any] = {"ground": {"friction": None, "contact_time": None, "damping_ratio": None}}
"""Keys that the model file answers, where the physics is the file's."""


def name_law(data: dict[str, Any], origin: dict[str, Path]) -> None:
    """Names a scenario's law as the code knows it, in place: `thesis` on a planar biped of seven links is no law.

    Args:
        data: The scenario as plain data.
        origin: Where each of its keys was written.
    """
    if "law" in data:
        data["law"] = named_now(data["law"])
    if data.get("law") != THESIS or "robot" in data or (model := model_of(data, origin)) is None:
        return
    own = model.with_suffix(".toml")
    description = read_toml(own) if is_file(own) else {}
    if description.get("kind") != KIND and model.suffix != URDF and ("base" in description or _in_plane(model)):
        del data["law"]


def model_of(data: dict[str, Any], origin: dict[str, Path]) -> Path | None:
    """The model file of a scenario; None if it is not there, or no name at all: the scenario's check says so."""
    name = data.get("model", Scenario().model)
    try:
        return locate("models", name, "", origin["model"].parent if "model" in origin else None)
    except (InputError, AttributeError):
        return None


def is_free(model: Path) -> bool:
    """Whether a model file has a joint of six coordinates, as every robot in space has; to a URDF it is added.

    Args:
        model: The file.
    """
    return model.suffix == URDF or any(
        element == "freejoint" or attributes.get("type") == "free"
        for element, attributes in _elements(model, model.parent, [0])
    )


def make_general(data: dict[str, Any], origin: dict[str, Path]) -> bool:
    """Completes a scenario of a robot of any kind, in place; says whether it is one.

    Args:
        data: The scenario as plain data.
        origin: Where each of its keys was written.

    Raises:
        InputError: The description is of no known kind.
    """
    model, law = model_of(data, origin), data.get("law")
    if model is None:
        return False
    own = model.with_suffix(".toml")
    description = read_toml(own) if is_file(own) else {}
    kind = description.pop("kind", None)
    if kind not in (None, KIND):
        raise InputError(f"{label(own)}: kind: expected '{KIND}' or nothing, got {echo(kind)}")
    builtin = isinstance(law, str) and law in BUILT_IN
    card = isinstance(law, str) and is_card(law)
    asked = "robot" in data or kind == KIND or builtin or card or model.suffix == URDF
    if not asked and (law is None or own.is_file() or _has_parts(model)):
        return False
    habits = description.pop("scenario", {}) if kind == KIND else {}
    if not isinstance(habits, dict):
        raise InputError(f"{label(own)}: scenario: expected a table, [scenario], got {echo(habits)}")
    if "law" in habits:
        habits["law"] = named_now(habits["law"])
    habits = noticed_of(habits, data.get("law", habits.get("law")))
    leave_backstep(habits, data)
    data.setdefault("robot", {})
    if kind == KIND and isinstance(data["robot"], dict):
        lay_under(data, {"robot": description}, origin, own)
    lay_under(data, habits, origin, own)
    simulation = data.get("simulation")
    if isinstance(simulation, dict) and simulation.get("physics") == FILE:
        lay_under(data, {"simulation": options_of(model)}, origin, model)
        lay_under(data, FROM_FILE, origin, model)
    lay_under(data, HABITS, origin, own)
    return True


def _has_parts(model: Path) -> bool:
    """Whether a file names all bodies of the human, as every variant of it does."""
    human = _human()
    return _names("body", {human["base"]["link"], *(link for leg in human["leg"] for link in leg["links"])}, model)


def _in_plane(model: Path) -> bool:
    """Whether a file names the joints of the human's base in the plane, as every planar variant of it does."""
    return _names("joint", set(_human()["base"]["joints"]), model)


def _human() -> dict[str, Any]:
    return read_toml(folder("models") / "human.toml")


def _names(element: str, wanted: set[str], model: Path) -> bool:
    """Whether a file has elements of all these names."""
    try:
        with open(model, encoding="utf-8", errors="replace") as file:
            text = file.read(4 * MOST_BYTES)
    except OSError:
        return True  # whoever reads it says why it cannot be read
    return wanted <= set(re.findall(rf"<{element}\b[^>]*?\bname\s*=\s*[\"']([^\"']*)[\"']", text))


def leave_backstep(habits: dict[str, Any], data: dict[str, Any]) -> None:
    """Takes the step back out of a robot's habits, in place, unless its scenario or gait asks for one.

    Args:
        habits: As plain data.
        data: The scenario, with its gait, as plain data.
    """
    if "backstep" not in data:
        habits.pop("backstep", None)


def lay_under(data: dict[str, Any], below: dict[str, Any], origin: dict[str, Path], path: Path, at: str = "") -> None:
    """Lays values under those of a scenario, in place."""
    for key, value in below.items():
        if key not in data:
            merge(data, {key: value}, origin, path, at)
        elif isinstance(value, dict) and isinstance(data[key], dict):
            lay_under(data[key], value, origin, path, f"{at}{key}.")


ALL: Keys = {
    "start": ("posture", "settle", "jitter", "upright"),
    "ground": ("slope", "side_slope", "tiles", "steps", "friction", "contact_time", "damping_ratio"),
    "actuation": ("torque_limit", "lag", "delay", "delay_jitter"),
    "sensing": (),
    "control": (),
    "sensors": ("angle_noise", "rate_noise", "height_noise", "delay", "quantisation", "zero_error", "gyro"),
    "truth": (
        "joint_damping", "part", "strength", "servo_stiffness", "servo_damping", "joint_friction", "joint_losses",
        "armature", "unmodelled",
    ),
    "randomise": ("runs", "masses", "draw", "moves"),
}  # fmt: skip
"""Whatever the law is. Tables that are not named here are read whole."""
CARD: Keys = {"": ("command",)}
"""Keys that a policy's card reads besides."""
OWN: Keys = {"": ("controller", "gains", "command"), "ground": ("angles",)}
"""Keys that a law of one's own is handed besides (`biped.control.law.Setup`)."""
SPLIT = ("Euler", "implicit", "implicitfast")
"""MuJoCo's integrators whose step has two halves, between which a law ticks and contacts change."""
_ASKED = ("controller", "reading", "gains", "change", "backstep", "estimator", "command")
"""Keys of the scenario itself that only some laws read."""


class _Vain(NamedTuple):
    """A key that is said in vain: its table, its name, its default."""

    table: str
    key: str
    default: Any

    @property
    def dotted(self) -> str:
        return f"{self.table}.{self.key}".lstrip(".")


def read_by(law: str | None) -> dict[str, tuple[str, ...]]:
    """Keys that are read under a law, by table; "" is the scenario itself."""
    besides = BUILT_IN[law].reads if law in BUILT_IN else CARD if is_card(law) else OWN
    return {table: (*ALL.get(table, ()), *besides.get(table, ())) for table in ("", *ALL)}


def noticed_of(habits: dict[str, Any], law: Any) -> dict[str, Any]:
    """Returns the habits in a model's description, without keys that the law takes no notice of.

    Args:
        habits: As plain data.
        law: The scenario's, as it was written.
    """
    read = read_by(law if isinstance(law, str) else None)
    out = {key: value for key, value in habits.items() if key not in _ASKED or key in read[""]}
    for table in ALL:
        if isinstance(out.get(table), dict):
            out[table] = {key: value for key, value in out[table].items() if key in read[table]}
    return out


def taken(s: Scenario, fail: Fail) -> None:
    """Rejects what a scenario of a robot of any kind says in vain, by name: its law would take no notice of it."""
    if not ENGINES[s.engine].any_robot:
        others = " or ".join(f"'{name}'" for name, engine in ENGINES.items() if engine.any_robot)
        raise fail("engine", f"expected {others}: '{s.engine}' has seven links; got '{s.engine}'")
    if s.truth.unmodelled.patchy and s.simulation.integrator not in SPLIT:
        raise fail("simulation.integrator", f"expected one of {', '.join(SPLIT)}: within a step of "
                   f"'{s.simulation.integrator}' no contact can be changed, as truth.unmodelled asks for")  # fmt: skip
    for name, condition in (s.tune.conditions if s.tune else {}).items():
        if condition.growth is not None:
            raise fail(f"tune.conditions.{name}.growth", "expected none: neighbours are those of a planar biped of "
                       "seven links that walks")  # fmt: skip
    if s.gains.speed is not None and not s.controller:
        raise fail("gains.speed", "expected none: no controller is named, and it is the speed of one that is a family")
    read = read_by(s.law)
    if vain := list(_in_vain(s, read)):
        first, *others = vain
        who = f"law '{s.law}'" if s.law in BUILT_IN else "a policy's card" if is_card(s.law) else "a law of one's own"
        nor = f", nor of {safe(', '.join(one.dotted for one in others))}" if others else ""
        reads = (
            f"; of [{first.table}] it reads {', '.join(read[first.table]) or 'nothing'}" if first.table in ALL else ""
        )
        hint = "; 'biped standard LAW --test SCENARIO' leaves out what is another law's" if own_law(s.law) else ""
        raise fail(first.dotted, f"expected {_written(first.default)}: {who} takes no notice of it on a robot of any "
                   f"kind{nor}{reads}{hint}")  # fmt: skip
    if s.law == THESIS and s.actuation.mode == "joint" and s.actuation.contacts != "pushing":
        raise fail("actuation.contacts", f"expected 'pushing', got '{s.actuation.contacts}': on a robot of any kind, "
                   "joint torques are those for ground that only pushes")  # fmt: skip


def _in_vain(s: Scenario, read: Keys) -> Iterator[_Vain]:
    plain = Scenario()
    for key in _ASKED:
        if key not in read[""] and getattr(s, key) not in (getattr(plain, key), ""):
            yield _Vain("", key, None)
    for table in ALL:
        mine, default = getattr(s, table), getattr(plain, table)
        for key in mine.__struct_fields__:
            if key not in read[table] and getattr(mine, key) != getattr(default, key):
                yield _Vain(table, key, getattr(default, key))
    for i, change in enumerate(s.change):
        for key in change.actuation.__struct_fields__:
            if getattr(change.actuation, key) is not None:
                yield _Vain(f"change[{i}].actuation", key, None)


def _written(default: Any) -> str:
    """A default as its author would write it; of tables and lists, none."""
    if isinstance(default, bool):
        return str(default).lower()
    return echo(default) if isinstance(default, float | str) else "none"
