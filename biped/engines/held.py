"""Stretches of a run in which a law holds what it commands: nothing but compiled code between two calls of a network.

The same digits as tick by tick in Python (`biped.engines.plant`), whose kernels are called here too.
"""

from collections.abc import Callable
from typing import NamedTuple, Protocol

import mujoco
import numpy as np

from biped.base.address import call, doubles_at, int32_at, int32_rows_at, rows_at
from biped.base.jit import bound, inner_kernel, long_kernel
from biped.control.card import Walker
from biped.control.law import Commander
from biped.control.observation import Observation
from biped.engines.actuators import Account, Latency, actuate
from biped.engines.forces import Contacts, GroundContacts, Solved, add_forces
from biped.engines.loop import GOING, RAISED
from biped.engines.native import ContactLayout, contact_layout, halves
from biped.engines.row import FORCE, GROUND_FORCE, State, U, log_state
from biped.robot.robot import Robot
from biped.robot.run import Run

MOST_STEPS = 500
"""Physics steps of which work is added up at a time; of each a few rows are kept."""


class HeldPlant(NamedTuple):
    """MuJoCo, what actuators are held to, and what a tick leaves behind, as compiled code takes them.

    Attributes:
        step1: Address of mj_step1.
        step2: Address of mj_step2.
        velocities: Address of mj_subtreeVel.
        model: Address of the model.
        data: Address of the data.
        nefc: Address of the number of constraint rows.
        force: Address of the address of their forces.
        count: Address of the number of contacts.
        contacts: Address of their address.
        layout: Of a contact.
        substeps: Steps in a tick.
        half: [s] of a step.
        tick: [s].
        pyramidal: Whether friction cones are pyramids.
        strength: Factor of torques.
        follow: Fraction of the way that actuators go in a tick.
        limits: (nu,) [N m] bounds of torques; inf of targets.
        servo: (3, n) stiffness, damping and effort of servos that the law computes; n = 0: none.
        driven: (n,) their actuators.
        places: (n,) where their joints stand in q.
        columns: (n,) where these stand in v.
        state: What is judged and logged, live.
        is_ground: (ngeom,) whether a geom is ground.
        foot: (ngeom,) number of the foot that a geom belongs to, -1 if none.
        driving: (nv,) what actuators do, live.
        applied: (nv,) what is applied to coordinates, live.
        holding: (nv,) what contacts and stops do, live.
        damping: (nv,) [N m s/rad] of the joints.
        acted: (nu,) [N m] of the actuators, live.
        target: (nu,) what MuJoCo takes commands from, live.
        wanted: (nu,) where lagging actuators are.
        ground_force: (P, 3) [N] on the contact points in the latest tick.
        com: (3,) [m] centre of mass of the robot, live.
        command: (nu,) latest command, work.
        before: (nv,) work.
        torque: (nu,) work.
        forces: (P, 3) work.
        total: (6,) work.
        work: (P + 2, 3) work.
        local: (6,) work.
    """

    step1: int
    step2: int
    velocities: int
    model: int
    data: int
    nefc: int
    force: int
    count: int
    contacts: int
    layout: ContactLayout
    substeps: int
    half: float
    tick: float
    pyramidal: bool
    strength: float
    follow: float
    limits: np.ndarray
    servo: np.ndarray
    driven: np.ndarray
    places: np.ndarray
    columns: np.ndarray
    state: State
    is_ground: np.ndarray
    foot: np.ndarray
    driving: np.ndarray
    applied: np.ndarray
    holding: np.ndarray
    damping: np.ndarray
    acted: np.ndarray
    target: np.ndarray
    wanted: np.ndarray
    ground_force: np.ndarray
    com: np.ndarray
    command: np.ndarray
    before: np.ndarray
    torque: np.ndarray
    forces: np.ndarray
    total: np.ndarray
    work: np.ndarray
    local: np.ndarray


class Stepped(Protocol):
    """A plant whose run is stepped (`biped.engines.plant.MujocoPlant`)."""

    run: Run
    law: Commander
    model: mujoco.MjModel
    data: mujoco.MjData
    robot: Robot
    state: State
    contacts: GroundContacts
    account: Account
    latency: Latency | None
    observation: Observation
    columns: dict[str, tuple[int, tuple[int, ...]]]
    log: np.ndarray
    outside: np.ndarray
    wanted: np.ndarray
    ground_force: np.ndarray

    def actuators(self) -> tuple[float, np.ndarray, float]:
        """Factor of torques, bounds of commands (n,), and the fraction of the way that actuators go in a tick."""
        ...


