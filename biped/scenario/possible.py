"""Checks of a scenario that no type makes: times within the run, bounds in order, no more than a machine holds."""

import math

from biped.base.errors import safe
from biped.base.files import nearest
from biped.scenario.engines import ENGINES
from biped.scenario.goals import check_bounds
from biped.scenario.keys import ENGINE, Scenario
from biped.scenario.laws import THESIS, own_law
from biped.scenario.metrics import METRICS
from biped.scenario.pushing import MOST_PIECES, PIECE, count
from biped.scenario.valid import Fail

MOST_STEPS = 100_000_000
"""Physics steps of the longest run: a day at 1 kHz."""
MOST_TICKS = 10_000_000
"""Control ticks of the longest run: each is a row of the trajectory, in memory."""
MOST_RUNS = 1_000_000
"""Of a campaign: points of its sweep times runs of each."""
MOST_DELAY = 100_000
"""Control ticks that sensors or commands may lag behind: each is kept."""
MOST_PREDICTED = 1000
"""Control ticks that the law may predict over: it takes a step of its mechanics for each, at every tick."""
OF_ANY_KIND = (
    ("sensors", "zero_error"), ("truth", "part"), ("truth", "strength"), ("truth", "servo_stiffness"),
    ("truth", "servo_damping"), ("truth", "joint_friction"), ("truth", "joint_losses"), ("truth", "armature"),
    ("actuation", "delay"), ("actuation", "delay_jitter"), ("ground", "side_slope"),
    ("randomise", "masses"),
)  # fmt: skip
"""Keys that seven links in a plane have no use for: table and name."""
MOST_VALUES = 100_000
"""That a standard test may tell apart."""


