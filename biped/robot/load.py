"""Robots from model files, and from what results keep of them; what does not suit a robot is refused by name."""

from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any, Protocol

import msgspec
import numpy as np

from biped.base.errors import InputError
from biped.base.files import folder
from biped.base.typed import LARGEST, convert
from biped.robot.planar.description import PlanarDescription, description_at, version_of
from biped.robot.planar.model import checked_model, tree_at
from biped.robot.planar.topology import BASE, ENDS, FOOT, LEGS, N_POINTS, SEGMENTS, TORSO
from biped.robot.planar.tree import Tree, seven_links_of
from biped.robot.robot import Drive, FootParts, Robot, planar_top, torque_limits
from biped.robot.truth import check_truth
from biped.scenario.gains import Gains
from biped.scenario.gait import in_the_plane, out_of_the_plane
from biped.scenario.general import taken
from biped.scenario.keys import Scenario
from biped.scenario.laws import THESIS
from biped.scenario.possible import suits_seven_links
from biped.scenario.robot import Described
from biped.scenario.valid import fault
from biped.scenario.world import PLANE, SPACE


class RobotStarts(Protocol):
    """Start postures of a robot."""

    def start(self, s: Scenario, noise: np.random.Generator | None) -> tuple[np.ndarray, np.ndarray]:
        """Coordinates (nq,) and velocities (nv,) that a run starts with; `noise` draws deviations, None: none."""
        ...

    def foremost(self, s: Scenario) -> float:
        """[m] the foremost contact point of the start without deviations."""
        ...


def load_robot(path: Path, table: Described | None) -> Robot:
    """Loads the robot in a model file.

    Args:
        path: The file.
        table: What is said of it; None: it is a planar biped of seven links, with its own description.

    Raises:
        InputError: It is none: all that is wrong.
    """
    if table is None:
        return _planar(*version_of(path))
    from biped.robot.recognise import robot_of

    return robot_of(path, table)


def starts_of(path: Path, robot: Robot, table: Described | None) -> RobotStarts:
    """Returns the start postures of a robot; arguments as of `load_robot`."""
    if robot.seven_links is not None:
        from biped.robot.planar.posture import PlanarStarts

        return PlanarStarts(path, robot.seven_links)
    from biped.robot.starts import Starts

    return Starts(path, table or Described())


@lru_cache(maxsize=8)
def _planar(file: str, modified: float, described: float) -> Robot:
    path = Path(file)
    model, description = checked_model(path), description_at(path)
    robot = planar_robot(path.stem, description, tree_at(path))
    points = np.reshape([model.geom(point).id for point in robot.points], (LEGS, ENDS)).tolist()
    return msgspec.structs.replace(
        robot,
        feet=tuple(msgspec.structs.replace(foot, geoms=tuple(geoms))
                   for foot, geoms in zip(robot.feet, points, strict=True)),
        ground=int(model.geom(description.contact.ground).id),
        starts=tuple(model.key(i).name for i in range(model.nkey)),
    )  # fmt: skip


def planar_robot(name: str, description: PlanarDescription, tree: Tree) -> Robot:
    """Returns the planar biped of a description with these lengths and masses.

    It knows no geoms, which are numbers of a file.

    Args:
        name: Of its model.
        description: Of its parts.
        tree: Lengths and masses of its links.
    """
    joints = description.joints[BASE:]
    feet = []
    for leg, parts in enumerate(description.leg):
        body = FOOT[leg] + 1
        here = tree.point[ENDS * leg : ENDS * (leg + 1)].tolist()
        first = BASE + SEGMENTS * leg
        feet.append(FootParts(
            name=parts.name, bodies=(body,), geoms=(), on=(body,) * ENDS, points=tuple((x, 0.0, z) for x, z in here),
            joints=tuple(range(first, first + SEGMENTS)), pitching=parts.joints, names=parts.points,
        ))  # fmt: skip
    return Robot(
        name=name,
        description=description.description,
        planar=True,
        base=description.base.link,
        base_number=TORSO + 1,
        base_columns=tuple(range(BASE)),
        upright=(0.0, 0.0, 1.0),
        forward=(1.0, 0.0, 0.0),
        top=planar_top(tree, description.shown.com),
        bodies=description.links,
        masses=tuple(tree.mass.tolist()),
        q_names=description.joints,
        v_names=description.joints,
        drives=tuple(Drive(name=motor, joint=joint, kind="torque", limit=LARGEST, place=place, column=place, turns=1)
                     for place, (motor, joint) in enumerate(zip(description.actuators, joints, strict=True), BASE)),
        feet=tuple(feet),
        ground=-1,
        leg=tree.leg,
        start="",
        starts=(),
        walked=description.walked,
        shown=description.shown,
        trunk=description.base.link,
        motor=description.motor,
        seven_links=seven_links_of(description, tree),
    )  # fmt: skip


