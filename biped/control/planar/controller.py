"""The law of a run: the thesis's, compiled and refereed by Pinocchio, or a user's own (`biped.control.planar.user`)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import lru_cache, partial
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

import numpy as np

from biped.base.files import description_of
from biped.base.jit import bound, entry_kernel
from biped.base.kernels import agreed
from biped.control.law import NO_SIGNALS, Signals
from biped.control.planar import setup
from biped.control.planar.allocation import FOREIGN, foreign_torques
from biped.control.planar.sensing import sense_links
from biped.control.planar.setup import bring_up_to_date, changes_of, controller_record
from biped.control.planar.tick import NOT_FINITE, log_tick, pushing_tick, pushing_tick_in, thesis_tick, thesis_tick_in
from biped.robot.planar.kinematics import mass_matrix
from biped.robot.planar.topology import LINK_DOF, N_LINKS, NQ, X, Z
from biped.robot.planar.tree import Tree
from biped.robot.robot import seven_links
from biped.robot.run import Run
from biped.scenario.keys import PINOCCHIO

if TYPE_CHECKING:
    import pinocchio

CONFIGURATIONS = 5
"""Random ones at which both have to agree."""
SAME = 1e-12
"""How well, relative to the largest number."""


@dataclass(frozen=True)
class _Question:
    """The question of a run's model file, in one version, and a tree."""

    path: Path
    modified: float
    parts: tuple[tuple[bytes, tuple[int, ...]], ...]
    run: Run = field(compare=False)
    tree: Tree = field(compare=False)


def agrees(run: Run, tree: Tree) -> bool:
    """Whether M and joint positions of the tree are Pinocchio's, at a few random configurations of a run's model."""
    parts = tuple((part.tobytes(), part.shape) for part in tree)
    return _agrees(_Question(run.model, run.model.stat().st_mtime, parts, run, tree))


@lru_cache(maxsize=8)
def _agrees(question: _Question) -> bool:
    files = question.path.read_bytes() + description_of(question.path).read_bytes()
    known = repr(question.parts).encode() + files
    return agreed(known, lambda: _refereed(question.run.believed_model, question.tree))


def _refereed(model: pinocchio.Model, tree: Tree) -> bool:
    import pinocchio

    c = setup.new()
    for name, part in tree._asdict().items():
        c[0]["tree"][name] = part
    data, M, joint = model.createData(), np.zeros((NQ, NQ)), c[0]["at"]["joint"]
    for q in np.random.default_rng(0).normal(size=(CONFIGURATIONS, NQ)):
        pinocchio.crba(model, data, q, pinocchio.Convention.WORLD)
        _matrices(c, q, np.zeros(NQ), M)
        hinges = data.J[:, LINK_DOF : LINK_DOF + N_LINKS]
        theirs = np.column_stack([-hinges[2] - q[X], hinges[0] - q[Z]])
        for own, other in ((M, np.triu(data.M)), (joint, theirs)):
            if not np.abs(own - other).max() <= SAME * np.abs(other).max():
                return False
    return True


@entry_kernel
def _matrices(record, q, v, M):
    c = record[0]
    sense_links(c, q, v)
    mass_matrix(c["tree"], c["at"], M)


Tick = Callable[[int, float], int]


class PlanarLaw(Protocol):
    """The protocol of a control law in an engine.

    A law is bound to the measured coordinates of one run and ticks through it; what it wants is left in `u` and `Q_d`.

    Attributes:
        u: (6,) joint torques of the latest tick [N m].
        Q_d: (9,) desired generalized forces of the latest tick.
        record: (1,) `biped.control.planar.setup.CONTROL`, which senses contacts and says what a fall is.
        signals: What it logs of its own.
    """

    u: np.ndarray
    Q_d: np.ndarray
    record: np.ndarray
    signals: Signals

    @property
    def tick(self) -> Tick:
        """One control tick (k, time [s]) from bound measurements; returns a status of `biped.control.planar.tick`."""
        ...


