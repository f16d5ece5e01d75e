"""Every key of a scenario's physics in Drake: it acts as in MuJoCo, has no meaning there, or is refused by name."""

from __future__ import annotations

import json
from functools import lru_cache
from typing import Any

import numpy as np
import pytest

from biped.base.errors import InputError
from biped.ensemble.campaign import simulate
from biped.scenario.devices import (
    Actuation,
    ActuationChange,
    Change,
    Command,
    CommandPiece,
    Encoders,
    Estimator,
    Gyro,
    Sensors,
    Switches,
)
from biped.scenario.keys import ControlKeys, Fall, Simulation, Start
from biped.scenario.randomise import Randomise
from biped.scenario.world import BodyTruth, Disturbance, Ground, Push, Seat, Steps, Tiles, Truth, UnmodelledKeys
from biped.studies.run import plan_of

pytest.importorskip("pydrake", reason="Drake is not installed")

PLANAR, MOTORS, STYLE, SPACE, H1, WALK, POLICY = (
    "upright/own", "robot/motors", "level_normal", "spatial/own", "any/h1", "any/h1_walk", "policy/h1",
)  # fmt: skip
SHORT = ("window={start=0.01, end=0.02}", "randomise={}", "expect={}", "sweep={}")
PUSH = ("push=[{at=0.05, duration=0.1, force=[150.0, 0.0]}]",)
HARD = ("push=[{at=0.05, duration=0.1, force=[600.0, 0.0]}]",)
SIDEWAYS = ("push=[{at=0.05, duration=0.1, force=[0.0, 60.0, 0.0], body='torso'}]",)
NONE = ("push=[]",)
RANDOM = ("disturbance={force=[60.0, 0.0]}",)
NOISY = ("truth.unmodelled.torque=0.05",)
SENSED = ("estimator={}", "sensors.encoders={}", "sensors.gyro={}", "sensors.switches={}")
GYRO = (*SENSED, "estimator.width=0.5")  # which no points that touch span: the gyro alone is asked
TURNED = ("change=[{at=0.05, gains={theta_b=85.0}}]",)
TOUCHING = ("change=[{at=0.05, actuation={contacts='touching'}}]", "actuation.release_force=0.0")
ASKED = ("command={forward=0.3, piece=[{at=0.05, forward=0.1}]}",)
GAIT = ("actuation.contacts=released", "actuation.limit=clip")

