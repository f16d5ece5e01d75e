"""Self-checks of a policy's card: most policies that seem bad have a wrong card.

Left and right are one of them: what a policy does in a mirrored state, against the mirror image of what it does.
"""

from pathlib import Path
from typing import NamedTuple

import mujoco
import numpy as np
from msgspec import structs

from biped.base.errors import InputError
from biped.control.card import Networked, Walker
from biped.engines.mujoco import simulate
from biped.engines.plant import MujocoPlant
from biped.ensemble.plan import Plan
from biped.measure.trajectory import Trajectory
from biped.robot.robot import Robot
from biped.robot.run import Factory, Run
from biped.scenario.card import Card, read_card
from biped.scenario.reading import from_text
from biped.studies.policy.tape import CLOSE, Tape, differences, record, replay

NEAR, ALIGNED = 0.03, 0.9
"""[m] by which a joint may be beside the mirror image of its partner's; cosine between their axes."""
OF_SPACE = 6
"""Coordinates of a base that moves in space."""
_OF_VECTOR, _OF_TURN = np.array([1.0, -1.0, 1.0]), np.array([-1.0, 1.0, -1.0])
"""Signs by which a mirror in the plane of walking multiplies a vector, and an axis of rotation."""


class Mirror(NamedTuple):
    """The mirror image of a robot.

    Attributes:
        place: (nq,) whose coordinate each is that of.
        sign: (nq,) by which it is multiplied.
        rest: (nq,) coordinates at which the robot is its own image.
        column: (nv,) whose velocity each is that of.
        turned: (nv,) by which it is multiplied.
    """

    place: np.ndarray
    sign: np.ndarray
    rest: np.ndarray
    column: np.ndarray
    turned: np.ndarray

    def state(self, q: np.ndarray) -> np.ndarray:
        """(n, nq) mirrored coordinates."""
        return self.rest + self.sign * (q - self.rest)[:, self.place]

    def motion(self, v: np.ndarray) -> np.ndarray:
        """(n, nv) mirrored velocities."""
        return self.turned * v[:, self.column]


def mirror_of(model: mujoco.MjModel, robot: Robot) -> Mirror | None:
    """Returns the mirror image of a robot by places and axes of its joints; None if it has no such symmetry."""
    if len(robot.base_columns) < OF_SPACE or abs(robot.forward[0]) < ALIGNED or abs(robot.upright[2]) < ALIGNED:
        return None
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    place, sign = np.arange(model.nq), np.ones(model.nq)
    column, turned = np.arange(model.nv), np.ones(model.nv)
    middle = data.xpos[robot.base_number, 1]
    for j in range(model.njnt):
        q, v = model.jnt_qposadr[j], model.jnt_dofadr[j]
        if model.jnt_type[j] == mujoco.mjtJoint.mjJNT_FREE:
            sign[q : q + 7] = [1.0, -1.0, 1.0, 1.0, -1.0, 1.0, -1.0]
            turned[v : v + 6] = [*_OF_VECTOR, *_OF_TURN]
            continue
        hinge = model.jnt_type[j] == mujoco.mjtJoint.mjJNT_HINGE
        image = data.xanchor[j] * _OF_VECTOR + [0.0, 2.0 * middle, 0.0]
        axis = data.xaxis[j] * (_OF_TURN if hinge else _OF_VECTOR)
        gap = np.linalg.norm(data.xanchor - image, axis=1)
        along = data.xaxis @ axis
        gap[(model.jnt_type != model.jnt_type[j]) | (np.abs(along) < ALIGNED)] = np.inf
        partner = int(np.argmin(gap))
        if gap[partner] > NEAR:
            return None
        place[model.jnt_qposadr[partner]], sign[model.jnt_qposadr[partner]] = q, np.sign(along[partner])
        column[model.jnt_dofadr[partner]], turned[model.jnt_dofadr[partner]] = v, np.sign(along[partner])
    if len(set(place)) < model.nq:
        return None
    rest = model.qpos0.copy()
    rest[sign < 0.0] *= 1.0 if np.all(rest[sign < 0.0] == 0.0) else 0.0
    return Mirror(place, sign, rest, column, turned)


