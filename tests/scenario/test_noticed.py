"""Every key of a scenario of a robot of any kind does something or is refused by name; none can be forgotten."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from typing import Any, get_args, get_origin, get_type_hints

import msgspec
import numpy as np
import pytest
from msgspec.structs import replace

from biped.base.errors import InputError
from biped.engines.loop import drive
from biped.engines.plant import MujocoPlant
from biped.ensemble.plan import Plan
from biped.robot.run import factory_of
from biped.scenario.devices import Actuation, CommandPiece, Gyro, Sensors
from biped.scenario.gains import Gains
from biped.scenario.general import OWN
from biped.scenario.keys import Change, Push, Scenario
from biped.scenario.reading import read_scenario
from biped.scenario.world import BodyTruth, Disturbance, Truth, UnmodelledKeys
from biped.studies.run import with_law

NOT_OF_A_RUN = {
    "description", "law", "law_sha256", "sweep", "threshold", "failures", "window", "expect", "thesis", "tune",
    "standard", "randomise.runs", "randomise.draw", "start.walking",
}  # fmt: skip
"""What a campaign is, and what its results are held against."""
OF_THE_ROBOT = {"robot", "model", "engine", "simulation.physics", "simulation.approximation"}
"""What `biped.robot` reads, with tests of its own; there is one engine, and what is another's is refused on reading."""
TOLD = {f"{table}.{key}".lstrip(".") for table, keys in OWN.items() for key in keys}
"""What a law of one's own may make of what it is."""
OTHERS: dict[str, Any] = {
    "start.posture": "flat", "push.0.body": "right_foot", "disturbance.body": "right_foot",
    "randomise.moves": [{"seed": 5}],
    "change.0.controller": "human3d_generalized", "change.0.to": "stand",
    "controller": "human3d_generalized", "truth.part.0.name": "left_foot",
    "fall.height": 0.9999999, "fall.tilt": 0.01, "simulation.iterations": 1, "simulation.tolerance": 1.0,
    "simulation.ls_iterations": 1,
    "simulation.timestep": 0.0005, "simulation.control_rate": 500.0, "actuation.torque_limit": 1.0,
    "start.contacts": ("right_toe",), "seed": 3, "reading": "clipped", "control.mechanics": "engine",
}  # fmt: skip
"""Values that differ from the base's, where half as much again would not do or is no value."""
SWITCHES = {
    "ground.tiles": {"height": 0.01},
    "ground.steps": {"rise": 0.01},
    "ground.seat": {"height": 0.4},
    "gains.pace": {"speed": 0.5, "slope": 0.5, "side": 0.5, "swing": 0.1, "stance": 0.1},
}
"""What makes a table's other keys mean anything."""


LIST: dict[str, Any] = {
    "command.piece": lambda: CommandPiece(at=0.01),
    "push": Push,
    "truth.part": BodyTruth,
    "change": lambda: Change(at=0.01),
}


class Still:
    """A law of one's own, whose torques follow from all that it measures."""

    def __init__(self, setup):
        self.size = len(setup.torque_limit)

    def torques(self, sensed):
        return 5.0 * np.sin(sensed.q.sum() + sensed.v.sum() + np.arange(self.size))


def base_of(law: str) -> Scenario:
    """A short run with something of everything in it that the law takes."""
    s = read_scenario("spatial/own", ["duration=0.024", "ground.slope=1.0", "ground.side_slope=1.0"])
    s = replace(
        s, fall=replace(s.fall, tilt=90.0),
        push=(Push(at=0.004, duration=0.015, force=(30.0, 20.0, 10.0), shape="sine", frequency=40.0,
                   times=2, every=0.006),),
        sensors=Sensors(angle_noise=1e-3, gyro=Gyro(range=20.0), delay=0.002),
        truth=Truth(joint_friction=0.1, part=(BodyTruth("left_thigh", mass=1.1),),
                    unmodelled=UnmodelledKeys(torque=0.02, friction=0.1, softness=0.1)),
        disturbance=Disturbance(force=(5.0, 3.0, 2.0), correlation=0.05, at=0.006),
    )  # fmt: skip
    if law == "thesis":
        return replace(s, change=(Change(at=0.006, over=0.01, gains=Gains(k_d1=9.0)),))
    s = replace(s, law="stand", controller="", actuation=Actuation(torque_limit=150.0))
    return s if law == "stand" else with_law(s, factory_of(Still))


def keys_of(value: Any, hint: Any, at: str = "") -> Iterator[tuple[str, Any]]:
    """Dotted keys with the types of their values; tables that are not there are gone through as well."""
    kinds = [kind for kind in (hint, *get_args(hint)) if isinstance(kind, type) and issubclass(kind, msgspec.Struct)]
    if LIST.get(at) is not None:
        yield from keys_of(value[0] if value else LIST[at](), LIST[at], f"{at}.0")
    elif isinstance(value, msgspec.Struct) or (value is None and kinds):
        kind = type(value) if value is not None else kinds[0]
        hints = get_type_hints(kind)
        for name in kind.__struct_fields__:
            inner = None if value is None else getattr(value, name)
            yield from keys_of(inner, hints[name], f"{at}.{name}".lstrip("."))
    else:
        yield at, hint


def other(key: str, value: Any, hint: Any) -> Any:
    """Another value than the one that is there."""
    if key in OTHERS:
        return OTHERS[key]
    choices = [choice for part in (hint, *get_args(hint)) for choice in get_args(part) if isinstance(choice, str)]
    if choices:
        return next(choice for choice in choices if choice != value)
    if isinstance(value, bool):
        return not value
    if isinstance(value, int | float):
        return 1.5 * value + type(value)(1) * 0.01 if isinstance(value, float) else value + 1
    if value:
        return tuple(1.5 * each + 0.01 for each in value)
    parts = [part for part in (hint, *get_args(hint)) if get_origin(part) is tuple]
    return tuple(7.0 for _ in get_args(parts[0])) if parts else 7.0


