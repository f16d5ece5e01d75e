"""Physics that an MJCF file asks for: the attributes of its `<option>`, read as text before anything is compiled."""

import re
from pathlib import Path
from typing import Any

from biped.base.files import MOST_BYTES
from biped.scenario.keys import Simulation

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
_ELEMENT = re.compile(r"<(option|include)\b([^>]*)>")
_ATTRIBUTE = re.compile(r"""\b([a-z_]+)\s*=\s*["']([^"']*)["']""")


def options_of(model: Path) -> dict[str, Any]:
    """Keys of `[simulation]` that an MJCF file answers, MuJoCo's defaults where it is silent.

    A value that is no number is left as it is written: the scenario's check says what is wrong with it.

    Args:
        model: The file.
    """
    out = dict(DEFAULTS)
    for name, value in _attributes(model, model.parent, [0]):
        if name in out:
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


def _attributes(path: Path, beside: Path, count: list[int]) -> list[tuple[str, str]]:
    """Attributes of all options of a file and of what it includes, in their order."""
    count[0] += 1
    try:
        with open(path, encoding="utf-8", errors="replace") as file:
            text = _COMMENT.sub("", file.read(4 * MOST_BYTES))
    except OSError:
        return []  # whoever compiles it says why it cannot be read
    out = []
    for element, attributes in _ELEMENT.findall(text):
        pairs = _ATTRIBUTE.findall(attributes)
        if element == "option":
            out += pairs
        elif count[0] < MOST_FILES:
            name = dict(pairs).get("file", "")
            found = next((place / name for place in (path.parent, beside) if name and (place / name).is_file()), None)
            out += _attributes(found, beside, count) if found else []
    return out


def _typed(value: str, like: Any) -> Any:
    if isinstance(like, str):
        return value
    try:
        return type(like)(float(value))
    except (ValueError, OverflowError):
        return value