ACTS: tuple[tuple[Any, ...], ...] = (
    # a scenario, what is set besides, the key and its value; then, where it takes longer, how many seconds
    (PLANAR, (), "start.posture", "flat"), (PLANAR, (), "start.jitter", 0.01),
    (PLANAR, ("start.jitter=0.0",), "start.q", [0.0, 1.05, 0.0, 1.6, 1.5, 1.5, 1.6, 1.5, 1.5]),
    (PLANAR, (), "start.v", [0.3, 0, 0, 0, 0, 0, 0, 0, 0]), (PLANAR, (), "start.settle", False),
    (PLANAR, ("start.posture=flat",), "start.contacts", ["right_toe", "left_toe"]),
    (WALK, ("ground.slope=4.0",), "start.upright", True),
    (PLANAR, (), "ground.slope", 3.0), (H1, NONE, "ground.side_slope", 3.0),
    (PLANAR, ("ground.slope=3.0",), "ground.angles", "slope"), (PLANAR, (), "ground.friction", 0.05),
    (STYLE, (), "actuation.mode", "generalized"), (WALK, (), "actuation.mode", "joint"),
    (SPACE, (), "actuation.assist", 0.5), (PLANAR, (), "actuation.contacts", "touching"),
    (STYLE, (), "actuation.release_force", 0.0), (STYLE, (), "actuation.torque_limit", 20.0),
    (H1, NONE, "actuation.torque_limit", 5.0),
    (STYLE, ("actuation.torque_limit=10.0",), "actuation.limit", "clip"),
    (STYLE, (), "actuation.null_torque", [10.0, 0, 0, 0, 0, 0]),
    (MOTORS, ("randomise.controller_constraints=0.1",), "actuation.single_tangential", False),
    (STYLE, (), "actuation.rank_tolerance", 0.5), (PLANAR, NOISY, "actuation.observer", 400.0),
    (PLANAR, (), "actuation.lag", 0.01), (H1, NONE, "actuation.lag", 0.01), (POLICY, (), "actuation.lag", 0.01),
    (H1, NONE, "actuation.delay", 0.004), (POLICY, (), "actuation.delay_jitter", 0.02),
    (MOTORS, ("actuation.motors=false", "actuation.torque_limit=200.0", *HARD), "actuation.motors", True),
    (PLANAR, (), "simulation.control_rate", 500.0), (H1, NONE, "simulation.control_rate", 500.0),
    *((PLANAR, PUSH, f"push.0.{key}", value) for key, value in {
        "at": 0.1, "duration": 0.2, "force": [0.0, 150.0], "body": "right_shank", "shape": "ramp",
    }.items()),
    (PLANAR, (*PUSH, "push.0.every=0.15"), "push.0.times", 2),
    (PLANAR, (*PUSH, "push.0.shape=sine"), "push.0.frequency", 10.0),
    (PLANAR, ("push=[{at=0.05, duration=0.1, force=[0.2, 0.0]}]",), "push.0.of", "weight"),
    (PLANAR, (*PUSH, "push.0.times=2", "push.0.every=0.15"), "push.0.every", 0.12),
    (SPACE, SIDEWAYS, "push.0.force", [0.0, 60.0, 60.0]), (H1, SIDEWAYS, "push.0.body", "pelvis"),
    *((PLANAR, RANDOM, f"disturbance.{key}", value) for key, value in {
        "force": [0.0, 100.0], "correlation": 0.05, "body": "right_thigh", "at": 0.1,
    }.items()),
    (SPACE, (), "disturbance", {"force": [30.0, 60.0, 0.0]}),
    (PLANAR, PUSH, "fall.height", 0.995), (PLANAR, PUSH, "fall.tilt", 5.0), (H1, NONE, "fall.height", 0.9999),
    (PLANAR, (), "sensors.angle_noise", 0.01), (PLANAR, (), "sensors.rate_noise", 0.1),
    (PLANAR, (), "sensors.height_noise", 0.01), (PLANAR, (), "sensors.delay", 0.004),
    (PLANAR, (), "sensors.quantisation", 0.02),
    (H1, NONE, "sensors.angle_noise", 0.01), (H1, NONE, "sensors.rate_noise", 0.1),
    (SPACE, (), "sensors.height_noise", 0.01), (H1, NONE, "sensors.delay", 0.01),
    (H1, NONE, "sensors.quantisation", 0.02), (H1, NONE, "sensors.zero_error", 0.02),
    (H1, NONE, "sensors.gyro", {"bias": 20.0}),
    (PLANAR, SENSED, "sensors.encoders.resolution", [1.0, 1.0, 1.0]),
    (PLANAR, SENSED, "sensors.encoders.reference_error", 1.0),
    (PLANAR, GYRO, "sensors.gyro.noise", 5.0), (PLANAR, GYRO, "sensors.gyro.range", 5.0),
    (PLANAR, GYRO, "sensors.gyro.cutoff", 2.0), (PLANAR, GYRO, "sensors.gyro.bias", 20.0),
    (PLANAR, SENSED, "sensors.switches.force", 300.0),
    (PLANAR, (*SENSED, "sensors.switches.force=300.0"), "sensors.switches.release", 250.0),
    (PLANAR, SENSED, "sensors.switches.debounce", 0.05), (PLANAR, SENSED, "estimator.width", 0.5),
    *((PLANAR, (), f"truth.{key}", [value, 1, 1, value, 1, 1, 1]) for key, value in
      {"mass": 1.1, "inertia": 1.5, "length": 1.02}.items()),
    (PLANAR, (), "truth.joint_damping", 2.0), (PLANAR, (), "truth.hip_mass", 5.0),
    (PLANAR, (), "truth.unmodelled.torque", 0.05), (PLANAR, NOISY, "truth.unmodelled.angle", 1.0),
    (STYLE, (), "truth.unmodelled.torque", 0.05), (SPACE, (), "truth.unmodelled.torque", 0.05),
    (H1, NONE, "truth.unmodelled.torque", 0.05), (H1, (*NONE, *NOISY), "truth.unmodelled.angle", 1.0),
    (POLICY, (), "truth.unmodelled.torque", 0.05),
    (H1, NONE, "truth.strength", 0.9), (POLICY, (), "truth.strength", 0.8),
    (POLICY, (), "truth.servo_stiffness", 0.7), (POLICY, (), "truth.servo_damping", 2.0),
    (H1, NONE, "truth.joint_damping", 2.0), (WALK, (), "truth.joint_friction", 2.0),
    (WALK, (), "truth.joint_losses", 3.0), (WALK, (), "truth.armature", 0.05),
    *((H1, (*NONE, "truth.part=[{name='torso'}]"), f"truth.part.0.{key}", value) for key, value in
      {"name": "left_foot", "mass": 1.2, "inertia": 3.0, "shift": [0.03, 0.0, 0.0]}.items() if key != "name"),
    (H1, (*NONE, "truth.part=[{name='torso', mass=1.2}]"), "truth.part.0.name", "pelvis"),
    (PLANAR, (), "randomise.controller_mass_matrix", 0.05), (STYLE, (), "randomise.controller_constraints", 0.05),
    (PLANAR, ("randomise.controller_mass_matrix=0.05",), "randomise.controller_errors", "tick"),
    (H1, NONE, "randomise.masses", 0.1),
    (PLANAR, (), "randomise.draw", {"truth.hip_mass": {"uniform": [3.0, 6.0]}}),
    (PLANAR, TURNED, "change.0.at", 0.1), (PLANAR, TURNED, "change.0.over", 0.1),
    (PLANAR, TURNED, "change.0.gains", {"theta_b": 95.0}),
    (PLANAR, ("change=[{at=0.05}]",), "change.0.controller", "slow"),
    (SPACE, TURNED, "change.0.gains", {"theta_b": 95.0}),
    (PLANAR, TURNED, "change.0.after_landing", 0.01, 1.0), (WALK, ("change=[{at=0.05}]",), "change.0.to", "stand"),
    (STYLE, ("change=[{at=0.0}]", "actuation.release_force=0.0"), "change.0.actuation.contacts", "touching"),
    (STYLE, ("change=[{at=0.0}]",), "change.0.actuation.release_force", 0.0),
    *((POLICY, (), f"command.{key}", value) for key, value in {"forward": -0.3, "left": 0.2, "yaw": 0.5}.items()),
    *((POLICY, ASKED, f"command.piece.0.{key}", value) for key, value in
      {"at": 0.2, "over": 0.2, "forward": -0.3, "left": 0.2, "yaw": 0.5}.items()),
)  # fmt: skip