def put(at: Any, path: list[str], value: Any) -> Any:
    """Plain data with a value put at a path."""
    if not path:
        return value
    first, *rest = path
    if isinstance(at, list | tuple):
        return [put(each, rest, value) if i == int(first) else each for i, each in enumerate(at)]
    assert at is None or isinstance(at, dict)
    return {**(at or {}), first: put((at or {}).get(first), rest, value)}


def changed(s: Scenario, key: str, value: Any) -> Scenario:
    data = msgspec.to_builtins(s)
    if key.startswith("change.") and not s.change:
        data["change"] = [msgspec.to_builtins(Change(at=0.01))]
    if key.startswith("command."):
        data["command"] = {"piece": [msgspec.to_builtins(CommandPiece(at=0.01))]}
    for table, switch in SWITCHES.items():
        if key.startswith(table):
            for name, on in switch.items():
                data = put(data, [*table.split("."), name], on)
    return msgspec.convert(put(data, key.split("."), value), Scenario)


def done(s: Scenario) -> str:
    """What a run is and came to."""
    run = Plan(s, law=None if s.law in ("thesis", "stand") else factory_of(Still)).run(0)
    plant = MujocoPlant(run)
    found = hashlib.sha256()
    if s.law == "thesis":
        law: Any = plant.law.law
        for part in ("gait", "belief", "sensing", "backstep", "actuation"):
            found.update(law.record[0][part].tobytes())
        found.update(law.changes.steps.tobytes())
    t = drive(plant)
    for part in (t.log, t.ground.x, t.ground.z, run.q, run.v, np.array([t.tick, t.slope, t.side_slope])):
        found.update(np.ascontiguousarray(part).tobytes())
    found.update(t.end.encode())
    return found.hexdigest()


def base_and_keys(law: str) -> tuple[Scenario, list[tuple[str, Any]]]:
    s = base_of(law)
    skipped = NOT_OF_A_RUN | OF_THE_ROBOT | (TOLD if law == "own" else set())
    keys = [(key, hint) for key, hint in keys_of(s, Scenario) if not any(
        key == name or key.startswith(f"{name}.") for name in skipped)]  # fmt: skip
    return s, keys


def there(s: Scenario, key: str) -> Any:
    """What stands at a dotted key; None where its table is not there."""
    at: Any = s
    for name in key.split("."):
        at = (at[int(name)] if at else None) if isinstance(at, tuple) else getattr(at, name, None)
    return at


def names(key: str, complaint: str) -> bool:
    """Whether a complaint begins with a key, or with a table that it is in."""
    if key.endswith("gains.speed") and "gains.speed" in complaint:
        return True  # a family was asked for it
    named = key.replace(".0.", "[0].")
    parts = [key.partition(".")[0], *(named.rsplit(".", i)[0] for i in range(named.count(".") + 1))]
    return any(f"{part}: " in complaint for part in parts)


@pytest.mark.parametrize("law", ["thesis", "stand", "own"])
def test_every_key_is_read_or_refused(law):
    s, keys = base_and_keys(law)
    before = done(s)
    read, refused, passed_over = set[str](), dict[str, str](), set[str]()
    for key, hint in keys:
        try:
            after = done(changed(s, key, other(key, there(s, key), hint)))
        except InputError as error:
            refused[key] = str(error)
        else:
            (read if after != before else passed_over).add(key)
    assert [key for key, complaint in refused.items() if not names(key, complaint)] == []
    assert not passed_over
    assert len(read) > 40, "nothing that is read is seen to be"
    assert {
        "estimator.width",
        "sensing.knee_angle",
        "actuation.solver",
        "start.q",
        "ground.seat.height",
    } <= refused.keys()


@pytest.mark.parametrize(("changes", "words"), [
    (["sensing.knee_angle=0.1"], r"--set: sensing.knee_angle: expected 0.02: law 'thesis' takes .* \[sensing\]"),
    (["actuation.solver=daqp", "estimator={}"], r"estimator: expected none: .* nor of actuation.solver"),
    (["actuation.single_tangential=true"], r"actuation.single_tangential: expected false"),
    (["simulation.approximation=lagged"], r"simulation.approximation: expected 'sap': the engine 'mujoco' has no"),
    (["actuation.contacts=released"], r"actuation.contacts: expected 'pushing', got 'released'"),
    (["law=stand"], r"controller: expected none: law 'stand' takes no notice"),
    (["law=policy/h1.toml"], r"a policy's card .*; 'biped standard LAW --test SCENARIO' leaves"),
    (["law=h2.toml"], r"law: no file .*: did you mean 'policy/h1.toml'\?"),
    (["law=none_of_them.toml"], r"law: no file 'none_of_them.toml'; .*: valid: policy/h1.toml$"),
    (['change=[{at=1.0,actuation.release_force=10.0}]'], r"change\[0\].actuation.release_force: expected none"),
])  # fmt: skip
def test_what_is_refused_is_named_with_what_was_expected(changes, words):
    with pytest.raises(InputError, match=words):
        read_scenario("spatial/own", changes)


@pytest.mark.parametrize("varied", ['sweep={"sensing.knee_angle"=[0.02,0.1]}',
                                    'randomise.draw={"actuation.motors"={grid=[false,true]}}'])  # fmt: skip
def test_what_a_campaign_varies_is_asked_too(varied):
    with pytest.raises(InputError, match=r"(sensing.knee_angle|actuation.motors): expected .* takes no notice"):
        Plan(read_scenario("spatial/own", [varied, "randomise.runs=2"]))