def robot_from(data: Mapping[str, Any] | None, tree: Mapping[str, Any] | None = None) -> Robot:
    """Returns the robot that a result kept, in this version's form or an earlier one.

    Args:
        data: What was kept of it; None: nothing, as in the oldest results, all of which are the human's.
        tree: Lengths and masses, which earlier results of planar bipeds kept beside a description.

    Raises:
        ValidationError: It is no robot.
        KeyError: Something is missing.
    """
    if data is not None and "drives" in data:
        return convert(data, Robot)
    known = convert(data, PlanarDescription) if data is not None else description_at(_human())
    if tree is None:
        raise KeyError("tree")
    numbers = Tree(**{name: np.array(tree[name], dtype=float) for name in Tree._fields})
    if len(numbers.point) != N_POINTS:
        raise ValueError(f"{len(numbers.point)} contact points")
    return planar_robot("", known, numbers)


def _human() -> Path:
    return folder("models") / "human.xml"


def walks_by_gait(s: Scenario) -> bool:
    """Whether the robot of a scenario cannot do without a gait, whose settings are laid below the scenario."""
    return s.robot is None


def check_gait(s: Scenario, robot: Robot, gains: Gains, at: str, complete: bool) -> None:
    """Makes sure that gains are of a walker in the plane or in space, as the scenario's is.

    Args:
        s: The scenario.
        robot: Its robot.
        gains: Some of the gains of a gait, or all.
        at: What the gait's key begins with: `change[0].` of one that a change goes over to.
        complete: Whether they are all.

    Raises:
        InputError: They are of another walker.
    """
    if s.robot is None:
        in_the_plane(gains, s.model, at)
    elif complete and s.law == THESIS and not robot.planar:
        out_of_the_plane(gains, s.model, at)


def check_keys(s: Scenario, robot: Robot) -> None:
    """Makes sure that a robot can do what a scenario says, where it stands aside.

    Raises:
        InputError: It cannot.
    """
    if s.robot is not None:
        if s.law is None:
            raise InputError(
                "law: expected one: only a planar biped of seven links walks without; write law = 'thesis', which "
                "walks bipeds with a free base, 'stand', 'path.py:Class' or a policy's 'card.toml'", "law",
            )  # fmt: skip
        taken(s, fault)  # draws and points of a sweep say what no file did
    else:
        suits_seven_links(s, fault)
        if s.command is not None:
            raise InputError("command: expected none: the thesis's law is asked for no velocity; a command is for a "
                             "policy or a law of one's own on a robot of any kind", "command")  # fmt: skip
    torque_limits(robot, s)
    if s.actuation.motors and robot.motor is None:
        raise InputError(
            f"actuation.motors: model '{s.model}' has none; expected a table [motor] in its description",
            "actuation.motors",
        )
    if robot.planar:
        in_plane = f"model '{s.model}' moves in the plane"
        if s.ground.side_slope != 0.0:
            raise InputError(f"ground.side_slope: expected 0: {in_plane}", "ground.side_slope")
        if s.start.upright and s.robot is None:
            raise InputError(f"start.upright: expected false: {in_plane}", "start.upright")
        if s.start.walking and s.robot is None:
            raise InputError(f"start.walking: expected 0: {in_plane}", "start.walking")
    check_truth(s.truth, robot)


def force_on(robot: Robot, force: tuple[float, ...], key: str, model: str) -> tuple[float, ...]:
    """A push with as many components as the robot has directions to move in.

    A planar robot of any kind takes one of three, forward, left and up, if nothing of it is to the left.

    Raises:
        InputError: It has others.
    """
    if robot.planar and robot.seven_links is None and len(force) == SPACE and force[1] == 0.0:
        return force[0], force[2]
    size, words, where = (PLANE, "[forward, up]", "in the plane") if robot.planar else (
        SPACE, "[forward, left, up]", "in space")  # fmt: skip
    if len(force) != size:
        raise InputError(f"{key}: expected {words} N: model '{model}' moves {where}; got {list(force)}", key)
    return force
