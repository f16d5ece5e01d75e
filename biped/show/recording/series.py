"""A recorded run: its place in the recording, its curves and its state lanes."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import mujoco
import numpy as np
import rerun as rr

from biped.base.errors import InputError, plain
from biped.measure import signals
from biped.measure.trajectory import Trajectory

LANE = 1.6
"""[m] sideways from run to run."""


def nothing_believed(trajectory: Trajectory) -> None:
    """Of a controller that counts on no ground forces."""


class Recorded(NamedTuple):
    """One run to record.

    Attributes:
        name: Its name in the recording, of which its entities are; unlike the others'.
        trajectory: What it left behind.
        model: MuJoCo model with its visual geoms.
        metrics: Metrics by name; may be empty.
        checks: Every check as in a result (`biped.ensemble.checks.Check`); empty if nothing was expected.
        scenario_text: The effective scenario as TOML.
        ghost: Draw it as a grey shadow over the run before it.
        title: What people call it; default: its name.
        believed: Ground forces (n, 4, 2) [N] that the controller counts on, given the trajectory; None if it does not.
    """

    name: str
    trajectory: Trajectory
    model: mujoco.MjModel
    metrics: Mapping[str, Any]
    checks: Sequence[Mapping[str, Any]]
    scenario_text: str
    ghost: bool = False
    title: str = ""
    believed: Callable[[Trajectory], np.ndarray | None] = nothing_believed


class Placed(NamedTuple):
    """A run with its place in the recording.

    Attributes:
        run: The run; rows that are not finite are gone.
        root: Entity path below which everything of it is logged.
        lane: [m] sideways.
        number: Its number among the runs.
        alone: Whether it is the only one.
    """

    run: Recorded
    root: str
    lane: float
    number: int
    alone: bool

    def entity(self, *parts: str) -> str:
        """The entity path of something that belongs to the run."""
        return "/".join([self.root, *(rr.escape_entity_path_part(part) for part in parts)])


def times(seconds: np.ndarray) -> rr.TimeColumn:
    """The time line of a recording at (m,) [s], in whole nanoseconds: 1.053 s is not 1.052999999 s."""
    return rr.TimeColumn("time", duration=np.round(1e9 * seconds).astype("timedelta64[ns]"))


def place(runs: Sequence[Recorded]) -> list[Placed]:
    """Puts runs side by side, ghosts over the run before them.

    Raises:
        InputError: A run has no row that is finite: there is nothing to see of it.
    """
    placed, lane = [], 0.0
    for number, run in enumerate(runs):
        if number > 0 and not run.ghost:
            lane += LANE
        root = "/" + rr.escape_entity_path_part(run.name)
        whole = run._replace(trajectory=signals.finite(run.trajectory))
        if len(whole.trajectory) == 0:
            raise InputError(f"recording: {plain(run.name)} is finite at no time: there is nothing to see")
        placed.append(Placed(whole, root, lane, number, len(runs) == 1))
    return placed


RATE = 1000.0
"""[Hz] of the curves: chatter is part of the result; the viewer averages what is too dense to draw."""

# Okabe and Ito's colours, which the colour-blind can tell apart; a leg's joints are shades of its colour.
RIGHT, LEFT = (0, 114, 178), (213, 94, 0)
JOINT_COLOURS = ((0, 60, 110), RIGHT, (86, 180, 233), (130, 50, 0), LEFT, (240, 175, 70))
# Blue is the right leg and orange the left, so runs are neither.
RUN_COLOURS = {
    "grey": (90, 96, 104), "green": (0, 158, 115), "pink": (204, 121, 167), "yellow": (214, 164, 0),
    "violet": (120, 94, 240), "brown": (140, 86, 60),
}  # fmt: skip
SIGNAL = "signal_"
"""Beginning of the names of curves that a law of the user's own logged."""
_JOINTS = ("hip", "knee", "ankle")

# The lanes of a leg are shades of its colour: full on the ground, pale in the air.
LEG_STATES = tuple(
    {"1": ("stance", stance), "2": ("heel off", off), "3": ("swing", swing), "4": ("knee straight", straight)}
    for stance, off, swing, straight in (
        (RIGHT, (80, 156, 202), (200, 224, 240), (140, 190, 222)),
        (LEFT, (226, 142, 80), (248, 220, 200), (236, 176, 132)),
    )
)
_INFERRED = (150, 150, 155)
"""Curves of the robot's belief, beside the truth."""
_GAP = "-"
_ON = {"1": ("on the ground", (90, 100, 110))}
_IN_A = {"1": ("in A", (90, 100, 110))}
_BASIS = {"0": ("from what touches", (90, 100, 110)), "1": ("from the gyro", (204, 60, 120))}
"""Curves that the inferred posture rests on."""
_PUSHING = {"1": ("push", (204, 60, 120))}


class Curves(NamedTuple):
    """Curves that share a plot.

    Attributes:
        entity: Name of the entity below `series`.
        title: Title of the plot, with the unit.
        names: Of the curves.
        colours: Of the curves.
        values: (m, number of curves) at every row that is shown; rows with nan are left out, and not all are.
    """

    entity: str
    title: str
    names: tuple[str, ...]
    colours: tuple[tuple[int, int, int], ...]
    values: np.ndarray