def likeness(run: Run, tape: Tape) -> float | None:
    """How like a policy's targets in mirrored states are to the mirror image of those on a tape of its own.

    Args:
        run: Of its card.
        tape: It.

    Returns:
        Correlation of all joints' targets about their means, 1 where they are alike; None if the robot has no symmetry.
        Means are left out: trained policies hold arms and feet as they happened to learn it.
    """
    plant = MujocoPlant(run)
    law, mirror = plant.law.law, mirror_of(plant.model, plant.robot)
    assert isinstance(law, Walker)
    if mirror is None:
        return None
    at = law.places
    number = {int(place): i for i, place in enumerate(at)}
    if any(int(mirror.place[place]) not in number for place in at):
        return None
    order = np.array([number[int(mirror.place[place])] for place in at])
    rest, sign = (mirror.rest[at], mirror.sign[at]) if law.position else (np.zeros(len(at)), mirror.sign[at])
    target = rest + sign * (tape.target - rest)[:, order]
    image = tape._replace(
        qpos=mirror.state(tape.qpos), qvel=mirror.motion(tape.qvel), command=tape.command * [1.0, -1.0, -1.0],
        target=target, action=law.action_of(target),
    )  # fmt: skip
    return _correlation(np.array(replay(plant, image, opposite=True).targets), target)


def _correlation(first: np.ndarray, second: np.ndarray) -> float:
    """The correlation of all columns about their means; 0 of numbers that are too large or of none that change."""
    largest = np.max(np.abs([first, second]))  # numbers near the largest have no squares
    if not 0.0 < largest < np.inf:
        return 0.0
    first, second = (one - one.mean(axis=0) for one in (first / largest, second / largest))
    return float((first * second).sum() / max(np.sqrt((first**2).sum() * (second**2).sum()), 1e-24))


SECONDS = 4.0
"""[s] of each run."""
SETTLED = 1.5
"""[s] after which velocities count."""
ALONG, ACROSS, DRIFT = 0.3, 0.35, 1.0
"""Least share of a command that is done; most [m/s] across it; most [m] that is moved where nothing is asked for."""
ALIKE = 0.65
"""Least correlation between what a policy does in mirrored states and the mirror image of what it does."""
SMALL = 0.2
"""[m/s, rad/s] A smaller command may be passed over, as many policies do; the other way is wrong all the same."""

LEAST = 0.05
"""[m/s, rad/s] Least command that is tried."""
Asked = tuple[float, float, float]
"""A command: forward, left [m/s], yaw [rad/s]."""


class Check(NamedTuple):
    """One check.

    Attributes:
        name: In words.
        passed: Whether it passed.
        words: What came of it.
    """

    name: str
    passed: bool
    words: str


def check(file: Path, card: Card | None = None, blind: bool = True, more: str = "") -> list[Check]:
    """Checks a card by short runs on level ground.

    Args:
        file: The card's file.
        card: What stands for it instead of its contents.
        blind: Whether to see that permuted joints fail too.
        more: Of the runs' scenarios, as TOML.

    Returns:
        The checks; names and widths, which raise where they fail, come first.

    Raises:
        InputError: Card, network and model do not fit one another.
    """
    card = read_card(file) if card is None else card
    out = []
    still = _walk(file, card, (0.0, 0.0, 0.0), more)
    out.append(
        Check("names and widths fit the model", True, f"{len(card.joints)} joints, {len(card.observation)} terms")
    )
    drift = float(np.hypot(*(still.base[-1, :2] - still.base[0, :2])))
    out.append(Check("stays up and in place under zero command", still.end == "completed" and drift < DRIFT,
                     f"{_end(still)}, moved {drift:.2f} m"))  # fmt: skip
    out += _mirrored(file, card, more)
    for name, command in commands_of(card):
        out.append(_followed(name, command, _walk(file, card, command, more)))
    for name, command in _turns(card):
        out.append(_followed(name, command, *(_walk(file, card, way, more) for way in (command, _opposite(command)))))
    if blind:
        shifted = structs.replace(card, joints=(*card.joints[1:], card.joints[0]))
        t = _walk(file, shifted, commands_of(card)[0][1], more)
        wrong = not _followed("", commands_of(card)[0][1], t).passed
        out.append(Check("permuted joints fail", wrong, _end(t) if wrong else "they walk too: these checks are blind"))
    return out


def _mirrored(file: Path, card: Card, more: str) -> list[Check]:
    """Whether mirrored states give mirrored actions; nothing of a robot that is not its own mirror image."""
    run, name = run_of(file, card, commands_of(card)[0][1], more), "mirrored states give mirrored actions"
    try:
        alike = likeness(run, record(run))
    except InputError as error:
        return [Check(name, False, str(error))]
    if alike is None:
        return []
    return [Check(name, alike > ALIKE, f"correlation {alike:.2f}, least {ALIKE}")]