def possible(s: Scenario, fail: Fail) -> None:
    """Rejects what types cannot: times outside the run, contradictory bounds, more than a machine holds."""
    if s.engine not in ENGINES:
        names = list(ENGINES)
        raise fail("engine", f"expected one of {', '.join(names)}, got '{safe(s.engine)}'; {nearest(s.engine, names)}")
    most = min(MOST_TICKS / s.simulation.control_rate, MOST_STEPS * s.simulation.timestep)
    if s.duration > most:
        raise fail("duration", f"expected at most {most:g} s at this time step and control rate, got {s.duration:g}")
    if s.duration * s.simulation.control_rate < 1.0:
        raise fail("duration", f"expected at least one control tick of {1.0 / s.simulation.control_rate:g} s, got "
                   f"{s.duration:g}")  # fmt: skip
    if s.sensors.delay * s.simulation.control_rate > MOST_DELAY:
        raise fail("sensors.delay", f"expected at most {MOST_DELAY / s.simulation.control_rate:g} s at this control "
                   f"rate, got {s.sensors.delay:g}")  # fmt: skip
    if (s.actuation.delay + s.actuation.delay_jitter) * s.simulation.control_rate > MOST_DELAY:
        raise fail("actuation.delay", f"expected at most {MOST_DELAY / s.simulation.control_rate:g} s at this control "
                   f"rate, with its jitter, got {s.actuation.delay + s.actuation.delay_jitter:g}")  # fmt: skip
    if s.sensing.predict * s.simulation.control_rate > MOST_PREDICTED:
        raise fail("sensing.predict", f"expected at most {MOST_PREDICTED / s.simulation.control_rate:g} s at this "
                   f"control rate, got {s.sensing.predict:g}")  # fmt: skip
    for i, push in enumerate(s.push):
        if push.at >= s.duration:
            raise fail(f"push[{i}].at", f"expected a time within the run (duration {s.duration} s), got {push.at}")
    _changing_pushes(s, fail)
    if s.disturbance is not None and s.disturbance.at >= s.duration:
        raise fail("disturbance.at", f"expected a time within the run (duration {s.duration} s), got "
                   f"{s.disturbance.at}")  # fmt: skip
    _follow_one_another(s, fail)
    _ramps(s, fail)
    _seat(s, fail)
    if s.simulation.approximation not in ENGINES[s.engine].approximations:
        raise fail("simulation.approximation", f"expected 'sap': the engine '{s.engine}' has no other; this one needs "
                   "engine = 'drake'")  # fmt: skip
    start, end = s.interval
    for key, given in (("window.start", s.window.start), ("window.end", s.window.end)):
        if given is not None and given > s.duration:
            raise fail(key, f"expected a time within the run (duration {s.duration} s), got {given}")
    if end <= start:
        raise fail("window", f"expected start < end, got [{start}, {end}] s")
    if s.duration < 2 * s.simulation.timestep:
        raise fail("duration", f"expected at least two time steps of {s.simulation.timestep} s, got {s.duration}")
    steps = 1.0 / (s.simulation.control_rate * s.simulation.timestep)
    if round(steps) < 1 or abs(steps - round(steps)) > 1e-6 * steps:
        raise fail(
            "simulation.control_rate",
            f"expected 1/control_rate to be a whole number of time steps of {s.simulation.timestep} s, "
            f"got {steps:g} steps",
        )
    if s.actuation.null_torque is not None and s.actuation.mode != "joint":
        raise fail("actuation.null_torque", "expected mode = 'joint': generalized forces leave nothing free")
    if s.actuation.motors and s.actuation.mode != "joint":
        raise fail("actuation.motors", "expected mode = 'joint': generalized forces come from no motor")
    if s.actuation.assist and (s.law != THESIS or s.actuation.mode != "joint"):
        raise fail("actuation.assist", "expected 0.0 but of joint torques of a biped in space (law = 'thesis')")
    if s.actuation.observer > 0.0:
        _observer(s, fail)
    if own_law(s.law) and s.actuation.mode != "joint":
        raise fail("actuation.mode", f"expected 'joint' with a law of one's own, which returns torques; got "
                   f"'{s.actuation.mode}'")  # fmt: skip
    for key in ("predict", "follow", "follow_rates"):
        if own_law(s.law) and getattr(s.sensing, key) > 0.0:
            raise fail(f"sensing.{key}", "expected 0 with a law of one's own: it is the thesis's law that predicts")
    if own_law(s.law) and s.backstep is not None:
        raise fail("backstep", "expected no law of one's own: the step back belongs to the thesis's leg states")
    _unmodelled(s, fail)
    _mistakes(s, fail)
    _searched(s, fail)
    check_bounds(s.expect, fail)
    for key, distribution in s.randomise.draw.items():
        given = [name for name in distribution.__struct_fields__ if getattr(distribution, name) is not None]
        if len(given) != 1:
            raise fail(f'randomise.draw."{key}"', f"expected exactly one of normal, uniform, choice, grid, got {given}")
        if distribution.uniform is not None and distribution.uniform[0] > distribution.uniform[1]:
            raise fail(f'randomise.draw."{key}".uniform', f"expected lower <= upper, got {list(distribution.uniform)}")
        if distribution.choice == () or distribution.grid == ():
            raise fail(f'randomise.draw."{key}"', "expected at least one value")
    if len(s.sweep) > 2:
        raise fail("sweep", f"expected one or two keys, got {len(s.sweep)}")
    for key, values in s.sweep.items():
        if not values:
            raise fail(f'sweep."{key}"', "expected at least one value")
        if key in s.randomise.draw:
            raise fail(f'sweep."{key}"', "expected a key that is not drawn at random as well")
    runs = s.randomise.runs * math.prod(map(len, s.sweep.values()))
    if runs > MOST_RUNS:
        raise fail("sweep", f"expected at most {MOST_RUNS} runs in all (randomise.runs at each point), got {runs}")
    # MuJoCo would take two steps instead, without a word.
    time = s.ground.contact_time
    if ENGINES[s.engine].own_clock and time is not None and time < 2 * s.simulation.timestep * (1.0 - 1e-9):
        raise fail("ground.contact_time", f"expected at least two time steps ({2 * s.simulation.timestep:g} s), "
                   f"got {time:g}")  # fmt: skip


