"""A run's controller record: gait, in whatever units, beliefs and settings written into it before the first tick.

A gait with `unit = "mgl"` counts in the walker's weight, the length of its leg, and √(l/g): springs are in m g l,
dampers in m g l √(l/g), placement in 1/l and 1/√(g l), pace in √(g l) and 1/√(g l); of what joint torques take the
ground for, and of a step back, lengths are in l, times in √(l/g), accelerations in g and the price of torques in
1/(m l²). Angles are as they are.
"""

import math
from typing import Any, NamedTuple

import mujoco
import numpy as np
from msgspec.structs import replace

from biped.control.blending import fraction, most_in_a_tick
from biped.control.law import Setup
from biped.control.pace import parts
from biped.control.space import record
from biped.control.space.disturbance import NOTICED
from biped.control.space.places import Mechanics
from biped.control.space.record import (
    ANKLE,
    BASE,
    EDGES,
    INVERSION,
    KNEE,
    LEG,
    LEG_POINTS,
    LEGS,
    N_POINTS,
    PLANE_EDGES,
    Sizes,
)
from biped.control.space.tick import WORTH
from biped.control.step_back import set_backstep
from biped.robot.anatomy import Anatomy, anatomy_of
from biped.robot.ground import GRAVITY
from biped.robot.parts import own_masses
from biped.robot.robot import Robot
from biped.scenario.devices import Pushing
from biped.scenario.gains import MGL, STRAIGHT, Axial, Frontal, Gains, Placement
from biped.scenario.keys import Backstep, Scenario


class Unit(NamedTuple):
    """The unit that a walker's numbers are counted in.

    Attributes:
        mass: [kg] of it.
        length: [m] of its leg.
    """

    mass: float
    length: float

    @property
    def time(self) -> float:
        """[s] √(l/g)."""
        return math.sqrt(self.length / GRAVITY)

    @property
    def moment(self) -> float:
        """[N m] m g l."""
        return self.mass * GRAVITY * self.length

    @property
    def inertia(self) -> float:
        """[kg m²] m l²."""
        return self.mass * self.length**2

    @property
    def acceleration(self) -> float:
        """[m/s²] g."""
        return GRAVITY


def unit_of(robot: Robot, anatomy: Anatomy) -> Unit:
    """The unit of a walker."""
    return Unit(robot.mass, anatomy.leg)


def si_gains(gains: Gains, unit: Unit) -> Gains:
    """A complete gait in SI units, whatever it is in."""
    if gains.unit != MGL:
        return gains
    frontal: Any = _parts(gains.frontal, unit) if gains.frontal else None
    if frontal is not None and (placement := frontal.placement) is not None:
        frontal = replace(frontal, placement=replace(
            placement, position=_times(placement.position, unit.length**-1),
            velocity=_times(placement.velocity, unit.time / unit.length),
            apart=_times(placement.apart, unit.length), crossing=_times(placement.crossing, unit.length),
            push=_times(placement.push, unit.time**2 / unit.length),
        ))  # fmt: skip
    axial: Any = _parts(gains.axial, unit) if gains.axial else None
    pace, second = gains.pace, unit.time / unit.length
    if pace is not None:
        speeds = {name: _times(getattr(pace, name), 1.0 / second) for name in ("speed", "slope")}
        shares = {name: _times(getattr(pace, name), second) for name in ("swing", "stance")}
        moments = {name: _times(getattr(pace, name), unit.moment * second**2) for name in ("knee", "ankle")}
        pace = replace(pace, **speeds, **shares, **moments)
    return replace(_parts(gains, unit), frontal=frontal, axial=axial, pace=pace, unit=None)


def si_pushing(pushing: Pushing, gains: Gains, unit: Unit) -> Pushing:
    """Settings of ground that only pushes in SI units; they are in those of the gait."""
    if gains.unit != MGL:
        return pushing
    return replace(
        pushing, approach=pushing.approach * unit.time, reach=pushing.reach * unit.length,
        yielding=pushing.yielding * unit.acceleration, regularisation=pushing.regularisation / unit.inertia,
        smoothing=pushing.smoothing * unit.time, slew=pushing.slew * unit.moment / unit.time,
    )  # fmt: skip


