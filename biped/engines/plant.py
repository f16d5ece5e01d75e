"""Any robot in MuJoCo as a plant: its law ticks in Python, everything else between two calls of MuJoCo is compiled."""

from __future__ import annotations

import copy
import math
from collections.abc import Callable, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any

import mujoco
import numpy as np

from biped.base.jit import bound
from biped.control.blending import fraction
from biped.control.card import Networked
from biped.control.law import Commander, Setup, command_of, maker_of
from biped.control.observation import Observation
from biped.engines.actuators import Account, Latency, actuate
from biped.engines.forces import Contacts, GroundContacts, add_forces
from biped.engines.loop import GOING, LOW, Ending, fall_words, in_python, mujoco_warnings
from biped.engines.row import log_state, state_of
from biped.engines.uneven import PatchedContacts, Uneven, beginning, own
from biped.engines.untouched import Untouched
from biped.measure.trajectory import Trajectory
from biped.measure.verdict import unsolved
from biped.robot.columns import columns_of, width_of
from biped.robot.ground import frame, gravity3
from biped.robot.run import Run
from biped.robot.unmodelled import patches_of, torques_at, unmodelled_of
from biped.scenario.devices import COMMANDED, Sensors
from biped.scenario.general import SPLIT
from biped.scenario.keys import COMPILED
from biped.scenario.laws import THESIS, own_law
from biped.scenario.pushing import pieces

if TYPE_CHECKING:
    from biped.engines.held import HeldLoop
    from biped.engines.space import SpaceLoop
    from biped.engines.walking import WalkingLoop

Watch = Callable[[mujoco.MjModel, mujoco.MjData, np.ndarray], None]
"""Called after every tick with the model, its data, and the pushes that act, (bodies, 3) [N]."""


