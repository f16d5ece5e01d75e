"""Scenarios of robots of any kind: when one is, and what it says if it says nothing else.

A scenario with `[robot]` is one of these; so is one whose model is described with `kind = "general"`, is a URDF, or
lacks the parts of the human while a law of one's own is there to move it, and one whose law is for any robot.
"""

import re
from pathlib import Path
from typing import Any

from biped.base.errors import InputError
from biped.base.files import MOST_BYTES, URDF, folder, is_file, label, locate, merge, read_toml
from biped.base.text import echo
from biped.scenario.keys import Scenario
from biped.scenario.laws import BUILT_IN, is_card
from biped.scenario.noticed import noticed_of
from biped.scenario.options import FILE, options_of
from biped.scenario.section import LARGEST

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
    card = isinstance(law, str) and is_card(law)
    asked = "robot" in data or kind == KIND or builtin or card or model.suffix == URDF
    if not asked and (law is None or own.is_file() or _has_parts(model)):
        return False
    habits = description.pop("scenario", {}) if kind == KIND else {}
    if not isinstance(habits, dict):
        raise InputError(f"{label(own)}: scenario: expected a table, [scenario], got {echo(habits)}")
    habits = noticed_of(habits, data.get("law", habits.get("law")))
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