def si_backstep(backstep: Backstep | None, gains: Gains, unit: Unit) -> Backstep | None:
    """A step back in SI units; its numbers are in those of the gait."""
    if backstep is None or gains.unit != MGL:
        return backstep
    return replace(
        backstep, margin=backstep.margin * unit.length, k_d2=backstep.k_d2 * unit.moment,
        b_d2=backstep.b_d2 * unit.moment * unit.time, k_d3=backstep.k_d3 * unit.moment,
        b_d3=backstep.b_d3 * unit.moment * unit.time,
    )  # fmt: skip


def _parts(part: Gains | Frontal | Axial, unit: Unit) -> Any:
    """A table of gains with its springs and dampers times their units."""
    factors = {"k_": unit.moment, "b_": unit.moment * unit.time}
    changed = {name: _times(getattr(part, name), factors[name[:2]])
               for name in part.__struct_fields__ if name[:2] in factors}  # fmt: skip
    return replace(part, **changed)


def _times(value: Any, factor: float) -> Any:
    if value is None:
        return None
    return tuple(one * factor for one in value) if isinstance(value, tuple) else value * factor


_NEVER = 1e3
"""[rad] End of the range of a knee that has none."""


class LawOrder(NamedTuple):
    """Where a biped's coordinates stand, counted as the law does.

    Attributes:
        joints: Numbers of the joints that the law counts; -1 of the base's six and of what a leg has not.
        column: Where each stands in v; -1: nowhere.
        place: Where it stands in q; -1: nowhere.
        drive: Which actuator has each torque of the law; -1: none.
    """

    joints: np.ndarray
    column: np.ndarray
    place: np.ndarray
    drive: np.ndarray


def order_of(model: mujoco.MjModel, robot: Robot, anatomy: Anatomy) -> LawOrder:
    """The law's order of a biped's coordinates."""
    joints = np.array([*anatomy.trunk, *[-1] * BASE, *(joint for leg in anatomy.legs for joint in leg.joints)])
    column, place = (np.where(joints >= 0, of[joints], -1) for of in (model.jnt_dofadr, model.jnt_qposadr))
    trunk = len(anatomy.trunk)
    column[[trunk + axis for axis in robot.base_axes]] = robot.base_columns
    drives = [drive.column for drive in robot.drives]
    driven = np.delete(column, slice(trunk, trunk + BASE))
    drive = np.array([drives.index(one) if one >= 0 else -1 for one in driven])
    return LawOrder(joints, column, place, drive)


class RangeEnd(NamedTuple):
    """An end of a joint's range: which leg and joint, which way it pushes the coordinate, where [rad] it is."""

    leg: int
    joint: int
    way: float
    end: float


def _stops(model: mujoco.MjModel, anatomy: Anatomy) -> list[RangeEnd]:
    """Ends of ranges that the law counts on: where knees are straight, and both of ankle and inversion."""
    out = []
    for number, leg in enumerate(anatomy.legs):
        joint, way = leg.joints[KNEE], -float(leg.sign[KNEE])
        low, high = model.jnt_range[joint].tolist() if model.jnt_limited[joint] else (-_NEVER, _NEVER)
        out.append(RangeEnd(number, KNEE, way, high if way < 0.0 else low))
    for number, leg in enumerate(anatomy.legs):
        for which in (ANKLE, INVERSION):
            joint = leg.joints[which]
            if joint >= 0 and model.jnt_limited[joint]:
                low, high = model.jnt_range[joint].tolist()
                out += [RangeEnd(number, which, 1.0, low), RangeEnd(number, which, -1.0, high)]
    return out


