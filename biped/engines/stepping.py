"""A robot in MuJoCo as compiled code steps it, whatever its feet are: steps, forces and works of a tick, and its row.

The same digits as tick by tick in Python (`biped.engines.plant`), whose kernels are called here too.
"""

from typing import NamedTuple, Protocol

import mujoco
import numpy as np

from biped.base.address import call, doubles_at, int32_at, int32_rows_at, rows_at
from biped.base.jit import inner_kernel
from biped.control.law import Commander
from biped.control.observation import Observation
from biped.control.sensors import CoordinateSensors
from biped.engines.actuators import Account, Latency, actuate
from biped.engines.forces import Contacts, GroundContacts, Solved, add_forces
from biped.engines.native import ContactLayout, contact_layout, halves
from biped.engines.row import FORCE, GROUND_FORCE, State, U, log_state
from biped.robot.robot import Robot
from biped.robot.run import Run

MOST_STEPS = 500
"""Stepping steps of which work is added up at a time; of each a few rows are kept."""


class Stepping(NamedTuple):
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
    count: int  # pyright: ignore[reportIncompatibleMethodOverride]
    contacts: int
    layout: ContactLayout
    substeps: int
    half: float
    tick: float
    pyramidal: bool
    strength: float
    follow: float
    limits: np.ndarray
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
    sensors: CoordinateSensors | None
    senses: bool
    observation: Observation
    columns: dict[str, tuple[int, tuple[int, ...]]]
    log: np.ndarray
    outside: np.ndarray
    wanted: np.ndarray
    ground_force: np.ndarray

    def look(self, k: int) -> int:
        """Judges and logs a tick's state; returns its status."""
        ...

    def actuators(self) -> tuple[float, np.ndarray, float]:
        """Factor of torques, bounds of commands (n,), and the fraction of the way that actuators go in a tick."""
        ...


def stepping_of(plant: Stepped) -> Stepping | None:
    """A run as compiled code steps it, or None where it must be stepped from Python.

    Args:
        plant: Of the run.
    """
    model, data, state, account = plant.model, plant.data, plant.state, plant.account
    if account.other:
        return None
    native, layout = halves(model), contact_layout(model, plant.run.q)
    if native is None or layout is None:
        return None
    strength, limits, follow = plant.actuators()
    size, points, address = plant.law.size, len(state.point), data._address
    return Stepping(
        step1=native.step1, step2=native.step2, velocities=native.velocities, model=model._address, data=address,
        nefc=address + native.nefc, force=address + native.force, count=address + native.count,
        contacts=address + native.contacts, layout=layout, substeps=plant.run.substeps, half=account.half,
        tick=plant.run.tick, pyramidal=plant.contacts.pyramidal, strength=strength, follow=follow, limits=limits,
        state=state, is_ground=plant.contacts.is_ground, foot=plant.contacts.foot,
        driving=data.qfrc_actuator, applied=data.qfrc_applied, holding=data.qfrc_constraint, damping=account.damping,
        acted=data.actuator_force, target=data.ctrl, wanted=plant.wanted, ground_force=plant.ground_force,
        com=data.subtree_com[plant.robot.base_number], command=np.zeros(size), before=np.zeros(model.nv),
        torque=np.zeros(len(plant.robot.drives)), forces=np.zeros((points, 3)), total=np.zeros(6),
        work=np.zeros((points + 2, 3)), local=np.zeros(6),
    )  # fmt: skip


class Works:
    """Works of a run's ticks, which compiled code only notes the factors of: numpy adds them up in its own digits.

    Args:
        plant: Of the run.

    Attributes:
        rows: (3, ticks, substeps, nv) of `Account.of_steps`, overwritten.
        most: Ticks that they have room for.
    """

    def __init__(self, plant: Stepped):
        substeps = plant.run.substeps
        self._plant, self.most = plant, max(1, MOST_STEPS // substeps)
        self.rows = np.zeros((3, self.most, substeps, plant.model.nv))
        self._work, self._given = (plant.columns[name][0] for name in ("work", "given"))

    def add_up(self, first: int, last: int) -> None:
        """Logs the works of ticks first … last - 1, which are noted from the first row on."""
        log, (step, force, rest) = self._plant.log[first:last], self.rows[:, : last - first]
        log[:, self._work], log[:, self._given] = self._plant.account.of_steps(step, force, rest)


@inner_kernel
def _contacts(p):
    """MuJoCo's contacts, as `biped.engines.forces.GroundContacts.now` returns them, and their numbers."""
    at, count = p.layout, int32_at(p.count)
    real, whole = rows_at(p.contacts, count, at.doubles), int32_rows_at(p.contacts, count, 2 * at.doubles)
    found = Contacts(whole[:, at.geoms : at.geoms + 2], real[:, at.place : at.place + 3], real[:, 0],
                     real[:, at.margin], p.is_ground, p.foot)  # fmt: skip
    return found, real, whole


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


@inner_kernel
def judge(p, line, outside, time):
    """Judges the state that the first half of a step has left, and writes it into its row; returns its status."""
    call(p.velocities, p.model, p.data)
    contacts, _, _ = _contacts(p)
    return log_state(p.state, contacts, line, outside, time)


@inner_kernel
def take_tick(p, rows, row, line, outside):
    """Has actuators act on `p.command` and takes the steps of a tick, of which the first half of the first is done.

    Args:
        p: `Stepping`.
        rows: Of `Works`.
        row: Which of them is the tick's.
        line: Of the tick in the log; works are left out.
        outside: Of the tick in `Trajectory.outside`.

    Returns:
        Whether the command was finite; if not, nothing is done.
    """
    for j in range(p.command.size):
        p.command[j] *= p.strength
    if not actuate(p.command, p.limits, p.follow, p.wanted, p.target):
        return False
    p.forces[:] = 0.0
    p.total[:] = 0.0
    p.torque[:] = 0.0
    for i in range(p.substeps):
        if i:
            call(p.step1, p.model, p.data)
        _step(p, rows[0, row, i], rows[1, row, i], rows[2, row, i])
    _log_step(p, line, outside)
    return True