def suits_seven_links(s: Scenario, fail: Fail) -> None:
    """Rejects what seven links in a plane have no use for, by name."""
    plain = Scenario()
    for table, key in OF_ANY_KIND:
        if getattr(getattr(s, table), key) != getattr(getattr(plain, table), key):
            raise fail(f"{table}.{key}", f"belongs to robots of any kind (docs/robots.md), which model '{s.model}' is "
                       "not here")  # fmt: skip
    _mechanics(s, fail)
    _sensed(s, fail)


def _sensed(s: Scenario, fail: Fail) -> None:
    """Rejects an estimator without its sensors, sensors without it, and noise on what nobody measures."""
    names = ("encoders", "gyro", "switches")
    there = [name for name in names if getattr(s.sensors, name) is not None]
    if s.estimator is None:
        if there:
            raise fail(f"sensors.{there[0]}", "expected an [estimator], which infers the posture from it")
        return
    if missing := [name for name in names if name not in there]:
        raise fail("estimator", f"expected sensors to infer from: [sensors.{missing[0]}] is missing")
    direct = ("rate_noise", "height_noise", "quantisation")
    if told := [name for name in direct if getattr(s.sensors, name) > 0.0]:
        raise fail(f"sensors.{told[0]}", "expected none with an [estimator]: nobody measures the posture itself")
    switches = s.sensors.switches
    if switches is not None and switches.release > switches.force:
        raise fail("sensors.switches.release", f"expected at most the force that closes a switch, {switches.force:g} "
                   f"N, got {switches.release:g}")  # fmt: skip


def _mechanics(s: Scenario, fail: Fail) -> None:
    """Rejects mechanics that a law in the plane does not read."""
    asked = s.control.mechanics
    if s.law == THESIS:
        return  # what is wrong then is the model
    if s.law is not None and asked is not None:
        raise fail("control.mechanics", f"expected none with a law of one's own: it is the thesis's law's; got "
                   f"'{asked}'")  # fmt: skip
    if asked == ENGINE:
        raise fail("control.mechanics", "expected 'compiled' or 'pinocchio', got 'engine': of seven links the law "
                   "reads nothing that an engine computes")  # fmt: skip


def _observer(s: Scenario, fail: Fail) -> None:
    """Rejects an observer where the law asks for no joint torques, or others finish what it asks for."""
    if own_law(s.law):
        raise fail("actuation.observer", "expected 0 with a law of one's own: it is the thesis's law that observes")
    if s.actuation.mode != "joint" or s.actuation.assist:
        raise fail("actuation.observer", "expected 0, or actuation.mode = 'joint' without assist: generalized forces "
                   "come through no joint")  # fmt: skip
    if s.actuation.limit == "bounded" and s.actuation.solver != "active_set":
        raise fail("actuation.observer", f"expected 0, or actuation.solver = 'active_set', got '{s.actuation.solver}'")


def _mistakes(s: Scenario, fail: Fail) -> None:
    """Rejects mistakes about M and A of a law that asks for neither."""
    for key in ("controller_mass_matrix", "controller_constraints"):
        if getattr(s.randomise, key) > 0.0 and s.actuation.mode != "joint":
            raise fail(f"randomise.{key}", "expected 0, or actuation.mode = 'joint': Q_d itself needs neither M nor A")


def _unmodelled(s: Scenario, fail: Fail) -> None:
    """Rejects what nobody modelled where it cannot be: torques without joints, friction and softness by place."""
    if s.truth.unmodelled.torque > 0.0 and s.actuation.mode != "joint":
        raise fail("truth.unmodelled.torque", "expected 0, or actuation.mode = 'joint': generalized forces come "
                   "through no joint")  # fmt: skip
    for key in ("friction", "softness"):
        if getattr(s.truth.unmodelled, key) > 0.0 and (why := ENGINES[s.engine].uniform):
            raise fail(f"truth.unmodelled.{key}", f"expected 0: in the engine '{s.engine}' {why}; use engine = "
                       "'mujoco'")  # fmt: skip