class HeldLoop:
    """The loop of a run whose law holds its commands.

    Args:
        plant: Of the run.
        look: Judges and logs the state of a tick; returns its status.
        held: What compiled code takes.
    """

    def __init__(self, plant: Stepped, look: Callable[[int], int], held: HeldPlant):
        self._plant, self._look, self._held = plant, look, held
        self._most = max(1, MOST_STEPS // held.substeps)
        self._rows = np.zeros((3, self._most, held.substeps, plant.model.nv))
        targets = np.zeros((1, plant.law.size))
        self._walk = bound(stretch, held, plant.log, plant.outside, targets, self._rows, 0, 0, 0, 0)
        self._work, self._given = (plant.columns[name][0] for name in ("work", "given"))

    def advance(self, first: int, last: int) -> tuple[int, int]:
        """Ticks first … last - 1; see `biped.engines.loop.Plant`."""
        plant, tick, noted, k = self._plant, self._held.tick, first, first
        if (status := self._look(k)) != GOING:
            return status, k + 1
        try:
            while k < last:
                plant.observation.begin(k * tick)
                plant.law.command(k, plant.observation)
                targets = self._delayed(k, plant.law.law.hold(min(last - k, self._most)))
                until = k + len(targets)
                if until - noted > self._most:
                    self._add_up(noted, k)
                    noted = k
                status, rows = self._walk(self._held, plant.log, plant.outside, targets, self._rows, k, until, last,
                                          k - noted)  # fmt: skip
                k = until if status == GOING else rows - 1
                if status == RAISED:
                    plant.law.refuse(k, k * tick, self._held.command)
                if status != GOING:
                    return status, rows
        finally:
            self._add_up(noted, k)
        return GOING, last

    def _add_up(self, first: int, last: int) -> None:
        """Logs the works of ticks first … last - 1, which are noted from the first row on."""
        log, (step, force, rest) = self._plant.log[first:last], self._rows[:, : last - first]
        log[:, self._work], log[:, self._given] = self._plant.account.of_steps(step, force, rest)

    def _delayed(self, k: int, targets: np.ndarray) -> np.ndarray:
        """Targets from tick k on, as late as the run's actuators are."""
        latency = self._plant.latency
        if latency is not None:
            for i, row in enumerate(targets):
                if not np.isfinite(row).all():
                    break  # which is refused
                row[:] = latency.pass_on(k + i, row)
        return targets


def held_plant(plant: Stepped) -> HeldPlant | None:
    """A run as compiled code takes it, or None where it must be stepped from Python.

    Args:
        plant: Of the run.
    """
    law, model, data, state, account = plant.law.law, plant.model, plant.data, plant.state, plant.account
    if not isinstance(law, Walker) or plant.law.signals.names or account.other:
        return None
    if plant.latency is not None and law.servo is not None:
        return None
    native, layout = halves(model), contact_layout(model, plant.run.q)
    if native is None or layout is None:
        return None
    strength, limits, follow = plant.actuators()
    size, points, address = plant.law.size, len(state.point), data._address
    return HeldPlant(
        step1=native.step1, step2=native.step2, velocities=native.velocities, model=model._address, data=address,
        nefc=address + native.nefc, force=address + native.force, count=address + native.count,
        contacts=address + native.contacts, layout=layout, substeps=plant.run.substeps, half=account.half,
        tick=plant.run.tick, pyramidal=plant.contacts.pyramidal, strength=strength, follow=follow, limits=limits,
        servo=np.zeros((3, 0)) if law.servo is None else np.array(law.servo), driven=law.driven, places=law.places,
        columns=law.columns, state=state, is_ground=plant.contacts.is_ground, foot=plant.contacts.foot,
        driving=data.qfrc_actuator, applied=data.qfrc_applied, holding=data.qfrc_constraint, damping=account.damping,
        acted=data.actuator_force, target=data.ctrl, wanted=plant.wanted, ground_force=plant.ground_force,
        com=data.subtree_com[plant.robot.base_number], command=np.zeros(size), before=np.zeros(model.nv),
        torque=np.zeros(len(plant.robot.drives)), forces=np.zeros((points, 3)), total=np.zeros(6),
        work=np.zeros((points + 2, 3)), local=np.zeros(6),
    )  # fmt: skip


@inner_kernel
def _contacts(p):
    """MuJoCo's contacts, as `biped.engines.forces.GroundContacts.now` returns them, and their numbers."""
    at, count = p.layout, int32_at(p.count)
    real, whole = rows_at(p.contacts, count, at.doubles), int32_rows_at(p.contacts, count, 2 * at.doubles)
    found = Contacts(whole[:, at.geoms : at.geoms + 2], real[:, at.place : at.place + 3], real[:, 0],
                     real[:, at.margin], p.is_ground, p.foot)  # fmt: skip
    return found, real, whole


@inner_kernel
def _decide(p, target):
    """Writes the command (nu,) of a tick: what is held, or torques of the law's own servos towards it."""
    command, v, q = p.command, p.state.v, p.state.q
    for j in range(command.size):
        command[j] = 0.0 if p.servo.shape[1] else target[j]
    for i in range(p.servo.shape[1]):
        j, most = p.driven[i], p.servo[2, i]
        u = p.servo[0, i] * (target[j] - q[p.places[i]]) - p.servo[1, i] * v[p.columns[i]]
        if u < -most:
            u = -most
        elif u > most:
            u = most
        command[j] = u
    for j in range(command.size):
        command[j] *= p.strength


@inner_kernel
def _step(p, step, force, rest):
    """Takes one step, whose first half is done; adds what the ground and the actuators do, and notes what does work."""
    v, at = p.state.v, p.layout
    for j in range(v.size):
        p.before[j] = v[j]
    call(p.step2, p.model, p.data)
    for j in range(v.size):
        step[j] = (p.before[j] + v[j]) * p.half
        force[j] = p.driving[j] + p.applied[j]
        rest[j] = p.holding[j] - p.damping[j] * v[j]
    contacts, real, whole = _contacts(p)
    solved = Solved(doubles_at(p.force, int32_at(p.nefc)), whole[:, at.row], whole[:, at.size],
                    real[:, at.frame : at.frame + 9], real[:, at.friction : at.friction + 5])  # fmt: skip
    add_forces(p.state.point, p.state.foot, contacts, solved, p.pyramidal, p.com, p.work, p.local, p.forces, p.total)
    for j in range(p.torque.size):
        p.torque[j] += p.acted[j]


@inner_kernel
def _log_step(p, line, outside):
    """Writes what acted in the steps of a tick into its row."""
    at, share = p.state.columns, 1.0 / p.substeps
    for i in range(p.forces.shape[0]):
        for j in range(3):
            p.ground_force[i, j] = p.forces[i, j] * share
            line[at[FORCE] + 3 * i + j] = p.ground_force[i, j]
    for j in range(3):
        line[at[GROUND_FORCE] + j] = p.total[j] * share
    for j in range(p.torque.size):
        line[at[U] + j] = p.torque[j] * share
    for j in range(6):
        outside[3 + j] = (p.total[j] + 0.0) / p.substeps


@long_kernel
def stretch(p, log, outside, targets, rows, first, last, end, noted):
    """Ticks first … last - 1 of a run, of which the first has been judged and logged; and so is the next one.

    Args:
        p: `HeldPlant`.
        log: (n, width) of `biped.robot.columns`; works are left out.
        outside: (n, 9) of `Trajectory.outside`.
        targets: (last - first, nu) what actuators are held to, tick by tick.
        rows: (3, n, substeps, nv), overwritten by what works are made of (`biped.engines.actuators.Account.of_steps`).
        first: First tick.
        last: One past the last.
        end: The tick that is neither judged nor logged any more, nor any beyond.
        noted: Number of ticks that are noted in `rows`.

    Returns:
        The last tick's status (`biped.engines.loop`), and the number of rows in the log where that is not GOING;
        RAISED: what `p.command` holds is not finite, in the last of these rows.
    """
    for k in range(first, last):
        _decide(p, targets[k - first])
        if not actuate(p.command, p.limits, p.follow, p.wanted, p.target):
            return RAISED, k + 1
        p.forces[:] = 0.0
        p.total[:] = 0.0
        p.torque[:] = 0.0
        for i in range(p.substeps):
            if i:
                call(p.step1, p.model, p.data)
            row = noted + k - first
            _step(p, rows[0, row, i], rows[1, row, i], rows[2, row, i])
        _log_step(p, log[k], outside[k])
        if k + 1 < end:
            call(p.step1, p.model, p.data)
            call(p.velocities, p.model, p.data)
            contacts, _, _ = _contacts(p)
            status = log_state(p.state, contacts, log[k + 1], outside[k + 1], (k + 1) * p.tick)
            if status != GOING:
                return status, k + 2
    return GOING, last
