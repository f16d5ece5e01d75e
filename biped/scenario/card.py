"""A policy card: what a network sees, what its numbers mean, how often it is asked; a TOML file beside the network."""

from typing import Annotated, Any, Literal

from msgspec import Meta, field

from biped.scenario.section import Hold, Name, Names, NonNegative, Positive, Real, Section

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