OWN_WAY: tuple[tuple[str, tuple[str, ...], str, Any], ...] = (
    (WALK, (), "start.walking", 1.0), (PLANAR, (), "ground.contact_time", 0.02),
    (PLANAR, (), "ground.damping_ratio", 0.1),
    (PLANAR, (), "simulation.timestep", 0.0005), (H1, NONE, "simulation.timestep", 0.0005),
    (PLANAR, (), "simulation.approximation", "lagged"), (H1, NONE, "simulation.approximation", "lagged"),
    (H1, NONE, "simulation.physics", "file"), (PLANAR, SENSED, "estimator.blend", 0.2),
)  # fmt: skip
"""Keys whose effect hangs on how contacts give way and when a point touches, which each engine has its own way of."""

TILES, STEPS = {"height": 0.02, "start": 0.5, "length": 0.2}, {"rise": 0.02, "start": 0.5, "run": 0.2, "number": 3}
UNEVEN = (
    *((f"ground.tiles.{key}", TILES | {key: value}) for key, value in
      {"height": 0.03, "start": 0.6, "length": 0.3, "number": 3, "ramp": 0.15}.items()),
    *((f"ground.steps.{key}", STEPS | {key: value}) for key, value in
      {"rise": -0.02, "start": 0.6, "run": 0.3, "number": 2, "ramp": 0.15, "back": True}.items()),
)  # fmt: skip

