"""The compiled loop is the Python loop, bit for bit, whatever a scene asks for."""

from __future__ import annotations

import msgspec
import numpy as np
import pytest

from biped.engines import home
from biped.engines.planar import mujoco as engine
from biped.ensemble.plan import Plan
from biped.scenario.devices import Actuation, ActuationChange, Change, Encoders, Estimator, Gyro, Pushing, Switches
from biped.scenario.gains import Gains
from biped.scenario.keys import Backstep, Fall, Scenario, Sensors, Simulation, Start, Truth
from biped.scenario.randomise import Randomise
from biped.scenario.world import Ground, Push, Tiles, UnmodelledKeys

WALK = Scenario(duration=0.6, start=Start(posture="heel_toe"))
SENSES = Sensors(encoders=Encoders(reference_error=0.1), gyro=Gyro(), switches=Switches(debounce=0.001))
SCENES = {
    "plain": {},
    "generalized": {"actuation": Actuation(mode="generalized")},
    "every touching point": {"actuation": Actuation(contacts="touching", null_torque=(1.0, 0.0, 0.0, 1.0, 0.0, 0.0))},
    "lag": {"actuation": Actuation(lag=0.002)},
    "generalized lag": {"actuation": Actuation(mode="generalized", lag=0.002)},
    "sensors": {"sensors": Sensors(angle_noise=1e-4, rate_noise=1e-3, height_noise=1e-4, quantisation=1e-4)},
    "delay": {"sensors": Sensors(delay=0.002)},
    "push": {"push": (Push(at=0.1, duration=0.2, force=(80.0, 10.0)),
                      Push(at=0.2, duration=0.2, force=(-40.0, 0.0), body="left_shank"))},
    "sub-steps": {"simulation": Simulation(timestep=5e-4)},
    "RK4": {"simulation": Simulation(integrator="RK4")},
    "pyramidal": {"simulation": Simulation(cone="pyramidal")},
    "slow control": {"simulation": Simulation(control_rate=500.0)},
    "truth": {"truth": Truth(mass=(1.2, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0), joint_damping=0.5)},
    "unmodelled torques": {"truth": Truth(unmodelled=UnmodelledKeys(torque=0.05))},
    "unmodelled torques, lag": {"truth": Truth(unmodelled=UnmodelledKeys(torque=0.05)),
                                "actuation": Actuation(lag=0.002)},
    "model error": {"randomise": Randomise(controller_mass_matrix=0.05, controller_constraints=0.05)},
    "model error at every tick": {"randomise": Randomise(controller_mass_matrix=0.05, controller_constraints=0.05,
                                                         controller_errors="tick")},
    "backstep": {"backstep": Backstep()},
    "changes": {"change": (Change(at=0.1, over=0.2, gains=Gains(theta_b=80.0)),
                           Change(at=0.2, gains=Gains(k_d1=500.0)),
                           Change(at=0.35, actuation=ActuationChange(contacts="touching", release_force=50.0)))},
    "observer": {"truth": Truth(unmodelled=UnmodelledKeys(torque=0.05)), "actuation": Actuation(observer=200.0)},
    "pushing": {"actuation": Actuation(contacts="pushing"), "controller": "calm"},
    "pushing, smoothed": {"actuation": Actuation(contacts="pushing", pushing=Pushing(stops=False, smoothing=0.003)),
                          "controller": "calm"},
    "pushing, lag and change": {"actuation": Actuation(contacts="pushing", lag=0.002, torque_limit=80.0),
                                "change": (Change(at=0.2, over=0.2, gains=Gains(theta_b=80.0)),)},
    "estimator": {"model": "robot", "controller": "robot", "sensors": SENSES, "estimator": Estimator(),
                  "backstep": Backstep()},
    "estimator, pushing, motors": {"model": "robot", "controller": "robot", "sensors": SENSES, "estimator": Estimator(),
                                   "actuation": Actuation(contacts="pushing", motors=True, torque_limit=20.0)},
    "an arm": {"truth": Truth(hip_mass=2.0)},
    "tiles": {"ground": Ground(tiles=Tiles(height=0.02, length=0.1, start=0.5)), "start": Start(posture="flat")},
    "tiles, sub-steps, pyramidal": {"ground": Ground(tiles=Tiles(height=0.02, length=0.1, start=0.5)),
                                    "simulation": Simulation(timestep=5e-4, cone="pyramidal")},
    "sine": {"push": (Push(at=0.1, duration=0.3, force=(60.0, 0.0), shape="sine", frequency=5.0),)},
    "fall": {"fall": Fall(tilt=15.7), "start": Start(posture="single")},
}  # fmt: skip


def both(scenario: Scenario, monkeypatch):
    run = Plan(scenario).run(0)
    asked = []
    monkeypatch.setattr(engine, "native_of", lambda *given: asked.append(given))
    plain = engine.simulate(run)
    assert asked
    monkeypatch.undo()
    return engine.simulate(run), plain


@pytest.mark.parametrize("scene", SCENES)
def test_the_same_bits_as_in_python(scene, monkeypatch):
    ours, plain = both(msgspec.structs.replace(WALK, **SCENES[scene]), monkeypatch)
    assert (ours.end, ours.cause, ours.warnings) == (plain.end, plain.cause, plain.warnings)
    np.testing.assert_array_equal(ours.log, plain.log)
    assert ours.force.any()


@pytest.mark.parametrize(
    "scene",
    ["plain", "generalized lag", "delay", "push", "sub-steps", "changes", "pushing", "fall", "unmodelled torques, lag"],
)
def test_the_same_bits_as_in_python_at_home(scene, monkeypatch):
    run = Plan(msgspec.structs.replace(WALK, engine="home", **SCENES[scene])).run(0)
    ours = home.simulate(run)
    monkeypatch.setattr(home, "COMPILED", False)
    monkeypatch.setattr(home, "walk_rigid", None)
    plain = home.simulate(run)
    assert (ours.end, ours.cause, ours.warnings) == (plain.end, plain.cause, plain.warnings)
    np.testing.assert_array_equal(ours.log, plain.log)


def test_the_fall_is_one():
    assert engine.simulate(Plan(msgspec.structs.replace(WALK, **SCENES["fall"])).run(0)).end == "fell"


def test_a_number_that_is_not_finite_ends_both(monkeypatch):
    wild = msgspec.structs.replace(WALK, start=Start(posture="flat", v=(0.0, 0.0, *[1e155] * 7)))
    ours, plain = both(wild, monkeypatch)
    assert ours.end == plain.end == "diverged"
    assert ours.warnings == plain.warnings
    assert len(ours) == len(plain)


def test_calls_are_short_enough_for_an_interrupt(monkeypatch):
    """Cut anywhere, the run stays the same."""
    whole = engine.simulate(Plan(WALK).run(0))
    monkeypatch.setattr("biped.engines.loop.MOST", 7)
    np.testing.assert_array_equal(engine.simulate(Plan(WALK).run(0)).log, whole.log)
