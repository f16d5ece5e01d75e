"""A policy from its card as a control law: what it sees, assembled; its network, asked; its actions, applied."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import mujoco
import numpy as np

from biped.base.errors import InputError
from biped.base.files import label, nearest
from biped.base.typed import LARGEST
from biped.control.network import Measure, Network, Phases, Shown, in_frame, of_base
from biped.robot.build import Command, Servo
from biped.robot.robot import Robot
from biped.scenario.card import Card, Term, per_joint

if TYPE_CHECKING:
    from biped.control.law import Setup
    from biped.control.observation import Observation


class Networked:
    """Makes the law of every run of a policy.

    Args:
        card: It.
        file: The file of the card.

    Attributes:
        command: What its law commands.
    """

    def __init__(self, card: Card, file: Path):
        self.card, self.file = card, file
        explicit = card.action.kind == "torque" or card.action.servo == "law"
        self.command: Command = "torque" if explicit else "position"

    def servos(self, robot: Robot) -> tuple[Servo | None, ...] | None:
        """Servos of the robot's actuators; None: the file's own."""
        action, count = self.card.action, len(self.card.joints)
        if self.command != "position" or action.stiffness is None or action.damping is None:
            return None
        effort = per_joint(LARGEST if action.effort is None else action.effort, count)
        rows = zip(per_joint(action.stiffness, count), per_joint(action.damping, count), effort, strict=True)
        own = {drive: Servo(*row) for drive, row in zip(self.drives(robot), rows, strict=True)}
        # What the policy does not command is held where it starts, as stiffly as what it does.
        rest = Servo(max(s.stiffness for s in own.values()), max(s.damping for s in own.values()), LARGEST)
        return tuple(own.get(i, None if drive.stiffness > 0.0 else rest) for i, drive in enumerate(robot.drives))

    def drives(self, robot: Robot) -> list[int]:
        """Numbers of the robot's actuators in the network's order.

        Raises:
            InputError: One has no such name.
        """
        names = {drive.joint: i for i, drive in enumerate(robot.drives)}
        names |= {drive.name: i for i, drive in enumerate(robot.drives)}
        for name in self.card.joints:
            if name not in names:
                raise InputError(f"{label(self.file)}: joints: '{name}' is no driven joint of model '{robot.name}'; "
                                 f"{nearest(name, [drive.joint for drive in robot.drives])}", "law")  # fmt: skip
        return [names[name] for name in self.card.joints]

    def __call__(self, setup: Setup) -> Walker:
        """Makes the law of a run."""
        return Walker(self.card, self.file, setup, self.drives(setup.robot))


class Walker:
    """The law of one run.

    Args:
        card: The policy's card.
        file: Its file.
        setup: What is known before the run.
        drives: Numbers of the actuators in the network's order.

    Attributes:
        calls: How often the network was asked.
        observed: What it was shown at the latest call.
        action: What it returned then.
        target: What became of that, in the network's order.
        applied: (n,) the target that acted until then, in the same order.
        late: How many calls later than at once a target acts.
        sizes: Terms and how many numbers each is shown.
        rate: [Hz] at which it is asked.
        clock: Its phases; None: it has none.
        places: (n,) where its joints stand in q, in the network's order.
        position: Whether its targets are positions, not torques.
        servo: Of a policy that computes its servos itself: stiffness, damping and effort (n,) of each; None of others.
        columns: (n,) where its joints' velocities stand in v, likewise.
        driven: (n,) its joints' actuators.

    Raises:
        InputError: Network, card and robot do not fit one another.
    """

    def __init__(self, card: Card, file: Path, setup: Setup, drives: Sequence[int]):
        self._card, self.driven = card, np.array(drives, dtype=int)
        count, robot, action = len(card.joints), setup.robot, card.action
        self._every = _whole(1.0 / (card.rate * setup.tick), file, "rate", f"a whole part of {1.0 / setup.tick:g} Hz")
        self._first = _whole(card.start / setup.tick, file, "start", f"a whole number of ticks of {setup.tick:g} s")
        late = _whole(action.delay / setup.tick, file, "action.delay", f"a whole number of ticks of {setup.tick:g} s")
        self.places = np.array(robot.places, dtype=int)[self.driven]
        self.columns = np.array(robot.columns, dtype=int)[self.driven]
        self._default = np.array(per_joint(card.default, count))
        torque = action.kind == "torque"
        self.position = not torque
        offset = action.offset if action.offset is not None else (0.0 if torque else tuple(self._default.tolist()))
        self._scale, self._offset = np.array(per_joint(action.scale, count)), np.array(per_joint(offset, count))
        self.servo = None
        if action.servo == "law" and action.stiffness is not None and action.damping is not None:
            effort = np.array(per_joint(LARGEST if action.effort is None else action.effort, count))
            k, b = (np.array(per_joint(value, count)) for value in (action.stiffness, action.damping))
            self.servo = k, b, effort
        self._rest = np.zeros(len(robot.drives)) if self.servo or torque else setup.q[list(robot.places)].copy()
        self._hold = np.zeros(count) if torque else self._default
        self._targets = deque([self._command(self._hold)] * (late + 1), maxlen=late + 1)
        self.action, self.target, self.rate = np.zeros(count, dtype=np.float32), np.zeros(count), card.rate
        self.sizes: list[tuple[str, int]] = []
        self.applied, self.late = np.zeros(count), int(action.delay * card.rate + 1e-9)
        self.clock = None if card.clock is None else Phases(card.clock, 1.0 / card.rate)
        measures = [self._measure(term, robot) for term in card.observation]
        self._network = Network(file.parent / card.network)
        self._file, self._ticks, self.calls = file, 0, 0
        self.observed = np.zeros(0, dtype=np.float32)
        sizes = self._fits(setup, measures)
        self._shown = Shown(card.observation, measures, sizes, card.stacked == "call")

    def torques(self, sensed: Observation) -> np.ndarray:
        """(nu,) targets [rad] of the servos, or torques [N m]."""
        since = self._ticks - self._first
        if since >= 0 and since % self._every == 0:
            self._targets.append(self._command(self.ask(sensed)))
        elif len(self._targets) > 1:
            self._targets.append(self._targets[-1])
        self._ticks += 1
        if self.servo is None:
            return self._targets[0]
        k, b, effort = self.servo
        u = k * (self._targets[0][self.driven] - sensed.q[self.places]) - b * sensed.v[self.columns]
        out = np.zeros(len(self._rest))
        out[self.driven] = np.clip(u, -effort, effort)
        return out

    def hold(self, most: int) -> np.ndarray:
        """(k, nu) what its actuators are held to at this tick, and until the network's next call or the most ticks.

        Args:
            most: Ticks. `torques` has been called at this one, and is not called at the others.
        """
        since = self._ticks - 1 - self._first
        count = min(most, -since if since < 0 else self._every - since % self._every)
        out = np.empty((count, len(self._rest)))
        out[:] = self._targets[0]
        self._ticks += count - 1
        if len(self._targets) > 1:
            for row in out[1:]:
                self._targets.append(self._targets[-1])
                row[:] = self._targets[0]
        return out

    def _command(self, values: np.ndarray) -> np.ndarray:
        out = self._rest.copy()
        out[self.driven] = values
        return out

    def ask(self, sensed: Observation) -> np.ndarray:
        """(n,) targets [rad] or torques [N m] of the joints, in the network's order: a call of the network."""
        self.applied = self._targets[0][self.driven]
        if self.clock is not None:
            self.clock.begin(sensed.command)
        self.observed = self._shown.show(sensed)
        self.action = self._network.ask(self.observed)
        if self.clock is not None:
            self.clock.end()
        self.calls += 1
        clip = self._card.action.clip
        action = (self.action if clip is None else np.clip(self.action, *clip)).astype(float)
        self.target = self._offset + self._scale * action
        return self.target

    def action_of(self, target: np.ndarray) -> np.ndarray:
        """(…, n) what the network returned, of targets [rad] or torques [N m]."""
        scale = np.where(self._scale == 0.0, 1.0, self._scale)
        return (target - self._offset) / scale

    def _fits(self, setup: Setup, measures: Sequence[Measure]) -> list[int]:
        """Checks card, network and robot against one another, at the start of the run; returns the sizes of terms.

        Raises:
            InputError: They do not fit.
        """
        from biped.control.observation import Observation

        def fail(key: str, what: str) -> InputError:
            return InputError(f"{label(self._file)}: {key}: {what}", "law")

        data = mujoco.MjData(setup.model)
        data.qpos[:] = setup.q
        mujoco.mj_forward(setup.model, data)
        sensed, sizes = Observation(setup.model, data, setup.robot), []
        for i, (term, measure) in enumerate(zip(self._card.observation, measures, strict=True)):
            try:
                size = len(measure(sensed))
            except KeyError:
                there = [setup.model.site(j).name for j in range(setup.model.nsite)] + list(setup.robot.bodies)
                raise fail(f"observation[{i}].frame", f"the model has neither a site nor a body '{term.frame}'; "
                           f"{nearest(term.frame, there)}") from None  # fmt: skip
            for key, numbers in (("scale", term.scale), ("offset", term.offset)):
                if isinstance(numbers, tuple) and len(numbers) != size:
                    raise fail(f"observation[{i}].{key}", f"expected one number, or {size}, got {len(numbers)}")
            sizes.append(size)
            self.sizes.append((term.term, term.history * size))
        network, count, shown = self._network, len(self.driven), sum(size for _, size in self.sizes)
        if network.size not in (None, shown):
            terms = ", ".join(f"{term} {size}" for term, size in self.sizes)
            raise fail("observation", f"the network takes {network.size} numbers, the card shows {shown} ({terms})")
        if network.actions not in (None, count):
            raise fail("joints", f"the network returns {network.actions} numbers, the card names {count} joints")
        return sizes

    def _measure(self, term: Term, robot: Robot) -> Measure:
        """Returns the function that measures a term."""
        which = [self._card.joints.index(name) for name in term.joints] or slice(None)
        places, columns, default = self.places[which], self.columns[which], self._default[which]
        match term.term:
            case "joint_position":
                return lambda sensed: sensed.q[places] - default
            case "joint_velocity":
                return lambda sensed: sensed.v[columns]
            case "last_action":
                return lambda sensed: self.action
            case "command":
                return lambda sensed: sensed.command
            case "contact":
                feet = robot.of_foot
                return lambda sensed: np.array(
                    [sensed.touching[feet == i].any() for i in range(len(robot.feet))], float
                )
            case "clock_cos_sin" | "clock_sin_cos":
                assert self.clock is not None
                return partial(self.clock.read, term.term == "clock_cos_sin")
            case "linear_velocity" | "angular_velocity" | "gravity":
                return partial(in_frame, term.term, term.frame)
            case _:
                return partial(of_base, term.term)


def _whole(count: float, file: Path, key: str, expected: str) -> int:
    if abs(count - round(count)) > 1e-6 or (key == "rate" and round(count) < 1):
        raise InputError(f"{label(file)}: {key}: expected {expected}, at which the scenario asks its law", "law")
    return round(count)