def _searched(s: Scenario, fail: Fail) -> None:
    """Rejects a [standard] that cannot be searched, or shows what there is not."""
    if s.standard is None:
        return
    test = s.standard
    for name in test.shows:
        if name not in METRICS:
            raise fail("standard.shows", f"unknown metric '{safe(name)}'; {nearest(name, list(METRICS))}")
    if test.key is None:
        return
    if test.step == 0.0 or (test.last - test.first) * test.step < 0.0:
        raise fail("standard.step", f"expected steps from first = {test.first:g} to last = {test.last:g}, got "
                   f"{test.step:g}")  # fmt: skip
    parts = abs(test.step) / test.resolution
    if round(parts) < 1 or abs(parts - round(parts)) > 1e-6 * parts:
        raise fail("standard.resolution", f"expected the step of {test.step:g} to be a whole number of them, got "
                   f"{test.resolution:g}")  # fmt: skip
    if abs(test.last - test.first) / test.resolution > MOST_VALUES:
        raise fail("standard.resolution", f"expected at most {MOST_VALUES} of them from first to last, got "
                   f"{test.resolution:g}")  # fmt: skip


def _changing_pushes(s: Scenario, fail: Fail) -> None:
    """Rejects pushes in more pieces than a run is kept with."""
    tick, total = 1.0 / s.simulation.control_rate, 0
    for i, push in enumerate(s.push):
        if push.shape != "constant" or push.times > 1:
            total += count(push, tick, s.duration)
            if total > MOST_PIECES:
                raise fail(
                    f"push[{i}].duration",
                    f"expected at most {MOST_PIECES} pieces of pushes that change, {PIECE:g} s each, of a sine at most "
                    f"a 20th of its period, or that come again; got {total}",
                )


def _ramps(s: Scenario, fail: Fail) -> None:
    """Rejects tiles and steps that are shorter than the ramps between them."""
    tiles, steps = s.ground.tiles, s.ground.steps
    for key, there, length, ramp in (
        ("ground.tiles.length", tiles.height > 0.0, tiles.length, tiles.ramp),
        ("ground.steps.run", steps.rise != 0.0, steps.run, steps.ramp),
    ):
        if there and length <= ramp:
            raise fail(key, f"expected more than the ramp of {ramp:g} m, got {length:g}")


def _seat(s: Scenario, fail: Fail) -> None:
    """Rejects a seat where nothing could sit on it."""
    if s.ground.seat.height > 0.0 and not ENGINES[s.engine].seat:
        raise fail("ground.seat.height", f"expected 0: in the engine '{s.engine}' nothing but toes and heels meets "
                   "anything; a seat needs engine = 'mujoco'")  # fmt: skip


def _follow_one_another(s: Scenario, fail: Fail) -> None:
    """Rejects changes outside the run, before the last one begins, or of a law that has no gains."""
    if s.change and own_law(s.law):
        raise fail("change", "expected no law of one's own, which knows the time; changes are the thesis's law's")
    free = 0.0
    for i, change in enumerate(s.change):
        if change.at >= s.duration:
            raise fail(f"change[{i}].at", f"expected a time within the run (duration {s.duration} s), got {change.at}")
        if change.at < free:
            raise fail(f"change[{i}].at", f"expected at least {free:g} s, when the last one begins, got {change.at:g}")
        free = change.at
        told = [key for key in change.actuation.__struct_fields__ if getattr(change.actuation, key) is not None]
        if told and s.actuation.contacts == "pushing":
            raise fail(f"change[{i}].actuation.{told[0]}", "expected none where actuation.contacts = 'pushing': joint "
                       "torques for ground that only pushes choose no contacts")  # fmt: skip
