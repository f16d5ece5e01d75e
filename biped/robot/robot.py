"""A robot as data, as its model file and its description say it: it is kept with what the robot did."""

from itertools import islice

import numpy as np
from msgspec import structs

from biped.base.errors import InputError
from biped.base.typed import LARGEST, Section
from biped.robot.planar.description import Motor
from biped.robot.planar.topology import SEGMENTS, THIGH, TORSO
from biped.robot.planar.tree import SevenLinks, Tree, seven_links_of
from biped.scenario.keys import Scenario
from biped.scenario.robot import Appearance, Place, Walked


class Drive(Section, frozen=True):
    """An actuator on a joint.

    Attributes:
        name: Its name.
        joint: What it drives.
        kind: What it is in the file: `torque`, `position` or `velocity`.
        limit: [N m] of the joint's torque (N of a slide); `LARGEST` if the file names none.
        place: Where its joint stands in q.
        column: Where its joint stands in v.
        turns: Whether its joint turns about y as angles do in the thesis (about -y: 1), the other way (-1), or not (0).
        stiffness: [N m/rad] of its servo, if it is one.
        damping: [N m s/rad] of it.
        span: [rad] within which the file keeps the target of a position servo; None: anywhere.
    """

    name: str
    joint: str
    kind: str
    limit: float
    place: int
    column: int
    turns: int = 0
    stiffness: float = 0.0
    damping: float = 0.0
    span: tuple[float, float] | None = None

    @property
    def limited(self) -> bool:
        """Whether the file limits its torque."""
        return self.limit < LARGEST


class FootParts(Section, frozen=True):
    """A foot.

    Attributes:
        name: What people call it.
        bodies: Numbers of its bodies.
        geoms: Numbers of its geoms that touch the ground.
        on: Body of each of its contact points.
        points: [m] their places in these bodies' frames.
        joints: Numbers of the joints of its leg that turn it in the plane of walking: hip, knee, ankle; fewer if there
            are no such.
        pitching: Their names.
        names: Of its contact points; default: its own name with a number.
    """

    name: str
    bodies: tuple[int, ...]
    geoms: tuple[int, ...]
    on: tuple[int, ...]
    points: tuple[Place, ...]
    joints: tuple[int, ...]
    pitching: tuple[str, ...]
    names: tuple[str, ...] = ()


