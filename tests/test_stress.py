"""What a run does when everything is extreme: an answer whose sentinels hold, or a failure that says so.

Three outcomes are told apart, and each case says which it must have. *Sound*: the run completed or fell, every number
is finite, the engine warned of nothing and every sentinel holds. *Flagged*: the run is called doubtful, and says which
sentinel failed. *Failed*: the run is called diverged and its cause names the time and the quantity.
"""

from __future__ import annotations

import re

import numpy as np
import pytest

from biped.control.planar.senses import PlanarSensors
from biped.ensemble.campaign import simulate
from biped.measure.metrics import assess
from biped.measure.trajectory import Trajectory
from biped.robot.ground import GRAVITY
from biped.robot.planar.tree import motion
from biped.studies.run import plan_of

SOUND, FLAGGED, FAILED = "sound", "flagged", "failed"

UPRIGHT = "1.5707963267948966"
TOGETHER = f"start.q=[0,1.3,{UPRIGHT},{UPRIGHT},{UPRIGHT},0,{UPRIGHT},{UPRIGHT},0]"
AIR = ("start.q=[0,5,1.57,1.8,1.8,0,1.3,1.3,0]", "start.settle=false")
HEAD_DOWN = ("start.q=[0,1.3,-1.57,-1.57,-1.57,3.14159,-1.57,-1.57,3.14159]", "start.settle=false")


def at_rest(force: str) -> str:
    return f"push=[{{at=0.2,duration=0.1,force={force}}}]"


# Name: changes, outcome with joint torques, outcome with generalized forces.
CASES: dict[str, tuple[tuple[str, ...], str, str]] = {
    "contacts as stiff as the step allows": (("ground.contact_time=0.002",), SOUND, SOUND),
    "contacts of a mattress": (("ground.contact_time=0.1",), SOUND, SOUND),
    "contacts that hardly damp": (("ground.damping_ratio=0.01",), FAILED, FAILED),
    "contacts of honey": (("ground.damping_ratio=100.0",), SOUND, SOUND),
    "no friction": (("ground.friction=0.0",), SOUND, SOUND),
    "hardly any friction": (("ground.friction=1e-6",), SOUND, SOUND),
    "friction 10": (("ground.friction=10.0",), SOUND, SOUND),
    "friction 1000": (("ground.friction=1000.0",), SOUND, SOUND),
    "impratio 1e6": (("simulation.impratio=1e6",), SOUND, SOUND),
    "feet of a tonne": (("truth.mass=[1,1,1,1e3,1,1,1e3]",), SOUND, SOUND),
    "feet of a milligram": (("truth.mass=[1,1,1,1e-6,1,1,1e-6]",), FAILED, FAILED),
    "torso of fifty thousand tonnes": (("truth.mass=[1e6,1,1,1,1,1,1]",), SOUND, SOUND),
    "legs straight and together": ((TOGETHER,), SOUND, SOUND),
    "upside down": (HEAD_DOWN, SOUND, SOUND),
    "half a metre below the ground": (("start.q=[0,0.9,1.57,1.8,1.8,0,1.3,1.3,0]", "start.settle=false"),
                                      FAILED, FAILED),
    "1 km/s": (("start.v=[1000,0,0,0,0,0,0,0,0]",), FAILED, FAILED),
    "spinning at 1000 rad/s": (("start.v=[0,0,1000,1000,1000,1000,1000,1000,1000]",), FAILED, FAILED),
    "spinning at 1e8 rad/s": (("start.v=[0,0,1e8,0,0,0,0,0,0]",), FAILED, FAILED),
    "pushed by 10 kN": ((at_rest("[10000.0,0.0]"),), SOUND, SOUND),
    "pressed down by 10 kN": ((at_rest("[0.0,-10000.0]"),), SOUND, SOUND),
    "pushed by a rocket": ((at_rest("[1e9,1e9]"),), FAILED, FAILED),
    "pushed by 1e15 N": ((at_rest("[1e15,1e15]"),), FAILED, FAILED),
    "denormal numbers": (("start.v=[5e-324,1e-310,1e-310,0,0,0,0,0,0]", at_rest("[1e-310,5e-324]")), SOUND, SOUND),
    "no gains": (("gains.k_d1=0.0", "gains.b_d1=0.0"), SOUND, SOUND),
    "torques of a watch": (("actuation.torque_limit=1e-9",), SOUND, SOUND),
    "torques without limit": (("actuation.torque_limit=1e9",), SOUND, SOUND),
    "one solver iteration": (("simulation.iterations=1",), FAILED, FAILED),
    "solver tolerance 1": (("simulation.tolerance=1.0",), FLAGGED, FLAGGED),
    # Q_d jumps by kilonewtons from tick to tick: what it does to the torso cannot be accounted for.
    "angles measured to ten radians": (("sensors.angle_noise=10.0",), SOUND, FLAGGED),
    "RK4": (("simulation.integrator=RK4",), SOUND, SOUND),
    "implicit": (("simulation.integrator=implicit",), SOUND, SOUND),
    "implicitfast": (("simulation.integrator=implicitfast",), SOUND, SOUND),
    "discrete": (("simulation.integrator=discrete",), SOUND, SOUND),
    "20 ms steps": (("simulation.timestep=0.02", "simulation.control_rate=50.0", "ground.contact_time=0.04"),
                    FAILED, FAILED),
}  # fmt: skip


