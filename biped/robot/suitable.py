"""Whether a scenario and a gait suit a robot: laws, gaits and keys that it has no use for are refused by name."""

from biped.base.errors import InputError
from biped.robot.robot import Robot, torque_limits
from biped.robot.truth import check_truth
from biped.scenario.gains import Gains
from biped.scenario.gait import in_the_plane, out_of_the_plane
from biped.scenario.general import taken
from biped.scenario.keys import Scenario
from biped.scenario.laws import BUILT_IN, SPATIAL
from biped.scenario.possible import suits_seven_links
from biped.scenario.valid import fault
from biped.scenario.world import PLANE, SPACE


def walks_by_gait(s: Scenario) -> bool:
    """Whether the robot of a scenario cannot do without a gait, whose settings are laid below the scenario."""
    return s.robot is None


def check_gait(s: Scenario, gains: Gains, at: str, complete: bool) -> None:
    """Makes sure that gains are of a walker in the plane or in space, as the scenario's is.

    Args:
        s: The scenario.
        gains: Some of the gains of a gait, or all.
        at: What the gait's key begins with: `change[0].` of one that a change goes over to.
        complete: Whether they are all.

    Raises:
        InputError: They are of another walker.
    """
    if s.robot is None:
        in_the_plane(gains, s.model, at)
    elif complete and s.law == SPATIAL:
        out_of_the_plane(gains, s.model, at)


def check_keys(s: Scenario, robot: Robot) -> None:
    """Makes sure that a robot can do what a scenario says, where it stands aside.

    Raises:
        InputError: It cannot.
    """
    if s.robot is not None:
        if s.law is None:
            raise InputError(
                "law: expected one: the thesis's law needs a planar biped of seven links; write law = "
                f"'path.py:Class', or one of {', '.join(BUILT_IN)}", "law",
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
        if s.start.upright:
            raise InputError(f"start.upright: expected false: {in_plane}", "start.upright")
    check_truth(s.truth, robot)


def check_force(robot: Robot, force: tuple[float, ...], key: str, model: str) -> None:
    """Makes sure that a push has as many components as the robot has directions to move in.

    Raises:
        InputError: It has not.
    """
    size, words, where = (PLANE, "[forward, up]", "in the plane") if robot.planar else (
        SPACE, "[forward, left, up]", "in space")  # fmt: skip
    if len(force) != size:
        raise InputError(f"{key}: expected {words} N: model '{model}' moves {where}; got {list(force)}", key)
