"""A policy card: what a network sees, what its numbers mean, how often it is asked; a TOML file beside the network."""

from pathlib import Path
from typing import Annotated, Any, Literal

from msgspec import Meta, field

from biped.base.errors import InputError, echo, safe
from biped.base.files import is_file, label, nearest, read_toml
from biped.base.typed import Hold, Name, Names, NonNegative, Positive, Real, Section
from biped.scenario.devices import WAYS
from biped.scenario.general import lay_under
from biped.scenario.keys import Scenario
from biped.scenario.laws import find_law
from biped.scenario.valid import COMMAND_LINE, Fail, convert, known_keys

Numbers = float | tuple[float, ...]
"""One for all, or one for each joint in the card's order."""

VECTORS = ("linear_velocity", "angular_velocity", "gravity")
"""Terms of three numbers in a frame of the robot."""
TERMS = (
    *VECTORS, "command", "joint_position", "joint_velocity", "last_action", "clock_cos_sin", "clock_sin_cos", "contact",
    "height", "heading", "quaternion_wxyz", "quaternion_xyzw", "euler", "rotation_6d", "time",
)  # fmt: skip
"""Everything that a network can be shown."""


class Term(Section, frozen=True, kw_only=True):
    """Numbers that a network is shown: (value + offset) clipped, times scale.

    Attributes:
        term: Its name, one of `TERMS`: linear and angular velocity [m/s, rad/s] and the direction of gravity in the
            frame; the command; joint positions minus the default [rad] and velocities [rad/s]; the last action,
            unscaled; the clock's cosines, then sines, or the other way; whether each foot touches; height [m] and
            heading [rad] of the base; its orientation.
        offset: Added to it, one for all numbers or one for each.
        clip: [lower, upper] bounds after that.
        scale: Factor after that, one for all numbers or one for each.
        history: How many of the latest it is shown, the oldest first.
        delay: Calls of the network by which it is late.
        frame: Site or body whose frame it is in; default: the base.
        joints: Of joint positions and velocities, which; default: all of the card's.
    """

    term: Name
    offset: Numbers = 0.0
    clip: tuple[float, float] | None = None
    scale: Numbers = 1.0
    history: Annotated[int, Meta(ge=1, le=1000)] = 1
    delay: Annotated[int, Meta(ge=0, le=1000)] = 0
    frame: Name = ""
    joints: Names = ()


class Action(Section, frozen=True):
    """The way from a network's numbers to the joints: clipped, times scale, plus offset.

    Attributes:
        kind: `position` targets [rad] of servos, or `torque` [N m].
        scale: Factor of each.
        offset: Added to each; default: the default positions, of torques 0.
        clip: [lower, upper] bounds of the network's numbers.
        stiffness: [N m/rad] of the servos; default: those of the model file.
        damping: [N m s/rad] of the servos; default: likewise.
        effort: [N m] bounds of the torques; default: the file's alone.
        servo: Who computes the servos' torques from one step of the physics to the next: MuJoCo's `actuator`s, or the
            `law` itself, before each step, which `implicitfast` steps otherwise.
        delay: [s] by which an action is late.
    """

    kind: Literal["position", "torque"] = "position"
    scale: Numbers = 1.0
    offset: Numbers | None = None
    clip: tuple[float, float] | None = None
    stiffness: Numbers | None = None
    damping: Numbers | None = None
    effort: Numbers | None = None
    servo: Literal["actuator", "law"] = "actuator"
    delay: Hold = 0.0


class Clock(Section, frozen=True):
    """Phases that go round with time.

    Attributes:
        frequency: [Hz].
        offsets: [rad] of each phase when the network is first asked.
        per_speed: [Hz s/m] by which the frequency grows with the size of the command.
        most_speed: Size of the command beyond which it does not.
        still: [rad] all phases while the size of the command is below `threshold`; default: they go on.
        threshold: Of `still` and `per_speed`.
    """

    frequency: Positive
    offsets: tuple[float, ...] = (0.0,)
    per_speed: Real = 0.0
    most_speed: NonNegative = 1.5
    still: float | None = None
    threshold: NonNegative = 0.01


class Card(Section, frozen=True, kw_only=True):
    """A policy card.

    Attributes:
        description: One line for people.
        network: The ONNX file, beside the card.
        rate: [Hz] at which it is asked; in between its latest action holds.
        start: [s] of the first call; until then the joints are held to their default positions.
        joints: Joints or actuators in the network's order; those of the robot that are missing hold their start.
        default: [rad] their default positions.
        action: What becomes of the network's numbers.
        observation: What it sees, in its order.
        stacked: Of terms with a history, what is laid side by side: the history of each `term`, or whole `call`s.
        clock: Phases, if it sees any.
        command: Bounds of what it was trained on: forward and left [m/s], yaw [rad/s].
        source: Where it comes from: repository, commit, licence, digests, and where each number was found.
        scenario: What scenarios with this law say if they say nothing else.
    """

    description: Name = ""
    network: Name
    rate: Positive
    start: Hold = 0.0
    joints: Names
    default: Numbers = 0.0
    action: Action = Action()
    observation: Annotated[tuple[Term, ...], Meta(min_length=1, max_length=100)]
    stacked: Literal["term", "call"] = "term"
    clock: Clock | None = None
    command: dict[str, tuple[float, float]] = field(default_factory=dict)
    source: dict[str, str] = field(default_factory=dict)
    scenario: dict[str, Any] = field(default_factory=dict)


def per_joint(value: Numbers, count: int) -> tuple[float, ...]:
    """One number for each joint."""
    return tuple(value) if isinstance(value, tuple) else (value,) * count


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