class ThesisLaw:
    """Braun & Goldfarb's law: one compiled tick.

    M, bias forces and Jacobians are the planar tree's where Pinocchio, which reads the model file by itself, finds the
    same numbers; otherwise, or where `control.mechanics` asks for it, they are Pinocchio's, tick by tick.

    Args:
        run: Scenario, gains and draws.
        believed: Lengths and masses the controller believes in.
        q: (9,) measured joint coordinates, live.
        v: (9,) measured joint velocities, live.
        log: (n, WIDTH) log that ticks write.

    Attributes:
        u: (6,) joint torques of the latest tick [N m].
        Q_d: (9,) desired generalized forces of the latest tick.
        record: (1,) `biped.control.planar.setup.CONTROL`.
        changes: `biped.control.blending.Changes`.
        python: Why the tick cannot be part of a compiled loop (`biped.control.planar.loop`); empty if it can.
    """

    signals = NO_SIGNALS

    def __init__(self, run: Run, believed: Tree, q: np.ndarray, v: np.ndarray, log: np.ndarray):
        self.record = controller_record(run, believed)
        self.changes = changes_of(run, self.record)
        self.c = self.record[0]
        self.u, self.Q_d = self.c["tick"]["u"], self.c["tick"]["Q_d"]
        self._own = not _by_pinocchio(run, believed)
        self.python = python_needed(run, believed)
        self._bind = run, q, v, log

    @property
    def tick(self) -> Tick:
        """A closure, made anew at every asking: to look up the run's arrays would cost as much as the leg states do."""
        run, q, v, log = self._bind
        record, changes = self.record, self.changes
        if self._own:
            M, one = self.c["work"]["M"], pushing_tick if self.c["push"]["on"] else thesis_tick
            inner = partial(bound(one, record, q, v, log, 0, 0.0), record, q, v, log)
        else:
            M, inner = _from_pinocchio(run, record, q, v, log)
        if self.c["actuation"]["bounded"] == FOREIGN:
            inner = partial(self._bounded_tick, inner, M, run.scenario.actuation.solver, q, v, log)
        if not len(changes.steps):
            return inner
        update = bound(bring_up_to_date, record, changes, 0)

        def tick(k: int, time: float) -> int:
            update(record, changes, k)
            return inner(k, time)

        return tick

    def _bounded_tick(
        self, tick: Tick, M: np.ndarray, solver: str, q: np.ndarray, v: np.ndarray, log: np.ndarray, k: int, time: float
    ) -> int:
        """A tick that has another solver solve the bounded problem where a torque limit is exceeded."""
        status = tick(k, time)
        if self.c["tick"]["over"] and status != NOT_FINITE:
            self.u[:] = foreign_torques(self.record, M, solver)
            log_tick(self.record, q, v, log, k, time)
        return status


def _from_pinocchio(
    run: Run, record: np.ndarray, q: np.ndarray, v: np.ndarray, log: np.ndarray
) -> tuple[np.ndarray, Tick]:
    """Pinocchio's M, live, and the tick that has it computed with all else."""
    import pinocchio

    model = run.believed_model
    data, crba, world = model.createData(), pinocchio.crba, pinocchio.Convention.WORLD
    bias_forces, kinematics = pinocchio.nonLinearEffects, pinocchio.forwardKinematics
    acceleration, along_world = pinocchio.getFrameClassicalAcceleration, pinocchio.LOCAL_WORLD_ALIGNED
    points = [model.getFrameId(name) for name in seven_links(run.robot).points]
    M, still, bias = data.M, np.zeros(model.nv), np.zeros((len(points), 3))
    found = M, data.nle, data.J, bias
    one = pushing_tick_in if record[0]["push"]["on"] else thesis_tick_in
    kernel = bound(one, record, *found, q, v, log, 0, 0.0)

    def tick(k: int, time: float) -> int:
        bias_forces(model, data, q, v)
        crba(model, data, q, world)  # fills M (upper triangle) and J
        kinematics(model, data, q, v, still)
        for i, point in enumerate(points):
            bias[i] = acceleration(model, data, point, along_world).linear
        return kernel(record, *found, q, v, log, k, time)

    return M, tick


def python_needed(run: Run, believed: Tree) -> str:
    """Why a run's law cannot be part of a compiled loop; empty if it can."""
    actuation = run.scenario.actuation
    if run.scenario.law is not None:
        return "a law of the user's own"
    if actuation.limit == "bounded" and actuation.solver != "active_set":
        return f"bounded torques by {actuation.solver}"
    if run.scenario.control.mechanics == PINOCCHIO:
        return "the mechanics are Pinocchio's"
    return "" if agrees(run, believed) else "Pinocchio finds another mass matrix than the planar tree"


def _by_pinocchio(run: Run, believed: Tree) -> bool:
    return run.scenario.control.mechanics == PINOCCHIO or not agrees(run, believed)


def law_of(run: Run, believed: Tree, q: np.ndarray, v: np.ndarray, log: np.ndarray) -> PlanarLaw:
    """The control law of a run, bound to its measurements and its log."""
    if run.scenario.law is None and run.law is None:
        return ThesisLaw(run, believed, q, v, log)
    from biped.control.planar.user import UserLaw

    return UserLaw(run, believed, q, v, log)
