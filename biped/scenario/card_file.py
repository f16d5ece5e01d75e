"""Policy cards from their files, checked: what cannot be is refused by file and key."""

from pathlib import Path
from typing import Any

from biped.base.errors import InputError
from biped.base.files import is_file, label, nearest, read_toml
from biped.base.text import echo, safe
from biped.scenario.card import TERMS, VECTORS, Card, Numbers
from biped.scenario.command import WAYS
from biped.scenario.general import lay_under
from biped.scenario.keys import Scenario
from biped.scenario.laws import find_law
from biped.scenario.origin import COMMAND_LINE
from biped.scenario.valid import Fail, convert, known_keys

OWN_WORLD: dict[str, Any] = {"simulation": {"physics": "file"}}
"""Keys of a scenario of a policy that neither it nor the card says: the physics is that which the policy knows."""


def read_card(path: Path) -> Card:
    """Reads and checks a policy's card.

    Args:
        path: The TOML file.

    Raises:
        InputError: Anything in it is unknown, missing, of the wrong type or impossible.
    """

    def fail(key: str, what: str) -> InputError:
        return InputError(f"{label(path)}: {key}: {what}", key)

    data = read_toml(path)
    known_keys(data, Card, "", fail)
    if isinstance(table := data.get("scenario"), dict):
        known_keys(table, Scenario, "scenario.", fail)
    card: Card = convert(data, Card, fail)
    _possible(card, fail)
    network = path.parent / card.network
    if not is_file(network):
        there = [str(p.relative_to(path.parent)) for p in sorted(path.parent.glob("*.onnx"))]
        raise fail("network", f"no file '{safe(card.network)}' beside the card; {nearest(card.network, there)}")
    return card


def _possible(card: Card, fail: Fail) -> None:
    count = len(card.joints)
    if not count:
        raise fail("joints", "expected the names of joints or actuators in the network's order, got none")
    twice = next((name for name in card.joints if card.joints.count(name) > 1), None)
    if twice is not None:
        raise fail("joints", f"expected each once, got '{safe(twice)}' twice")
    action = card.action
    for key, value in (("default", card.default), *((f"action.{name}", getattr(action, name)) for name in (
            "scale", "offset", "stiffness", "damping", "effort"))):  # fmt: skip
        _sized(key, value, count, "joints", fail)
    for key in ("stiffness", "damping", "effort"):
        value = getattr(action, key)
        if any(one < 0.0 for one in (value if isinstance(value, tuple) else (value or 0.0,))):
            raise fail(f"action.{key}", f"expected no negative number, got {echo(value)}")
    if any(one == 0.0 for one in (action.effort if isinstance(action.effort, tuple) else (action.effort,))):
        raise fail("action.effort", "expected more than 0 N m, or none: then the joint's own limit")
    if (action.stiffness is None) != (action.damping is None):
        given, missing = ("damping", "stiffness") if action.stiffness is None else ("stiffness", "damping")
        raise fail(f"action.{missing}", f"expected one beside action.{given}, or neither: then the model's servos act")
    if action.kind == "torque" and action.stiffness is not None:
        raise fail("action.stiffness", "expected none: torques have no servos; or kind = 'position'")
    if action.servo == "law" and action.stiffness is None:
        raise fail(
            "action.servo", "expected 'actuator': without action.stiffness and action.damping the model's servos act"
        )
    _ordered("action.clip", action.clip, fail)
    for i, term in enumerate(card.observation):
        at = f"observation[{i}]"
        if term.term not in TERMS:
            raise fail(f"{at}.term", f"unknown term '{safe(term.term)}'; {nearest(term.term, list(TERMS))}")
        if term.term.startswith("clock") and card.clock is None:
            raise fail("clock", f"expected a table with the frequency [Hz]: the network sees {term.term}")
        if term.frame and term.term not in VECTORS:
            raise fail(f"{at}.frame", f"expected none: only {', '.join(VECTORS)} are in a frame")
        if term.joints and not term.term.startswith("joint"):
            raise fail(f"{at}.joints", "expected none: only joint positions and velocities are of joints")
        for name in term.joints:
            if name not in card.joints:
                raise fail(
                    f"{at}.joints", f"'{safe(name)}' is none of the card's joints; {nearest(name, list(card.joints))}"
                )
        _ordered(f"{at}.clip", term.clip, fail)
        size = size_of(term, card)
        if size is not None:
            _sized(f"{at}.scale", term.scale, size, "numbers", fail)
            _sized(f"{at}.offset", term.offset, size, "numbers", fail)
    if card.stacked == "call" and len({term.history for term in card.observation}) > 1:
        raise fail("stacked", "expected 'term': whole calls are laid side by side only where every history is as long")
    for name, span in card.command.items():
        if name not in WAYS:
            raise fail(f"command.{safe(name)}", f"unknown component; {nearest(name, list(WAYS))}")
        _ordered(f"command.{name}", span, fail)


def _sized(key: str, value: Numbers | None, count: int, of: str, fail: Fail) -> None:
    if isinstance(value, tuple) and len(value) != count:
        raise fail(key, f"expected one number, or one for each of the {count} {of}, got {len(value)}")


def _ordered(key: str, span: tuple[float, float] | None, fail: Fail) -> None:
    if span is not None and not span[0] <= span[1]:
        raise fail(key, f"expected [lower, upper], got {list(span)}")


def size_of(term: Any, card: Card) -> int | None:
    """How many numbers a term has at a call; None where the robot says."""
    count = len(term.joints) or len(card.joints)
    clock = 2 * len(card.clock.offsets) if card.clock else 0
    sizes = {"joint_position": count, "joint_velocity": count, "last_action": len(card.joints), "clock_cos_sin": clock,
             "clock_sin_cos": clock, "contact": None, "height": 1, "heading": 1, "time": 1, "quaternion_wxyz": 4,
             "quaternion_xyzw": 4, "rotation_6d": 6}  # fmt: skip
    return sizes.get(term.term, 3)


def lay_card(data: dict[str, Any], keys: dict[str, Path], path: Path, fail: Fail) -> None:
    """Lays what a card says of scenarios under a scenario, in place.

    Args:
        data: The scenario as plain data, whose law is a card.
        keys: Where each of its keys was written.
        path: Its file.
        fail: Makes the error.

    Raises:
        InputError: There is no such card, or it is none.
    """
    written = keys.get("law")
    card = Path(find_law(data["law"], None if written == COMMAND_LINE else (written or path).parent, fail))
    lay_under(data, read_card(card).scenario, keys, card)
    lay_under(data, OWN_WORLD, keys, card)