def controller_record(setup: Setup) -> np.ndarray:
    """The compiled tick's record for a run.

    Returns:
        Array (1,) of `biped.control.space.record.control_type`.

    Raises:
        InputError: The robot is of another kind.
    """
    s, model, robot = setup.scenario, setup.model, setup.robot
    anatomy = anatomy_of(model, robot)
    order, stops, unit = order_of(model, robot, anatomy), _stops(model, anatomy), unit_of(robot, anatomy)
    out = record.new(Sizes(len(anatomy.trunk), anatomy.shared, len(stops)))
    c = out[0]
    set_gains(c["gait"], si_gains(setup.gains, unit))
    _set_beliefs(c["belief"], s, model, robot, anatomy, order)
    _set_joints(c["belief"], model, robot, order)
    for name, values in zip(("leg", "joint", "way", "end"), zip(*stops, strict=True), strict=True):
        c["belief"][f"stop_{name}"] = values
    _without(c["at"], order, len(anatomy.trunk))
    _set_sensing(c["sensing"], s, setup.tick)
    set_backstep(c["backstep"], si_backstep(s.backstep, setup.gains, unit))
    _set_actuation(c["actuation"], setup, order, unit)
    c["memory"]["factor"] = c["actuation"]["compensation"]
    return out


def _without(at: np.void, order: LawOrder, trunk: int) -> None:
    """Gives each coordinate that a walker has not a mass of its own, which nothing moves."""
    base, missing = trunk + BASE, order.column < 0
    for i in np.flatnonzero(missing[:base]):
        at["M_base"][i, i] = 1.0
    for leg in range(LEGS):
        for i in np.flatnonzero(missing[base + LEG * leg : base + LEG * (leg + 1)]):
            at["M_leg"][leg, i, i] = 1.0


_NONE = 0.0, 0.0, 0.0, 0.0
_NO_FRONTAL: Any = Frontal(0.0, _NONE, _NONE, 0.0, _NONE, _NONE, _NONE, _NONE, Placement(0.0, 0.0))
_NO_AXIAL: Any = Axial(0.0, _NONE, 0.0, _NONE, 0.0, _NONE)
"""Of a gait in the plane."""


def set_gains(gait: np.void, gains: Gains) -> None:
    """Writes a gait into the gait of a controller record."""
    g: Any = gains  # `read_gains` has seen to it that it is complete
    frontal, axial = g.frontal or _NO_FRONTAL, g.axial or _NO_AXIAL
    gait["k_torso"] = g.k_d1, frontal.k_d1, axial.k_d1
    gait["b_torso"] = g.b_d1, frontal.b_d1, axial.b_d1
    gait["rest_torso"] = math.radians(g.theta_b), 0.0, 0.0
    gait["heading"] = math.radians(axial.theta_b)
    knee = g.theta_k or STRAIGHT
    gait["k"] = np.transpose([g.k_d2, frontal.k_d2, axial.k_d2, g.k_d3, g.k_d4, frontal.k_d4])
    gait["b"] = np.transpose([g.b_d2, frontal.b_d2, axial.b_d2, g.b_d3, g.b_d4, frontal.b_d4])
    gait["rest"] = np.radians(
        np.transpose([g.theta_l, frontal.theta_l, axial.theta_l, knee, g.theta_a, frontal.theta_a])
    )
    gait["pace"] = parts(g.pace)
    for name in Placement.__struct_fields__:
        gait[name] = getattr(frontal.placement, name) or 0.0


def _set_beliefs(
    belief: np.void, s: Scenario, model: mujoco.MjModel, robot: Robot, anatomy: Anatomy, order: LawOrder
) -> None:
    x, y, z = -model.opt.gravity
    if s.ground.angles == "gravity":
        belief["tilt"] = math.atan2(x, z), math.atan2(y, z)
    belief["downhill"] = -x, -y
    legs = anatomy.legs
    belief["hip"] = 0.5 * abs(legs[1].knee[1] - legs[0].knee[1])
    belief["mass"] = float(own_masses(model, robot.base_number).sum())
    belief["shank"] = 0.5 * (legs[0].length + legs[1].length)
    belief["column"], belief["place"] = order.column, order.place
    belief["root"], belief["link"] = robot.base_number, (anatomy.torso, *(leg.thigh for leg in legs))
    axes = anatomy.axes, *(leg.axes for leg in legs)
    belief["across"], belief["along"] = [own[:, 1] for own in axes], [own[:, 2] for own in axes]
    belief["foot"] = [leg.foot for leg in legs]
    belief["sole"] = sole = np.concatenate([leg.sole for leg in legs])
    for p in range(N_POINTS):
        belief["twin"][p] = any(np.array_equal(sole[p], sole[other]) for other in range(p - p % LEG_POINTS, p))
    flat = 2 * int(belief["twin"].sum()) == N_POINTS  # soles without width: a walker in the plane
    belief["edges"] = PLANE_EDGES if flat else EDGES
    belief["sign"], belief["zero"] = [leg.sign for leg in legs], [leg.zero for leg in legs]