def run(*changes: str, seconds: float = 0.6) -> Trajectory:
    plan = plan_of(
        "level_normal",
        ["reading=clipped", f"duration={seconds}", "window.start=0.0", f"window.end={seconds}", *changes],
    )
    return simulate(plan.run(0))


def outcome(t: Trajectory) -> str:
    t, numbers = assess(t, (0.0, 10.0))
    assert np.isfinite(t.log).all()
    if numbers["verdict"] != "sound":
        why = numbers["doubt"] or t.cause
        assert re.search(r"\d\.\d{3} s", why), "the time"
        assert re.search(
            r"coordinate|faster than any fall|accounted for|from nowhere|holds or drives it|warned of bad", why
        ), "what"
        assert not numbers["walked"]
        return FAILED if numbers["verdict"] == "diverged" else FLAGGED
    assert t.end in ("completed", "fell")
    assert t.warnings == {}, "an engine that warns has failed"
    return SOUND


@pytest.mark.parametrize("mode", ["joint", "generalized"])
@pytest.mark.parametrize("name", CASES)
def test_extreme(name, mode):
    changes, joint, generalized = CASES[name]
    assert outcome(run(f"actuation.mode={mode}", *changes)) == (joint if mode == "joint" else generalized)


def test_in_flight_the_centre_of_mass_follows_its_parabola():
    """Whatever the legs do, and to the digits of a fourth-order method."""
    t = run(*AIR, "simulation.integrator=RK4", seconds=0.4)
    m = motion(t.tree, t.q, t.v)
    share = t.tree.mass / t.tree.mass.sum()
    com = (m.com * share[:, None]).sum(axis=1)
    assert np.abs(t.u).max() > 10.0, "the legs do something"
    assert t.force.max() == 0.0
    assert com[:, 1] == pytest.approx(com[0, 1] - 0.5 * GRAVITY * t.time**2, abs=1e-6)
    assert com[:, 0] == pytest.approx(com[0, 0], abs=1e-6)


def test_on_ice_only_a_push_changes_the_momentum():
    """Without friction nothing else acts along the ground: m Δv is force × time, here 1000 N s.

    In RK4: Euler's steps keep momentum only to first order, 0.1 % here.
    """
    t = run("ground.friction=0.0", "simulation.integrator=RK4", at_rest("[10000.0,0.0]"))
    m = motion(t.tree, t.q, t.v)
    momentum = (t.tree.mass * m.com_velocity[..., 0]).sum(axis=1)
    assert np.abs(t.force[..., 0]).max() < 1e-4 * t.force[..., 2].max()
    assert momentum[:200] == pytest.approx(0.0, abs=0.5)
    assert momentum[300] == pytest.approx(1000.0, rel=1e-3)


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_a_sensor_that_fails(monkeypatch, bad):
    made = PlanarSensors.__init__

    def broken(self, *arguments):
        made(self, *arguments)
        self.noise[1, 150:, 4] = bad

    monkeypatch.setattr(PlanarSensors, "__init__", broken)
    t = run("sensors.angle_noise=1e-6")
    assert outcome(t) == FAILED
    assert assess(t, (0.0, 0.6)).numbers["time"] == 0.149
    assert len(t) == 151
    assert "0.149 s" in t.cause


def test_random_torques(tmp_path):
    law = tmp_path / "noise.py"
    law.write_text(
        "import numpy as np\n\n\nclass Noise:\n"
        "    def __init__(self, setup):\n        self.rng = np.random.default_rng(0)\n"
        "    def torques(self, sensed):\n        return 200.0 * self.rng.uniform(-1.0, 1.0, 6)\n",
        encoding="utf-8",
    )
    assert outcome(run(f"law={law}:Noise", seconds=1.0)) == SOUND, "steps of 1 ms miss 0.4 % of what its fall sets free"


def test_there_are_enough_cases():
    assert len({changes for changes, *_ in CASES.values()}) == len(CASES) >= 30


@pytest.mark.slow
def test_ten_minutes_of_walking():
    plan = plan_of("level_slow_generalized", ["duration=600.0", "window.start=300.0", "window.end=600.0"])
    t = simulate(plan.run(0))
    assert t.end == "completed"
    assert t.warnings == {}
    assert np.isfinite(t.log).all()
    minutes = t.q[::60_000, 0]
    assert np.ptp(np.diff(minutes)[1:]) < 0.01 * np.diff(minutes)[1:].mean(), "no drift from minute to minute"
    weight = t.tree.mass.sum() * GRAVITY
    assert t.force[60_000:, :, 2].sum(axis=1).mean() == pytest.approx(weight, rel=1e-3)