NO_MEANING = {
    "integrator": "RK4", "cone": "pyramidal", "impratio": 100.0, "tolerance": 1e-3, "iterations": 2,
    "ls_iterations": 2, "solver": "PGS",
}  # fmt: skip
"""Settings of MuJoCo's solver and integrator: nothing in Drake corresponds to them."""

SEATED = r"ground\.seat\.height: expected 0: in the engine 'drake' nothing but toes and heels meets anything"
BODIES = r"truth\.unmodelled\.\w+: expected 0: in the engine 'drake' friction and stiffness belong to bodies"
REFUSED: tuple[tuple[str, tuple[str, ...], str], ...] = (
    (PLANAR, ("ground.seat.height=0.4",), SEATED),
    *((PLANAR, ("ground.seat.height=0.4", f"ground.seat.{key}=0.2"), SEATED) for key in ("front", "depth", "pelvis")),
    *((PLANAR, (f"truth.unmodelled.{key}=0.1", *more), BODIES) for key, more in
      {"friction": (), "softness": (), "patch": ("truth.unmodelled.friction=0.1",)}.items()),
    (H1, ("actuation.motors=true",), r"actuation\.motors: expected false"),
)  # fmt: skip

WHOEVER = (
    (PLANAR, "compiled", "pinocchio"), (SPACE, "engine", "compiled"), (SPACE, "engine", "pinocchio"),
    (WALK, "engine", "pinocchio"),
)  # fmt: skip
"""Who computes the law's mechanics, in the same walk but for its last digits."""

TABLES = {
    "start": Start, "ground": Ground, "ground.tiles": Tiles, "ground.steps": Steps, "ground.seat": Seat,
    "actuation": Actuation, "simulation": Simulation, "push.0": Push, "disturbance": Disturbance, "fall": Fall,
    "sensors": Sensors, "sensors.encoders": Encoders, "sensors.gyro": Gyro, "sensors.switches": Switches,
    "estimator": Estimator, "truth": Truth, "truth.unmodelled": UnmodelledKeys, "truth.part.0": BodyTruth,
    "randomise": Randomise, "change.0": Change, "change.0.actuation": ActuationChange, "command": Command,
    "command.piece.0": CommandPiece, "control": ControlKeys,
}  # fmt: skip
SMALL = 1e-3
"""[m, rad, N m] below which an effect is too small to be compared."""
ELSEWHERE = {"actuation.pushing", "actuation.solver", "randomise.runs", "randomise.moves"}
"""The law's own numbers, how many runs there are and which random numbers they draw: an engine sees none of these."""


def changed(key: str, value: Any) -> str:
    return f"{key}={written(value)}"


def written(value: Any) -> str:
    """A value as a command line has it: tables in one line."""
    if isinstance(value, dict):
        return "{" + ", ".join(f'"{key}"={written(one)}' for key, one in value.items()) + "}"
    return json.dumps(value)


@lru_cache(maxsize=64)
def seen(engine: str, name: str, seconds: float, changes: tuple[str, ...]) -> tuple[np.ndarray, ...]:
    """Coordinates of a run, torques, and what an estimator believes, each of all ticks: after its end, nothing."""
    run = plan_of(name, [*SHORT, f"duration={seconds}", *changes, f"engine={engine}"]).run(0)
    t = simulate(run)
    rows = (t.q, t.u, *(() if t.inferred is None else (t.inferred,)))
    return tuple(np.pad(one, ((0, run.ticks - len(one)), (0, 0))) for one in rows)