class Robot(Section, frozen=True):
    """A biped: what its model file and its description say.

    Numbers of bodies, geoms and joints, and places in q and v, are MuJoCo's of the file; where `seven_links` is set,
    those of bodies and joints and all places follow the canonical order (`biped.robot.planar.topology`).

    Attributes:
        name: Its model.
        description: One line for people.
        planar: Whether its base moves in the plane alone.
        base: The body that moves freely.
        base_number: Its number.
        trunk: The body that pushes act on if they name none, and by whose height a fall is judged: the base, or of one
            without mass the heaviest body that is fixed to it.
        base_columns: Where its coordinates stand in v: along x, y, z, about them; in the plane x, z, pitch.
        upright: (3,) direction in the base's frame that is up when its coordinates are zero.
        forward: (3,) the same of forward.
        top: [m] its highest point above the base, in the base's frame: where a stick figure's trunk ends.
        bodies: Names of all bodies.
        masses: [kg] of them.
        q_names: Of coordinates.
        v_names: Of velocities.
        drives: Actuators, in the order in which a law commands them.
        feet: Two feet.
        ground: Number of the ground's geom.
        leg: [m] from hip to sole.
        start: Keyframe that a run starts from; empty: coordinates at zero.
        starts: Keyframes that there are.
        walked: What counts as walking.
        shown: The camera.
        motor: Its actuators; None: whatever gives the torques that are asked for.
        seven_links: Its links, where it is a planar biped of seven that the compiled code walks; None of any other.
    """

    name: str
    description: str
    planar: bool
    base: str
    base_number: int
    base_columns: tuple[int, ...]
    upright: Place
    forward: Place
    top: Place
    bodies: tuple[str, ...]
    masses: tuple[float, ...]
    q_names: tuple[str, ...]
    v_names: tuple[str, ...]
    drives: tuple[Drive, ...]
    feet: tuple[FootParts, ...]
    ground: int
    leg: float
    start: str
    starts: tuple[str, ...]
    walked: Walked
    shown: Appearance
    trunk: str = ""
    motor: Motor | None = None
    seven_links: SevenLinks | None = None

    @property
    def freedom(self) -> str:
        """Where its base moves, for people."""
        return "in the plane (x, z, pitch)" if self.planar else "in space (free joint)"

    @property
    def trunk_number(self) -> int:
        """Number of the trunk."""
        return self.bodies.index(self.trunk) + 1 if self.trunk else self.base_number

    @property
    def mass(self) -> float:
        """[kg] of the whole robot."""
        return sum(self.masses)

    @property
    def legs(self) -> tuple[str, ...]:
        """Names of the feet, as people call them."""
        return tuple(foot.name for foot in self.feet)

    @property
    def actuators(self) -> tuple[str, ...]:
        """Names of the actuators."""
        return tuple(drive.name for drive in self.drives)

    @property
    def points(self) -> tuple[str, ...]:
        """Names of the contact points, foot by foot."""
        return tuple(name for foot in self.feet
                     for name in foot.names or (f"{foot.name}.{i}" for i in range(len(foot.points))))  # fmt: skip

    @property
    def stops(self) -> tuple[str, ...]:
        """Names of the joints with a stop at zero, leg by leg; of seven links alone."""
        return () if self.seven_links is None else self.seven_links.stops

    @property
    def drive_groups(self) -> dict[str, list[int]]:
        """Numbers of the actuators that are reported together: of seven links both legs'; of others each alone."""
        if self.seven_links is None:
            return {name: [i] for i, name in enumerate(self.actuators)}
        return {name: [i, SEGMENTS + i] for i, name in enumerate(("hip", "knee", "ankle"))}

    @property
    def pitching_drives(self) -> list[tuple[int, int]]:
        """(number among hip, knee and ankle, right and left; number of its drive) of those that are driven."""
        return [
            (SEGMENTS * leg + i, k)
            for leg, foot in enumerate(self.feet) for i, name in enumerate(foot.pitching)
            for k, drive in enumerate(self.drives) if drive.joint == name
        ]  # fmt: skip

    @property
    def base_axes(self) -> tuple[int, ...]:
        """Which of the motions along x, y, z and about them the base has, in the order of `base_columns`."""
        return (0, 2, 4) if self.planar else (0, 1, 2, 3, 4, 5)

    @property
    def moving_columns(self) -> tuple[int, ...]:
        """Where the velocities that move the base along stand in v; the last is up."""
        return self.base_columns[: 2 if self.planar else 3]

    @property
    def turning_columns(self) -> tuple[int, ...]:
        """Where the velocities that turn the base stand in v: about y in the plane, about x, y and z in space."""
        return self.base_columns[2 if self.planar else 3 :]

    @property
    def pitch_column(self) -> int:
        """Where the velocity that turns the base about y stands in v."""
        return self.base_columns[2 if self.planar else 4]

    def heading(self, turn: np.ndarray) -> np.ndarray:
        """(n,) [rad] heading of the base with axes (n, 3, 3), to the left positive, without jumps; 0 in the plane."""
        if self.planar:
            return np.zeros(len(turn))
        way = turn @ np.array(self.forward)
        return np.unwrap(np.arctan2(way[:, 1], way[:, 0]))

    @property
    def columns(self) -> np.ndarray:
        """(nu,) where the driven joints stand in v."""
        return np.array([drive.column for drive in self.drives], dtype=int)

    @property
    def places(self) -> np.ndarray:
        """(nu,) where they stand in q."""
        return np.array([drive.place for drive in self.drives], dtype=int)

    @property
    def of_foot(self) -> np.ndarray:
        """(P,) number of the foot of each contact point."""
        return np.repeat(np.arange(len(self.feet)), [len(foot.points) for foot in self.feet])


def seven_links(robot: Robot) -> SevenLinks:
    """Returns the seven links of a robot that has them.

    Raises:
        InputError: It is another robot.
    """
    if robot.seven_links is None:
        raise InputError(f"model: expected a planar biped of seven links for this, got '{robot.name}'", "model")
    return robot.seven_links


def planar_top(tree: Tree, share: float) -> Place:
    """[m] upper end of the torso of seven links, whose centre of mass is a share of its length above the hip."""
    hip, middle = tree.joint[THIGH[0]], tree.com[TORSO]
    x, z = (hip + (middle - hip) / share).tolist()
    return x, 0.0, z


def with_tree(robot: Robot, tree: Tree) -> Robot:
    """Returns a robot of seven links with other lengths and masses."""
    places = iter(tree.point.tolist())
    feet = tuple(
        structs.replace(foot, points=tuple((x, 0.0, z) for x, z in islice(places, len(foot.points))))
        for foot in robot.feet
    )
    return structs.replace(
        robot, masses=tuple(tree.mass.tolist()), feet=feet, leg=tree.leg, top=planar_top(tree, robot.shown.com),
        seven_links=seven_links_of(seven_links(robot), tree),
    )  # fmt: skip


def torque_limits(robot: Robot, s: Scenario) -> tuple[float, ...]:
    """(nu,) [N m] torque limits of a run: the model file's, or the scenario's where that is less.

    Raises:
        InputError: The scenario has limits of other actuators.
    """
    asked, count = s.actuation.torque_limit, len(robot.drives)
    if isinstance(asked, tuple) and len(asked) != count:
        raise InputError(
            f"actuation.torque_limit: expected a number, or one for each of {count} actuators, got {len(asked)}",
            "actuation.torque_limit",
        )
    limits = asked if isinstance(asked, tuple) else (asked,) * count
    return tuple(min(drive.limit, float(limit)) for drive, limit in zip(robot.drives, limits, strict=True))
