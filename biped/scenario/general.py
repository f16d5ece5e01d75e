"""Scenarios of robots of any kind: when one is, what it says if it says nothing else, what is not for it.

A scenario with `[robot]` is one of these; so is one whose model is described with `kind = "general"`, is a URDF, or
lacks the parts of the human while a law of one's own is there to move it, and one whose law is for any robot.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from biped.base.errors import InputError
from biped.base.files import MOST_BYTES, URDF, folder, is_file, label, locate, merge, read_toml
from biped.base.text import echo, said
from biped.scenario.actuation import Actuation
from biped.scenario.keys import Scenario, Start
from biped.scenario.laws import BUILT_IN
from biped.scenario.randomise import Randomise
from biped.scenario.section import LARGEST
from biped.scenario.senses import Sensors
from biped.scenario.truth import Truth
from biped.scenario.valid import Fail

KIND = "general"
HABITS: dict[str, Any] = {
    "controller": "",
    "start": {"posture": ""},
    "ground": {"friction": 1.0},
    "actuation": {"torque_limit": LARGEST},
}
"""Keys and their values where nobody says: no gait, the robot's own start and limits."""
_THESIS = ("sensing", "backstep", "change", "estimator")
"""Sections of the thesis's law, or of the seven links."""
_ACTUATION = tuple(key for key in Actuation.__struct_fields__ if key not in ("torque_limit", "lag"))
_SENSORS = ("encoders", "switches")
_TRUTH = ("mass", "inertia", "length", "hip_mass")
_START = ("q", "v", "contacts")
_RANDOM = ("controller_mass_matrix", "controller_constraints")


def make_general(data: dict[str, Any], origin: dict[str, Path]) -> bool:
    """Completes a scenario of a robot of any kind, in place; says whether it is one.

    Args:
        data: The scenario as plain data.
        origin: Where each of its keys was written.

    Raises:
        InputError: The description is of no known kind.
    """
    name, law = data.get("model", Scenario().model), data.get("law")
    if not isinstance(name, str):
        return False  # the conversion says so
    try:
        model = locate("models", name, "", origin["model"].parent if "model" in origin else None)
    except InputError:
        return False  # it is refused where the scenario is checked
    own = model.with_suffix(".toml")
    description = read_toml(own) if is_file(own) else {}
    kind = description.pop("kind", None)
    if kind not in (None, KIND):
        raise InputError(f"{label(own)}: kind: expected '{KIND}' or nothing, got {echo(kind)}")
    builtin = isinstance(law, str) and law in BUILT_IN
    asked = "robot" in data or kind == KIND or builtin or model.suffix == URDF
    if not asked and (law is None or own.is_file() or _has_parts(model)):
        return False
    habits = description.pop("scenario", {}) if kind == KIND else {}
    if not isinstance(habits, dict):
        raise InputError(f"{label(own)}: scenario: expected a table, [scenario], got {echo(habits)}")
    law = data.get("law", habits.get("law"))
    if not (isinstance(law, str) and law in BUILT_IN and BUILT_IN[law].thesis):
        habits = _for_any_law(habits)
    data.setdefault("robot", {})
    if kind == KIND and isinstance(data["robot"], dict):
        lay_under(data, {"robot": description}, origin, own)
    lay_under(data, habits, origin, own)
    lay_under(data, HABITS, origin, own)
    return True


def _for_any_law(habits: dict[str, Any]) -> dict[str, Any]:
    """What a model's description says of scenarios, without what only the thesis's law takes."""
    out = {key: value for key, value in habits.items() if key not in _THESIS}
    if isinstance(out.get("actuation"), dict):
        out["actuation"] = {key: value for key, value in out["actuation"].items() if key not in _ACTUATION}
    return out


def _has_parts(model: Path) -> bool:
    """Whether a file names all bodies of the human, as every variant of it does."""
    human = read_toml(folder("models") / "human.toml")
    wanted = {human["base"]["link"], *(link for leg in human["leg"] for link in leg["links"])}
    try:
        with open(model, encoding="utf-8", errors="replace") as file:
            text = file.read(4 * MOST_BYTES)
    except OSError:
        return True  # whoever reads it says why it cannot be read
    return wanted <= set(re.findall(r"<body\b[^>]*?\bname\s*=\s*[\"']([^\"']*)[\"']", text))


def lay_under(data: dict[str, Any], below: dict[str, Any], origin: dict[str, Path], path: Path, at: str = "") -> None:
    """Lays values under those of a scenario, in place."""
    for key, value in below.items():
        if key not in data:
            merge(data, {key: value}, origin, path, at)
        elif isinstance(value, dict) and isinstance(data[key], dict):
            lay_under(data[key], value, origin, path, f"{at}{key}.")


def possible_general(s: Scenario, fail: Fail) -> None:
    """Rejects keys that belong to the thesis's law or to seven links, by name."""
    if s.engine != "mujoco":
        raise fail("engine", f"expected 'mujoco': '{s.engine}' has seven links; got '{s.engine}'")
    refused = {"sensors": (_SENSORS, Sensors()), "truth": (_TRUTH, Truth())}
    if s.law not in BUILT_IN or not BUILT_IN[s.law].thesis:
        refused |= {"": (_THESIS, Scenario()), "actuation": (_ACTUATION, Actuation()), "start": (_START, Start()),
                    "randomise": (_RANDOM, Randomise())}  # fmt: skip
    found = []
    for section, (keys, plain) in refused.items():
        said_so = getattr(s, section) if section else s
        found += [f"{section}.{key}".lstrip(".") for key in keys if getattr(said_so, key) != getattr(plain, key)]
    if found:
        raise fail(found[0], "belongs to the thesis's law and its seven links; a general robot "
                   f"takes none of: {said(', '.join(found))}")  # fmt: skip
