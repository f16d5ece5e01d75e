"""The compiled loop of the law in space on any feet against the same run tick by tick in Python: the same digits."""

import numpy as np
import pytest

from biped.engines.loop import drive
from biped.engines.native import without_clock
from biped.engines.plant import MujocoPlant
from biped.engines.space import SpaceLoop
from biped.engines.walking import WalkingLoop
from biped.ensemble.plan import Plan
from biped.scenario.reading import read_scenario

H1 = "any/cells/level", "controller=any/apollo", "duration=1.5", "window.start=0.0"
HUMAN = "spatial/level", "duration=1.5", "window.start=0.0", "window.end=1.5"
PUSH = "push=[{at=0.4, duration=0.1, force=[30.0, 10.0, 0.0]}]"


def both(scene):
    name, *changes = scene
    run = Plan(read_scenario(name, changes)).run(0)
    with without_clock():
        plant, other = MujocoPlant(run), MujocoPlant(run)
        kind, other.compiled = plant.compiled, None
        return kind, drive(plant), drive(other)


@pytest.mark.parametrize("scene", [
    H1,
    (*H1, "simulation.timestep=0.001"),
    (*H1, PUSH),
    (*H1, "actuation.lag=0.004"),
    (*H1, "truth.joint_losses=1.3"),
    (*H1, "randomise.masses=0.05"),
    (*H1, "truth.strength=0.8"),
    (*H1, "simulation.cone=pyramidal"),
    (*H1, "control.mechanics=engine"),
    (*H1, "sensors={angle_noise=0.001, rate_noise=0.02, height_noise=0.001}", "randomise.masses=0.05"),
    (*H1, "sensors={zero_error=0.002, quantisation=0.001, delay=0.002}"),
    (*H1, "sensors.delay=0.004", PUSH),
    (*H1, "randomise.controller_mass_matrix=0.1"),
    (*H1, "change=[{at=0.5, over=0.2, controller='any/stand'}]"),
    (*HUMAN, "actuation.lag=0.004"),
    (*HUMAN, "truth.strength=0.9"),
    (*HUMAN, PUSH, "actuation.lag=0.002"),
], ids=lambda scene: " ".join(scene[4:] if scene[0] != "spatial/level" else ("human", *scene[4:])) or "h1")  # fmt: skip
def test_the_same_digits_as_in_python(scene):
    kind, compiled, python = both(scene)
    assert isinstance(kind, WalkingLoop)
    assert (compiled.end, compiled.cause) == (python.end, python.cause)
    assert len(compiled) > 500
    assert np.array_equal(compiled.log, python.log, equal_nan=True)
    assert np.array_equal(compiled.outside, python.outside, equal_nan=True)


@pytest.mark.slow
@pytest.mark.parametrize("scene", [
    (*H1, "sensors.angle_noise=0.001", "randomise.controller_constraints=0.05"),
    (*HUMAN, "sensors.rate_noise=0.02"),
], ids=["mistaken", "human"])  # fmt: skip
def test_the_same_digits_with_noise_on(scene):
    kind, compiled, python = both(scene)
    assert isinstance(kind, WalkingLoop)
    assert len(compiled) > 500
    assert np.array_equal(compiled.log, python.log, equal_nan=True)


def test_a_fall_is_the_same():
    kind, compiled, python = both(("any/cells/level", "controller=any/apollo"))
    assert isinstance(kind, WalkingLoop)
    assert compiled.end == "fell"
    assert compiled.cause == python.cause
    assert np.array_equal(compiled.log, python.log, equal_nan=True)


@pytest.mark.parametrize(("change", "compiled"), [
    ("sensors.gyro={noise=0.001}", None),
    ("actuation.delay=0.004", None),
    ("control.mechanics=pinocchio", None),
    ("actuation.assist=0.5", None),
    ("truth.unmodelled.torque=0.05", None),
])  # fmt: skip
def test_what_ticks_in_python(change, compiled):
    run = Plan(read_scenario(H1[0], [*H1[1:], change])).run(0)
    assert MujocoPlant(run).compiled is compiled


def test_eight_spheres_have_their_own_loop():
    """With masses of its own the true robot is walked there too, on the matrices of the file."""
    name, *changes = HUMAN
    for change in (
        (),
        ("randomise.masses=0.05",),
        ("truth.joint_friction=0.5",),
        ("randomise.controller_constraints=0.1",),
    ):
        run = Plan(read_scenario(name, [*changes, *change])).run(0)
        assert isinstance(MujocoPlant(run).compiled, SpaceLoop)


@pytest.mark.parametrize("change", [
    (), ("randomise.masses=0.1",), ("randomise.controller_constraints=0.1",),
], ids=["file", "masses", "mistaken"])  # fmt: skip
def test_what_is_measured_of_eight_spheres_is_the_robots_own(change):
    """Not what the law believes of its masses."""
    kind, compiled, python = both((*HUMAN, "duration=0.4", "window.end=0.4", *change))
    assert isinstance(kind, SpaceLoop)
    for quantity in ("com", "com_velocity", "energy", "spin"):
        np.testing.assert_allclose(getattr(compiled, quantity), getattr(python, quantity), rtol=1e-9, atol=1e-9)


def test_torques_that_are_not_finite_end_a_run():
    run = Plan(read_scenario(H1[0], list(H1[1:]))).run(0)
    plant = MujocoPlant(run)
    plant.law.law.record["gait"]["k"][:] = np.nan
    with pytest.raises(Exception, match="expected finite numbers"):
        drive(plant)
