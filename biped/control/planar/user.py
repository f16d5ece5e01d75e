"""A control law of the user's own on seven links: its setup and its observation, in the thesis's coordinates."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pinocchio

from biped.base.jit import kernel
from biped.control.law import Commander, maker_of
from biped.control.planar.constraints import candidates
from biped.control.planar.setup import controller_record
from biped.control.planar.tick import NOT_FINITE, desired_forces, log_tick, sense_in
from biped.robot.leg_states import STATES
from biped.robot.planar.kinematics import point_row
from biped.robot.planar.topology import KNEE, N_POINTS, N_ROWS, N_STOPS, NQ, NU, STOP_ROW, TOE, UPRIGHT
from biped.robot.planar.tree import Tree
from biped.robot.robot import Robot
from biped.robot.run import Run
from biped.scenario.gains import Gains
from biped.scenario.keys import Scenario


@dataclass(frozen=True)
class PlanarSetup:
    """All that is known of seven links before the run: handed to the class of a user's law.

    Attributes:
        scenario: The scenario.
        gains: The gait file's gains; a law may use or ignore them.
        tree: Lengths and masses of the model file.
        model: Pinocchio's model of it.
        tick: [s] between calls.
        torque_limit: (6,) [N m].
        robot: The biped, with names of its bodies, coordinates (`q_names`), actuators and points.
    """

    scenario: Scenario
    gains: Gains
    tree: Tree
    model: pinocchio.Model
    tick: float
    torque_limit: np.ndarray
    robot: Robot

    @property
    def observed(self) -> list[str]:
        """Names of all `numbers` of an observation."""
        return PlanarObservation.names_of(self.robot)


@dataclass
class PlanarObservation:
    """The observation of a user's law of seven links at a tick; arrays are live and cannot be changed.

    Attributes:
        time: [s].
        q: (9,) joint coordinates [m, rad]: torso x, z, pitch, then hip, knee, ankle, right and left.
        v: (9,) joint velocities.
        angle: (7,) absolute link angles in the thesis's sense [rad]: torso, thigh, shank, foot, thigh, shank, foot.
        rate: (7,) their rates [rad/s].
        height: (4,) [m] of right toe, right heel, left toe, left heel.
        contact: (4,) believed contacts (0 or 1).
        state: (2,) leg states 1 … 4, right and left.
        M: (9, 9) mass matrix.
        h: (9,) bias forces, gravity included.
        J: (10, 9) rows of all constraints: normal and tangential (along the ground) of each point, then the knees'.
        b_v: (10,) -J̇v of these rows.
        touching: (6,) which constraints touch (0 or 1): the four points, then right and left knee at its stop.
        Q_d: (9,) generalized forces of the gait's springs and dampers.
        single_tangential: Whether a flat foot has one tangential row, its heel's.
    """

    time: float
    q: np.ndarray
    v: np.ndarray
    angle: np.ndarray
    rate: np.ndarray
    height: np.ndarray
    contact: np.ndarray
    state: np.ndarray
    M: np.ndarray
    h: np.ndarray
    J: np.ndarray
    b_v: np.ndarray
    touching: np.ndarray
    Q_d: np.ndarray
    single_tangential: bool = False

    @staticmethod
    def names_of(robot: Robot) -> list[str]:
        """Names of `numbers`.

        Joint coordinates `q.NAME` [m, rad] and velocities `v.NAME`; absolute link angles `angle.NAME` [rad] and rates
        `rate.NAME`; `height.NAME` [m] and `contact.NAME` (0 or 1) of toes and heels; `touching.NAME` (0 or 1) of these
        and of the knees at their stops; `Q_d.NAME` of joints [N, N m]; `state.NAME.1` … `.4` of the legs (1 in that
        state, else 0); `time` [s].
        """
        links, points = robot.bodies, robot.points
        return [
            *(f"q.{name}" for name in robot.q_names), *(f"v.{name}" for name in robot.q_names),
            *(f"angle.{name}" for name in links), *(f"rate.{name}" for name in links),
            *(f"height.{name}" for name in points), *(f"contact.{name}" for name in points),
            *(f"touching.{name}" for name in (*points, *robot.stops)), *(f"Q_d.{name}" for name in robot.q_names),
            *(f"state.{leg}.{state + 1}" for leg in robot.legs for state in range(STATES)), "time",
        ]  # fmt: skip

    @property
    def numbers(self) -> np.ndarray:
        """All that a network can be shown, in the order of `names_of`."""
        states = (self.state[:, None] == np.arange(1, STATES + 1)).ravel()
        parts = self.q, self.v, self.angle, self.rate, self.height, self.contact, self.touching, self.Q_d, states
        return np.concatenate([*parts, [self.time]])

    @property
    def rows(self) -> list[int]:
        """Rows of J that A consists of: those of whatever touches."""
        points = [i for i in range(N_POINTS) if self.touching[i]]
        return self.rows_of(points) + [STOP_ROW + leg for leg in range(N_STOPS) if self.touching[N_POINTS + leg]]

    def rows_of(self, points: Sequence[int]) -> list[int]:
        """Rows of J of some of the four points, normal and tangential."""
        spared = [i for i in points if self.single_tangential and i in TOE and i + 1 in points]
        return [2 * i + direction for i in points for direction in range(2) if direction == 0 or i not in spared]

    @property
    def A(self) -> np.ndarray:
        """(m, 9) constraint Jacobian of whatever touches, before any release test: A v̇ = b_v[rows]."""
        return self.J[self.rows]


class UserLaw:
    """A law of the user's own on seven links; sensing, leg states, limits and log are the thesis's.

    Args:
        run: Scenario, gains and draws.
        believed: Lengths the controller believes in.
        q: (9,) measured joint coordinates, live.
        v: (9,) measured joint velocities, live.
        log: (n, WIDTH) log that ticks write.

    Raises:
        InputError: The law cannot be loaded or made.
    """

    def __init__(self, run: Run, believed: Tree, q: np.ndarray, v: np.ndarray, log: np.ndarray):
        s = run.scenario
        self.record = controller_record(run, believed)
        self.c = self.record[0]
        self.u, self.Q_d = self.c["tick"]["u"], self.c["tick"]["Q_d"]
        self._model = run.believed_model
        self._data = self._model.createData()
        self._q, self._v, self._log = _read_only(q), _read_only(v), log
        parts = {"rate": "at", "height": "tick", "believed": "memory"}
        self._live = {key: _read_only(self.c[part][key]) for key, part in parts.items()}
        self._rows = np.zeros((N_ROWS, NQ)), np.zeros(N_ROWS)
        J, b_v, touching = (_read_only(a) for a in (*self._rows, self.c["tick"]["active"]))
        self._offered = {"J": J, "b_v": b_v, "touching": touching, "Q_d": _read_only(self.Q_d)}
        limit = np.array(self.c["actuation"]["limit"])
        setup = PlanarSetup(s, run.gains, believed, self._model, run.tick, limit, run.robot)
        self._law = Commander(*maker_of(run), setup, NU, len(log))
        self.signals = self._law.signals

    def tick(self, k: int, time: float) -> int:
        """See `biped.control.planar.controller.PlanarLaw`.

        Raises:
            Raised: The user's law raised, or returned something other than six finite numbers.
        """
        pinocchio.crba(self._model, self._data, self._q, pinocchio.Convention.WORLD)
        M = self._data.M
        c, live = self.c, self._live
        status = sense_in(self.record, self._data.J, self._q, self._v, k == 0)
        if status == NOT_FINITE:
            return status
        offer(self.record, self._q, self._v, *self._rows)
        upright = np.array(UPRIGHT) * np.pi
        u = self._law.command(k, PlanarObservation(
            time, self._q, self._v, c["at"]["angle"] + upright + c["belief"]["tilt"],
            live["rate"], live["height"], live["believed"],
            c["memory"]["phase"] + 1, np.triu(M) + np.triu(M, 1).T,
            pinocchio.nonLinearEffects(self._model, self._data, self._q, self._v),
            **self._offered, single_tangential=bool(c["actuation"]["single_tangential"]),
        ))  # fmt: skip
        if not np.isfinite(u).all():
            self._law.refuse(k, time, u)
        np.clip(u, -c["actuation"]["limit"], c["actuation"]["limit"], out=self.u)
        log_tick(self.record, self._q, self._v, self._log, k, time)
        return status


def _read_only(array: np.ndarray) -> np.ndarray:
    """A live view that a law cannot write through: changing what it senses would change the physics."""
    view = array.view()
    view.flags.writeable = False
    return view


@kernel
def offer(record, q, v, J, b_v):
    """Fills the rows of every constraint, touching or not; leaves Q_d and what touches in the record.

    Args:
        record: (1,) `biped.control.planar.setup.CONTROL` with sensed links and leg states.
        q: (9,) joint coordinates [m, rad].
        v: (9,) joint velocities.
        J: (10, 9) overwritten: normal and tangential row of each point, then the knees'.
        b_v: (10,) overwritten: -J̇v.
    """
    c = record[0]
    candidates(c, q)
    desired_forces(c, q, v)
    at = c["at"]
    for i in range(N_POINTS):
        for direction in range(2):
            point_row(at, i, direction, J[2 * i + direction])
            b_v[2 * i + direction] = -at["point_bias"][i, 1 - direction]
    for leg in range(N_STOPS):
        for j in range(NQ):
            J[STOP_ROW + leg, j] = 0.0
        J[STOP_ROW + leg, KNEE[leg]] = 1.0
        b_v[STOP_ROW + leg] = 0.0
