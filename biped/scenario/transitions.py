"""The gaits by which a walk stops, and by which its robot stands and sets off: `[transitions]` of a gait file."""

from typing import Any

from msgspec.structs import replace

from biped.base.files import canonical, layered, locate
from biped.base.typed import Name, NonNegative, Section
from biped.scenario.devices import Change
from biped.scenario.valid import Origin, table_of

TRANSITIONS = "stop", "stand", "start"
"""Its keys that name gaits."""


class Transitions(Section, frozen=True):
    """The gaits by which a walk stops, and by which its robot stands and sets off: `[transitions]` of its file.

    Attributes:
        stop: Name or path of the gait that stops it; default: `stand`.
        stand: Name or path of the gait that stands.
        start: Name or path of the gait that shifts the weight of a stander, before the walk takes over.
        stop_after_landing: [s] after a foot has landed that the stop begins; default: at once.
        start_over: [s] over which a stander goes to `start`.
        walk_over: [s] over which the walk takes over from `start`.
    """

    stop: Name | None = None
    stand: Name | None = None
    start: Name | None = None
    stop_after_landing: NonNegative | None = None
    start_over: NonNegative = 0.2
    walk_over: NonNegative = 0.25


def timed(change: Change, before: Change, said: Transitions) -> Change:
    """A change with the times that a walk's `[transitions]` say of it, where it says none itself.

    Args:
        change: To one of the gaits that they name, or back to the walk.
        before: The change before it, if there is one.
        said: They.
    """
    if change.to == "stop" and change.after_landing is None:
        return replace(change, after_landing=said.stop_after_landing)
    if change.over is None and change.to == "start":
        return replace(change, over=said.start_over)
    if change.over is None and change.to == "first" and before.to == "start":
        return replace(change, over=said.walk_over)
    return change


def transitions_of(controller: str) -> Transitions:
    """The `[transitions]` of a gait's file, with names in the folder of gaits, or paths.

    Raises:
        InputError: There is no such gait, or none of a name that it gives.
    """
    path = locate("controllers", controller, "controller")
    data, keys = layered(path, "controllers")
    origin = Origin(path, keys)
    said = take_transitions(data, origin)
    found = {}
    for key in TRANSITIONS:
        if (name := getattr(said, key)) is not None:
            dotted = f"transitions.{key}"
            file = locate("controllers", name, f"{origin.of(dotted)}: {dotted}", keys.get(dotted, path).parent)
            found[key] = canonical("controllers", file)
    if "stand" in found:
        found.setdefault("stop", found["stand"])
    return replace(said, **found)


def take_transitions(data: dict[str, Any], origin: Origin) -> Transitions:
    """Takes [transitions] out of a gait file's data, in place, and checks it.

    Args:
        data: As written.
        origin: Where each key was written.

    Raises:
        InputError: It is no table, or a key is unknown or of the wrong type.
    """
    return table_of(data.pop("transitions", {}), Transitions, "transitions", origin)