def effects(engine: str, name: str, besides: tuple[str, ...], key: str, value: Any, seconds: float) -> list[np.ndarray]:
    """By how much each of these differs with a key from without it."""
    plain, other = (seen(engine, name, seconds, changes) for changes in (besides, (*besides, changed(key, value))))
    n = min(len(plain[0]), len(other[0]))
    return [b[:n] - a[:n] for a, b in zip(plain, other, strict=True)]


def closest(there: np.ndarray, here: np.ndarray) -> float:
    """How close two effects are, relative to the first, over the stretch from the start in which they are closest.

    What comes later is chaos of two walks. Of a key that is ignored it is 1.
    """
    size, apart = (np.sqrt(np.cumsum((one**2).sum(axis=1))) for one in (there, here - there))
    counts = size > SMALL
    return float((apart[counts] / size[counts]).min()) if counts.any() else np.nan


@pytest.mark.parametrize("case", ACTS, ids=lambda case: f"{case[0]} {case[2]}")
def test_a_key_does_what_it_does_in_mujoco(case):
    """To the coordinates, to the torques or to what an estimator believes."""
    name, besides, key, value, *seconds = case
    there, here = (effects(engine, name, besides, key, value, *seconds or (0.3,)) for engine in ("mujoco", "drake"))
    found = [closest(a, b) for a, b in zip(there, here, strict=True)]
    print(f"{name} {key}: {[round(x, 3) for x in found]}")
    assert np.nanmin(found) < 0.3


@pytest.mark.parametrize(("name", "besides", "key", "value"), OWN_WAY)
def test_a_key_that_hangs_on_how_contacts_give_way_does_something(name, besides, key, value):
    assert np.linalg.norm(effects("drake", name, besides, key, value, 0.3)[0]) > 1e-4


@pytest.mark.parametrize(("key", "table"), UNEVEN)
@pytest.mark.parametrize(("name", "share", "most"), [(PLANAR, 1.0, 1e-3), (POLICY, 0.5, 5e-3)])
def test_loaded_points_stand_on_the_line_of_the_ground(key, table, name, share, most):
    """The line is the run's, of which every key has a part. A box foot meets the plane below its middle."""
    line = changed(key.rpartition(".")[0], table)
    run = plan_of(name, [*SHORT, "duration=3.0", line, "engine=drake"]).run(0)
    t = simulate(run)
    where = np.linalg.norm(t.force, axis=2) > 0.2 * 9.81 * t.mass
    below = run.profile.height(t.point[..., 0][where])
    assert np.ptp(below) > 0.005
    assert np.quantile(np.abs(t.above[where]), share) < most


@pytest.mark.parametrize("key", NO_MEANING)
def test_settings_of_mujocos_solver_change_no_byte(key):
    change = changed(f"simulation.{key}", NO_MEANING[key])
    one, other = (seen("drake", PLANAR, 0.1, changes)[0] for changes in ((change,), ()))
    assert one.tobytes() == other.tobytes()


@pytest.mark.parametrize(("name", "one", "other"), WHOEVER)
def test_whoever_computes_the_mechanics_the_walk_is_the_same(name, one, other):
    q, other_q = (seen("drake", name, 0.1, (f"control.mechanics={who}",))[0] for who in (one, other))
    assert 0.0 < np.abs(q - other_q).max() < 1e-9


@pytest.mark.parametrize(("name", "changes", "words"), REFUSED)
def test_what_cannot_be_is_refused_by_name(name, changes, words):
    with pytest.raises(InputError, match=words):
        plan_of(name, [*changes, "engine=drake"])


def test_no_key_is_left_out():
    tables = set(TABLES)
    every = {
        f"{table}.{key}" for table, kind in TABLES.items() for key in kind.__struct_fields__
    } - {table.removesuffix(".0") for table in tables} - ELSEWHERE  # fmt: skip
    said = (
        {case[2] for case in (*ACTS, *OWN_WAY)}
        | {key for key, _ in UNEVEN}
        | {f"simulation.{key}" for key in NO_MEANING}
        | {"control.mechanics"}
    )
    said |= {change.partition("=")[0] for _, changes, _ in REFUSED for change in changes}
    assert not every - said