def curves(placed: Placed) -> list[Curves]:
    """All curves of a run; one that has no value at any time (costs of a run that stays where it is) is none."""
    trajectory = placed.run.trajectory
    legs = trajectory.robot.legs
    names = tuple(f"{leg} {joint}" for leg in legs for joint in _JOINTS)
    angles = f"Joint angles [°]: {legs[0]} blue, {legs[1]} orange; hip dark, ankle light"
    own = (list(RUN_COLOURS.values())[placed.number % len(RUN_COLOURS)],)

    def single(entity: str, title: str, name: str, values: np.ndarray) -> Curves:
        label = name if placed.alone else placed.run.name
        return Curves(entity, title, (label,), own, values[:, None])

    def joints(entity: str, title: str, values: np.ndarray) -> Curves:
        return Curves(entity, title, names, JOINT_COLOURS, values)

    torso = single("torso", "Torso angle [°], 90 is upright", "torso", np.degrees(signals.torso_angle(trajectory)))
    if (inferred := signals.inferred_torso_angle(trajectory)) is not None:
        values = np.column_stack([torso.values, np.degrees(inferred)])
        names, colours = (*torso.names, f"{torso.names[0]}, inferred"), (*torso.colours, _INFERRED)
        torso = torso._replace(names=names, colours=colours, values=values)
    plots = [
        single("velocity", "Forward velocity of the torso [m/s]", "velocity", trajectory.forward_speed),
        torso,
        single("cost", "Cost of transport so far [-]", "net cost", signals.cost_of_transport(trajectory)),
        joints("angle", angles, np.degrees(trajectory.joint_angles)),
        joints("torque", "Joint torques [N m], colours as above", trajectory.joint_torques),
        joints("power", "Joint powers [W], colours as above", signals.joint_power(trajectory)),
        Curves(
            "force", "Normal force under each foot [N]", legs, (RIGHT, LEFT), trajectory.foot_force,
        ),
        *(single(f"{SIGNAL}{name}", name, name, values) for name, values in trajectory.signals.items()),
    ]  # fmt: skip
    rows = signals.every(trajectory, RATE)
    meant = [plot._replace(values=signals.means(plot.values, rows)) for plot in plots]
    return [plot for plot in meant if np.isfinite(plot.values).all(axis=1).any()]


def log_series(recording: rr.RecordingStream, placed: Placed) -> None:
    """Logs the curves of one run."""
    trajectory = placed.run.trajectory
    rows = signals.every(trajectory, RATE)
    for plot in curves(placed):
        path = placed.entity("series", plot.entity)
        style = rr.SeriesLines(
            colors=list(plot.colours),
            names=list(plot.names),
            widths=[1.5] * len(plot.names),
            # Not the viewer's own choice, which shows the peaks of chatter as if they were the force.
            aggregation_policy=rr.components.AggregationPolicy.Average,
        )
        recording.log(path, style, static=True)
        shown = np.isfinite(plot.values).all(axis=1)
        recording.send_columns(
            path, indexes=[times(trajectory.time[rows[shown]])], columns=rr.Scalars.columns(scalars=plot.values[shown])
        )


def log_states(recording: rr.RecordingStream, placed: Placed) -> None:
    """Logs leg states, believed contacts and the rows of A as changes."""
    trajectory = placed.run.trajectory
    time, end = trajectory.time, float(trajectory.time[-1]) + trajectory.tick
    phase, robot = signals.leg_states(trajectory).astype(int), trajectory.robot
    # The viewer names lanes by their path and sorts them by it: each leg's contacts come under its state.
    for leg, side in enumerate(robot.legs):
        _lane(recording, placed.entity("states", f"{side} leg"), time, end, phase[:, leg], LEG_STATES[leg])
    touching = (
        trajectory.believed
        if "believed" in trajectory.columns
        else signals.ends(trajectory.robot, trajectory.contact, np.max)
    )
    for i, (side, point) in enumerate((leg, end) for leg in robot.legs for end in ("toe", "heel")):
        lane = placed.entity("states", f"{side} leg, {point}")
        _lane(recording, lane, time, end, touching[:, i].astype(int), _ON)
    for i, row in enumerate((*robot.points, *robot.stops) if "active" in trajectory.columns else ()):
        flag = trajectory.active[:, i].astype(int)
        _lane(recording, placed.entity("constraints", row.replace("_", " ")), time, end, flag, _IN_A)
    if trajectory.inferred is not None:
        _lane(recording, placed.entity("states", "posture"), time, end, trajectory.inferred[:, 2].astype(int), _BASIS)
    if trajectory.pushes:
        pushed = np.zeros(len(time), int)
        for start, stop, *_ in trajectory.pushes:
            pushed |= (time > start - 1e-9) & (time < stop - 1e-9)
        _lane(recording, placed.entity("states", "push"), time, end, pushed, _PUSHING)


def colour_word(number: int) -> str:
    """The name of the colour of a run's curves."""
    return list(RUN_COLOURS)[number % len(RUN_COLOURS)]


def _lane(
    recording: rr.RecordingStream, path: str, time: np.ndarray, end: float, state: np.ndarray, known: dict
) -> None:
    """One lane: a change wherever state (n,) changes, a gap where it is not `known` and after `end` [s].

    (Rerun's own gap, a null, makes a file that its `rrd verify` rejects: a state that is not shown serves.)
    """
    recording.log(
        path,
        rr.StateConfiguration(
            values=[*known, _GAP],
            labels=[*(label for label, _ in known.values()), ""],
            colors=[*(colour for _, colour in known.values()), (0, 0, 0)],
            visible=[True] * len(known) + [False],
        ),
        static=True,
    )
    changed = np.flatnonzero(np.diff(state, prepend=state[0] - 1))
    words = [str(s) if str(s) in known else _GAP for s in state[changed]]
    recording.send_columns(
        path, indexes=[times(np.append(time[changed], end))], columns=rr.StateChange.columns(state=[*words, _GAP])
    )