def commands_of(card: Card) -> list[tuple[str, Asked]]:
    """Commands within what a policy was trained on, and their names."""

    def bound(name: str, value: float) -> float:
        low, high = card.command.get(name, (-value, value))
        return min(max(value, 0.8 * low), 0.8 * high)

    return _real([
        ("walks forward", (bound("forward", 0.5), 0.0, 0.0)),
        ("walks backward", (bound("forward", -0.4), 0.0, 0.0)),
    ])  # fmt: skip


def _turns(card: Card) -> list[tuple[str, Asked]]:
    """Commands of which the opposite one is within what a policy was trained on too."""

    def bound(name: str, value: float) -> float:
        low, high = card.command.get(name, (-value, value))
        return 0.8 * min(value, high, -low) if name in card.command else value

    return _real([
        ("walks to the sides", (0.0, bound("left", 0.3), 0.0)),
        ("turns to either side", (0.0, 0.0, bound("yaw", 0.5))),
    ])  # fmt: skip


def _real(commands: list[tuple[str, Asked]]) -> list[tuple[str, Asked]]:
    """Those that ask for something: a policy may have been trained on none."""
    return [(name, command) for name, command in commands if np.linalg.norm(command) > LEAST]


def _opposite(command: Asked) -> Asked:
    forward, left, yaw = command
    return -forward, -left, -yaw


def _walk(file: Path, card: Card, command: Asked, more: str) -> Trajectory:
    """A short run under a command."""
    return simulate(run_of(file, card, command, more))


def run_of(file: Path, card: Card, command: Asked, more: str = "") -> Run:
    """Returns a short run of a card under a command, with more in its scenario."""
    forward, left, yaw = command
    text = (f"duration = {SECONDS}\n"
            f"command = {{ forward = {forward}, left = {left}, yaw = {yaw} }}\n{more}")  # fmt: skip
    return plan_of(file, card, text).run(0)


def plan_of(file: Path, card: Card, text: str) -> Plan:
    """Plans a scenario beside a card's file, in whose place the card stands.

    Args:
        file: The card's file.
        card: What stands for it instead of its contents.
        text: Of the scenario, as TOML, but for its law.
    """
    scenario = from_text(f'law = "{file.name}"\n{text}', file.parent / "check.toml")
    return Plan(scenario, law=Factory(Networked(card, file), scenario.law or "", str(file)))


def reproduce(file: Path, tape: Tape, card: Card | None = None) -> list[Check]:
    """Checks a card against a tape: each term of the observation, actions, targets and rate.

    Args:
        file: The card's file.
        tape: It.
        card: What stands for it instead of its contents.

    Raises:
        InputError: Card, network and model, or card and tape, do not fit one another.
    """
    gaps = differences(run_of(file, read_card(file) if card is None else card, (0.0, 0.0, 0.0)), tape)
    return [Check(f"{name} as on the tape", gap < CLOSE, f"differs by at most {gap:.2g}") for name, gap in gaps.items()]


def _followed(name: str, command: Asked, t: Trajectory, other: Trajectory | None = None) -> Check:
    """Whether a command was done; with a run of the opposite one, by half of what they differ in, without any bias."""
    for one in (t, other):
        if one is not None and one.end != "completed":
            return Check(name, False, f"asked for ({', '.join(f'{value:g}' for value in command)}); {_end(one)}")
    done, asked = _velocity(t), np.array(command)
    way = "did"
    if other is not None:
        done, way = 0.5 * (done - _velocity(other)), "or the opposite, did half a difference of"
    size = float(np.linalg.norm(asked))
    along = float(done @ asked) / size
    across = float(np.linalg.norm((done - along * asked / size)[:2]))
    words = ", ".join(f"{value:.2f}" for value in done)
    # A policy may pass over all but the way forward, and stand: only the other way is wrong.
    least = ALONG * size if command[0] > 0.0 and size >= SMALL else -0.5 * size
    return Check(name, along > least and across < ACROSS,
                 f"asked for ({', '.join(f'{value:g}' for value in command)}), {way} ({words})")  # fmt: skip


def _velocity(t: Trajectory) -> np.ndarray:
    """(3,) mean velocity forward, to the left [m/s] and about z [rad/s]."""
    late = t.time > SETTLED
    way, turning = t.heading[late], np.diff(t.heading[late]).mean() / t.tick
    moved = np.diff(t.base[late, :2], axis=0) / t.tick
    c, s = np.cos(way[:-1]), np.sin(way[:-1])
    forward, left = float((c * moved[:, 0] + s * moved[:, 1]).mean()), float((c * moved[:, 1] - s * moved[:, 0]).mean())
    return np.array([forward, left, turning])


def _end(t: Trajectory) -> str:
    return "stayed up" if t.end == "completed" else f"{t.end} at {float(t.time[-1]):.2f} s"