class MujocoPlant:
    """The plant of a run (`biped.engines.loop.Plant`).

    Args:
        run: The run.
        watch: Called after every tick.

    Attributes:
        compiled: The law's compiled loop, if it has one that suits the run.
    """

    def __init__(self, run: Run, watch: Watch | None = None):
        s = run.scenario
        self.run, self.s, self.watch = run, s, watch
        self.robot, self.profile = run.robot, run.profile
        self.bodies = self.robot.bodies
        make, name, file = maker_of(run)
        self.command = command_of(make, s, name)
        networked = isinstance(make, Networked)
        servos = make.servos(self.robot) if networked else None
        self.model = run.stepped_model(self.command, servos)
        python = own_law(s.law) and not networked
        if python:
            self.model = copy.copy(self.model)  # what a law does to it behind what it is given is for this run alone
        if not self.profile.level:
            self.model = own(self.model)
        self.data = mujoco.MjData(self.model)
        self.data.qpos[:], self.data.qvel[:] = run.q, run.v
        self.limits = np.array(run.torque_limits)
        size = self.model.nv if self.command == "generalized" else len(self.robot.drives)
        same = s == run.known_scenario and run.edit is None
        known = self.model if same else run.stepped_model(self.command, servos, known=True)
        # A network writes to no model, and to copy one with meshes takes as long as a second of walking.
        setup = Setup(s, run.gains, self.robot, known if networked else copy.copy(known), run.model, run.tick,
                      self.limits.copy(), run.q.copy(), run.v.copy(), run.seed)  # fmt: skip
        self.untouched = Untouched(self.model, self.data, self.profile.level) if python else None
        self.law = Commander(make, name, file, setup, size, run.ticks)
        self.columns = columns_of(self.robot)
        self.log, self.outside = np.zeros((run.ticks, width_of(self.robot))), np.zeros((run.ticks, 9))
        self._written = [slice(first, first + math.prod(shape)) if shape else first for first, shape in (
            self.columns[name] for name in ("force", "ground_force", "u", "work", "given"))]  # fmt: skip
        self.state = state_of(self.model, self.data, self.robot, self.columns, s.fall, self.profile)
        shared = self.state.touching, np.zeros_like(self.state.point)
        self.ground_force = shared[1]
        self.truth = self.observation = Observation(
            self.model, self.data, self.robot, self.profile, shared, self.state.point
        )
        self.sensors, self.senses = None, s.sensors != Sensors()
        if known is not self.model or self.senses:
            from biped.control.sensors import CoordinateSensors

            self.sensors = CoordinateSensors(run, copy.copy(known), self.robot, run.tick)
            self.observation = Observation(
                self.sensors.model, self.sensors.data, self.robot, self.profile, shared, compute=self.sensors.compute
            )
        late = s.actuation.delay > 0.0 or s.actuation.delay_jitter > 0.0
        self.latency = Latency(run) if late else None
        self.unmodelled = unmodelled_of(run)
        self.truth.command_at = self.observation.command_at = s.command
        self.uneven = None if self.profile.level else Uneven(self.model, self.data, self.profile)
        self.contacts = GroundContacts(
            self.model, self.data, self.robot, None if self.uneven is None else self.uneven.planes
        )
        self.patched = tuple(
            PatchedContacts(one, self.model, self.data, self.contacts.is_ground) for one in patches_of(run)
        )
        self.account = Account(self.model, self.data)
        self.split = s.simulation.integrator in SPLIT
        self.pushing, self._pushed = np.zeros((self.model.nbody - 1, 3)), ()
        self.wanted = np.zeros(self.law.size)
        self.compiled: Any = self._compiled()

    def _compiled(self) -> SpaceLoop | HeldLoop | WalkingLoop | None:
        """The compiled loop, where the law has one."""
        s = self.s
        if not self.split or self.uneven or self.watch or self.unmodelled or self.patched:
            return None
        if s.law != THESIS:
            from biped.engines.held import held_loop

            return None if self.sensors else held_loop(self)
        if s.actuation.assist > 0.0 or self.latency is not None:
            return None
        if self.sensors and self.law.law.source != COMPILED:
            return None  # another robot's mechanics, which MuJoCo computes at what is sensed
        from biped.engines.space import space_loop
        from biped.engines.walking import walking_loop

        return space_loop(self) or walking_loop(self)

    def turned(self, force: tuple[float, ...]) -> np.ndarray:
        """(3,) [N] of a push in the ground's frame."""
        ground = self.s.ground
        return frame(ground.slope, ground.side_slope) @ np.array(_in_space(force))

    def push(self, forces: np.ndarray) -> None:
        """Has forces (bodies, 3) [N] act."""
        self.pushing[:] = self.data.xfrc_applied[1:, :3] = forces
        self._pushed = tuple((np.flatnonzero(forces.any(axis=1)) + 1).tolist())
        self.account.push()

    def advance(self, first: int, last: int) -> tuple[int, int]:
        """Ticks first … last - 1; see `biped.engines.loop.Plant`."""
        if self.compiled is not None and self.compiled.takes(self.pushing):
            return self.compiled.advance(first, last)
        return self._ticks(first, last)

    @cached_property
    def _ticks(self) -> Callable[[int, int], tuple[int, int]]:
        """`advance` tick by tick, with kernels that are looked up once."""
        look, decide = self._look, self._deciding()

        def tick(k: int) -> int:
            if (status := look(k)) == GOING:
                decide(k)
            return status

        return in_python(tick, self._stepping())

    @cached_property
    def _touching(self) -> list[Contacts]:
        """The contacts of the step that is taken."""
        return [self.contacts.examples()[0]]

    @cached_property
    def _begin(self) -> Callable[[], None]:
        """Brings MuJoCo's data to the state that a step begins with."""
        return beginning(self.model, self.data, self.split, self.uneven, self.patched)

    def look(self, k: int) -> int:
        """Judges and logs a tick's state; returns its status."""
        return self._look(k)

    @cached_property
    def _look(self) -> Callable[[int], int]:
        """`look`, with kernels that are looked up once; it leaves the state's contacts in `_touching`."""
        touching = self._touching
        data, model, log, outside, state = self.data, self.model, self.log, self.outside, self.state
        contacts, tick, first_half, velocities = self.contacts, self.run.tick, self._begin, mujoco.mj_subtreeVel
        log_row = bound(log_state, state, contacts.examples()[0], log[0], outside[0], 0.0)

        def look(k: int) -> int:
            first_half()
            velocities(model, data)
            touching[0] = contacts.now()
            return log_row(state, touching[0], log[k], outside[k], k * tick)

        return look

    def actuators(self) -> tuple[float, np.ndarray, float]:
        """Factor of torques, bounds of commands (n,), and the fraction of the way that actuators go in a tick."""
        strength = self.s.truth.strength if self.command == "torque" else 1.0
        limits = strength * self.limits if self.command == "torque" else np.full(self.law.size, np.inf)
        return strength, limits, fraction(self.s.actuation.lag, self.run.tick)

    def _deciding(self) -> Callable[[int], None]:
        """Has the law decide at a tick whose state has been judged."""
        data, law, observation, sensors, tick = self.data, self.law, self.observation, self.sensors, self.run.tick
        wanted, target = self.wanted, data.qfrc_applied if self.command == "generalized" else data.ctrl
        (strength, limits, follow), latency, untouched = self.actuators(), self.latency, self.untouched
        unmodelled, places, columns = self.unmodelled, self.robot.places, self.robot.columns
        act = bound(actuate, wanted, limits, follow, wanted, target)

        def decide(k: int) -> None:
            time = k * tick
            if sensors is not None:
                sensors.measure(data.qpos, data.qvel)
            observation.begin(time)
            watched = untouched if untouched is not None and untouched.before(k) else None
            command = law.command(k, observation)
            if watched is not None:
                watched.after()
            if latency is not None and np.isfinite(command).all():
                command = latency.pass_on(k, command)
            if strength != 1.0:
                command = strength * command
            if not act(command, limits, follow, wanted, target):
                law.refuse(k, time, command)
            for made in unmodelled:
                torques_at(made, data.qpos[places], data.qvel[columns])
                data.qfrc_applied[columns] = made.added

        return decide

    def _stepping(self) -> Callable[[int], None]:
        """Steps the physics to the next tick, and logs its forces and works."""
        touching = self._touching
        data, model, state, account, contacts = self.data, self.model, self.state, self.account, self.contacts
        watch, pushing, substeps, split = self.watch, self.pushing, self.run.substeps, self.split
        generalized, first_half = self.command == "generalized", self._begin
        example, solved = contacts.examples()
        forces, total, torque = np.zeros_like(state.point), np.zeros(6), np.zeros(len(self.robot.drives))
        outside, com, acting = self.outside, data.subtree_com[self.robot.base_number], np.zeros(6)
        target = data.qfrc_applied if generalized else data.ctrl
        work, local, pyramidal = np.zeros((len(forces) + 2, 3)), np.zeros(6), contacts.pyramidal
        spare = work, local
        add = bound(add_forces, state.point, state.foot, example, solved, pyramidal, com, *spare, forces, total)
        second_half = mujoco.mj_step2 if split else mujoco.mj_step

        def step(k: int) -> None:
            account.begin()
            forces[:], total[:], torque[:], acting[:] = 0.0, 0.0, 0.0, 0.0
            for substep in range(substeps):
                if substep:
                    first_half()
                    touching[0] = contacts.now()
                account.before()
                second_half(model, data)
                account.after()
                if not split:  # the contacts are those of the last of its stages
                    touching[0] = contacts.now()
                add(state.point, state.foot, touching[0], contacts.solved(), pyramidal, com, work, local, forces, total)
                self._declare(target, acting)
                if not generalized:
                    np.add(torque, data.actuator_force, torque)
            self.log_step(k, forces, total[:3], torque, (account.work, account.given))
            outside[k, 3:] = (total + acting) / substeps
            if watch is not None:
                watch(model, data, pushing)

        return step

    def log_step(
        self, k: int, forces: np.ndarray, total: np.ndarray, torque: np.ndarray, work: tuple[float, float]
    ) -> None:
        """Writes what acted in the steps of a tick into its row.

        Args:
            k: Number of the tick.
            forces: (P, 3) [N] of the ground on the contact points, summed over the steps.
            total: (3,) [N] of the ground on the whole robot, likewise.
            torque: (nu,) [N m] of the actuators at their joints, likewise.
            work: [J] of everything but gravity and springs, and of actuators and pushes alone.
        """
        row, share = self.log[k], 1.0 / self.run.substeps
        force, whole, u, done, given = self._written
        np.multiply(forces, share, self.ground_force)
        row[force] = self.ground_force.ravel()
        row[whole], row[u] = total * share, torque * share
        row[done], row[given] = work

    def _declare(self, target: np.ndarray, out: np.ndarray) -> None:
        """Adds force and moment about the centre of mass (6,) of what a scenario says acts from outside in a step.

        Args:
            target: (nv,) generalized forces, where the law commands them.
            out: (6,) [N, N m].
        """
        data, base = self.data, self.robot.base_number
        com = data.subtree_com[base]
        for body in self._pushed:
            force = self.pushing[body - 1]
            out[:3] += force
            out[3:] += np.cross(data.xipos[body] - com, force)
        if self.s.law == THESIS and self.command == "generalized":
            columns = list(self.robot.base_columns)
            # Moment and force about the centre of mass that do the same along the base's coordinates, and no more.
            wrench = np.linalg.lstsq(data.cdof[columns], target[columns], rcond=None)[0]
            out[:3] += wrench[3:]
            out[3:] += wrench[:3]

    def fall(self, status: int, row: int) -> str:
        """How the base fell at a row of the log."""
        mujoco.mj_subtreeVel(self.model, self.data)
        base = self.robot.base_number
        axis = self.data.xmat[base].reshape(3, 3) @ self.robot.upright
        return fall_words(self.data.subtree_linvel[base] if status == LOW else axis, row * self.run.tick)

    def velocities(self, row: int) -> tuple[Sequence[str], np.ndarray]:
        """Names and values of the velocities in a row of the log."""
        first, _ = self.columns["v"]
        return self.robot.v_names, self.log[row, first : first + self.model.nv]

    def warnings(self) -> dict[str, int]:
        """How often MuJoCo warned of what."""
        return mujoco_warnings(self.data)

    def trajectory(self, rows: int, ending: Ending) -> Trajectory:
        """The trajectory of so many rows."""
        s, signals, log = self.s, self.law.signals, self.log[:rows]
        names, parts = signals.names, [log, signals.values[:rows]] if signals.names else [log]
        if s.command is not None:
            names = (*names, *COMMANDED)
            parts.append(s.command.over(np.arange(rows) * self.run.tick))
        return Trajectory(
            log=np.hstack(parts) if names else log,
            tick=self.run.tick,
            slope=s.ground.slope,
            side_slope=s.ground.side_slope,
            gravity=tuple(gravity3(s.ground.slope, s.ground.side_slope).tolist()),
            generalized=self.command == "generalized",
            torque_limit=tuple(self.limits.tolist()),
            pushes=tuple((p.start, p.end, *_in_space(p.force), p.body) for p in pieces(s)),
            end=ending.end,
            cause=ending.cause,
            warnings=ending.warnings
            | unsolved(signals.unsolved(rows))
            | ({} if self.untouched is None else self.untouched.found()),
            robot=self.run.true_robot,
            outside=self.outside[:rows],
            ground=self.profile,
            changes=tuple(change.at for change in s.change),
            sampled=not self.split,
            signal_names=names,
            traceback=ending.traceback,
        )


def _in_space(force: tuple[float, ...]) -> tuple[float, float, float]:
    """(3,) [N] forward, to the left and up, of a push in the plane or in space."""
    return (force[0], 0.0, force[1]) if len(force) == 2 else (force[0], force[1], force[2])
