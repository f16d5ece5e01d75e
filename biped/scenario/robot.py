"""The description of a robot of any kind: `[robot]` of a scenario, or the TOML file beside its model file.

What is not said is recognised in the model file (`biped.robot.recognise`).
"""

from typing import Annotated

from msgspec import Meta

from biped.base.typed import Name, Names, NonNegative, Positive, Section

Place = tuple[float, float, float]


class Walked(Section, frozen=True):
    """Thresholds of walking.

    Attributes:
        distance: [m/s] times the duration: how far a run must have gone.
        speed: [m/s] that its mean speed over the window must exceed.
    """

    distance: NonNegative
    speed: NonNegative


class Appearance(Section, frozen=True):
    """How a robot is drawn: where the camera is, relative to the torso's place on the ground, and its torso.

    Attributes:
        eye: [m].
        target: [m] what it looks at.
        com: How high above the hip the torso's centre of mass is, as a share of the torso's length.
        head: Whether it has one.
    """

    eye: Place
    target: Place
    com: Annotated[float, Meta(gt=0, le=10)] = 0.626
    head: bool = True


class Base(Section, frozen=True):
    """The body that moves freely: in the plane by slides along x and z and a hinge about y, in space by a free joint.

    Three slides along x, y and z and a ball are taken for a free joint.

    Attributes:
        body: Its body; default: the one that is recognised.
    """

    body: Name = ""


class Foot(Section, frozen=True):
    """A foot; its contact points are corners of its geoms, or its sites.

    Attributes:
        name: What people call it; default: its body.
        geoms: Geoms that touch the ground.
        sites: Places of its contact points, where they are to be these.
        bodies: Bodies all of whose geoms touch the ground.
    """

    name: Name = ""
    geoms: Names = ()
    sites: Names = ()
    bodies: Names = ()


class Actuators(Section, frozen=True):
    """The actuators that drive the joints.

    Attributes:
        names: Those that a law commands, in its order; default: all that the file has, in the file's.
        stiffness: [N m/rad] of the servos on joints whose actuators have none, where a law commands positions.
        damping: [N m s/rad] of the same, and where it commands velocities.
    """

    names: Names = ()
    stiffness: NonNegative = 0.0
    damping: NonNegative = 0.0


class Described(Section, frozen=True):
    """A robot of any kind: `[robot]`, or the description beside its model file with `kind = "general"`.

    Attributes:
        description: One line for people.
        base: The body that moves freely.
        foot: Its two feet; default: those that are recognised.
        actuators: What drives the joints.
        ground: The geom of the level plane; default: the only plane of the world, or one that is added.
        rigid: Joints that are taken out of the file: what hung on them is stiff, as the start has it.
        start: The keyframe that `start.posture = ""` means; default: the file's first, or its coordinates at zero.
        leg: [m] length of a leg in the Froude number; default: hip to sole.
        walked: What counts as walking.
        shown: The camera.
    """

    description: Name = ""
    base: Base = Base()
    foot: Annotated[tuple[Foot, ...], Meta(max_length=8)] = ()
    actuators: Actuators = Actuators()
    ground: Name = ""
    rigid: Names = ()
    start: Name = ""
    leg: Positive | None = None
    walked: Walked = Walked(distance=0.1, speed=0.15)
    shown: Appearance = Appearance(eye=(0.4, -3.2, 1.3), target=(0.15, 0.0, 0.8))