def _set_joints(belief: np.void, model: mujoco.MjModel, robot: Robot, order: LawOrder) -> None:
    """Writes what joints do by themselves, and where those above the legs are held: as in the robot's own start."""
    there = (order.column >= 0) & (order.joints >= 0)
    belief["damping"] = np.where(there, model.dof_damping[order.column], 0.0)
    belief["dry"] = np.where(there, model.dof_frictionloss[order.column], 0.0)
    q = model.key_qpos[model.key(robot.start).id] if robot.start else model.qpos0
    upper = belief["upright"].size
    belief["upright"] = np.where(order.place[:upper] >= 0, q[order.place[:upper]], 0.0)


def _set_sensing(sensing: np.void, s: Scenario, tick: float) -> None:
    given = s.sensing
    sensing["contact_height"] = given.contact_height
    holds = given.heel_on, given.heel_off, given.toe_on, given.toe_off
    sensing["hold"] = [round(hold / tick) for hold in holds]
    sensing["extended"], sensing["ahead"] = given.extended, given.ahead
    sensing["late_stance"] = math.radians(given.late_stance)
    sensing["passing"] = math.inf if given.passing is None else given.passing


def _set_actuation(actuation: np.void, setup: Setup, order: LawOrder, unit: Unit) -> None:
    s = setup.scenario
    pushing = si_pushing(s.actuation.pushing, setup.gains, unit)
    actuation["generalized"] = s.actuation.mode == "generalized"
    actuation["limit"] = np.where(order.drive >= 0, setup.torque_limit[order.drive], 0.0)
    for name in ("friction", "approach", "braking", "reach", "yielding", "regularisation", "stops", "compensation",
                 "learning"):  # fmt: skip
        actuation[name] = getattr(pushing, name)
    actuation["follow"] = fraction(pushing.smoothing, 1.0 / s.simulation.control_rate)
    actuation["most"] = most_in_a_tick(pushing.slew, 1.0 / s.simulation.control_rate)
    actuation["noticing"] = fraction(NOTICED, setup.tick)
    seconds, moment = WORTH
    actuation["tick"], actuation["worth"] = setup.tick, seconds * (moment * unit.moment) ** 2


def mechanics_of(c: np.void, model: mujoco.MjModel, data: mujoco.MjData) -> Mechanics:
    """A walker's state and what MuJoCo knows of it after `mj_step1`, live.

    Args:
        c: Its controller record.
        model: What is stepped.
        data: Its state.
    """
    return Mechanics(
        data.qpos, data.qvel, data.M, entries_of(c, model), data.qfrc_bias, data.cdof, data.cdof_dot, data.cvel,
        data.subtree_com, data.xmat, data.xpos,
    )  # fmt: skip


def entries_of(c: np.void, model: mujoco.MjModel) -> np.ndarray:
    """(nM, 4) where MuJoCo's numbers of the mass matrix belong: see `Mechanics`."""
    upper, reach = c["at"]["M_base"].shape[0], c["at"]["M_cross"].shape[2]
    at = {int(column): i for i, column in enumerate(c["belief"]["column"]) if column >= 0}
    out = np.full((model.nC, 4), -1)
    for row in range(model.nv):
        first = int(model.M_rowadr[row])
        for k in range(first, first + int(model.M_rownnz[row])):
            one, other = at[row], at[int(model.M_colind[k])]
            inner, outer = min(one, other), max(one, other)
            if outer < upper:
                out[k] = 0, 0, outer, inner
            elif inner >= upper:
                leg = (outer - upper) // LEG
                out[k] = 2, leg, outer - upper - LEG * leg, inner - upper - LEG * leg
            elif inner >= upper - reach:
                leg = (outer - upper) // LEG
                out[k] = 1, leg, outer - upper - LEG * leg, inner - upper + reach
    return out
