"""The momentum of honest runs closes; whatever holds or drives a robot from outside is found, and said where."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest

from biped.base.trust import grant
from biped.engines.mujoco import simulate
from biped.measure.metrics import assess
from biped.measure.momentum import leftover, unexplained
from biped.measure.stored import load
from biped.robot.ground import GRAVITY
from biped.studies.run import plan_of
from tests.runs import made

NOISE = 0.005
"""Of the weight: what sound runs leave unexplained over 0.2 s, with room."""
WINDOW = (0.0, 1.0)


def law_of(tmp_path: Path, body: str, setup: str = "pass") -> str:
    path = tmp_path / "l.py"
    path.write_text(
        "import numpy as np\nfrom biped.control.stand import stand\n\n\nclass Law:\n"
        f"    def __init__(self, setup):\n        self.own = stand(setup)\n        {setup}\n\n"
        f"    def torques(self, sensed):\n        {body}\n        return self.own.torques(sensed)\n",
        encoding="utf-8",
    )
    grant(path)
    return f"law={path}:Law"


def ran(name: str, *changes: str):
    alone = ["randomise.runs=1", "randomise.draw={}", "push=[]"] if name.startswith("any") else []
    window = ["duration=1.0", "window.start=0.0", "window.end=1.0"]
    return simulate(plan_of(name, [*window, *alone, *changes]).run(0))


@pytest.mark.parametrize("name", ["walk", "slope", "slippery", "pushed", "generalized", "pyramidal"])
def test_the_momentum_of_seven_links_closes(name):
    left = unexplained(made(name))
    assert 0.0 <= left.force[0].share < NOISE
    assert 0.0 <= left.moment[0].share < NOISE


@pytest.mark.parametrize(
    ("name", "changes"),
    [("any/h1", ("ground.side_slope=2.0", "push=[{at=0.2,duration=0.1,force=[30,20,10],body='left_shank'}]")),
     ("any/humanoid", ()), ("any/walker2d", ("ground.slope=1.5",)),
     ("spatial/level", ("push=[{at=0.2,duration=0.1,force=[30,20,10]}]",)),
     ("spatial/level", ("push=[{at=0.2,duration=0.1,force=[30,20,10],body='left_foot'}]",)),
     ("spatial/level", ("actuation.mode=generalized", "controller=human3d_generalized"))],
)  # fmt: skip
def test_the_momentum_of_any_robot_closes(name, changes):
    t = ran(name, *changes)
    left = unexplained(t)
    assert 0.0 <= left.force[0].share < NOISE
    assert 0.0 <= left.moment[0].share < NOISE
    assert assess(t, WINDOW).numbers["verdict"] == "sound"


def test_a_push_that_is_not_declared_is_found_in_all_directions():
    """What is left over is that push: its impulse in each direction."""
    t = ran("any/h1", "push=[{at=0.4,duration=0.2,force=[30,20,10],body='left_shank'}]")
    hidden = t.outside.copy()
    hidden[400:600, 3:6] -= [30.0, 20.0, 10.0]
    hushed = replace(t, outside=hidden)
    for column, force in enumerate((30.0, 20.0, 10.0)):
        assert leftover(hushed, column)[-1] == pytest.approx(0.2 * force, abs=0.05)
    judged = assess(hushed, WINDOW).numbers
    assert judged["verdict"] == "doubtful"
    assert "something else holds or drives it: 30 N forward at 0.5" in judged["doubt"]


@pytest.mark.parametrize(
    ("at", "end", "found"), [(0.4, "fell", True), (0.955, "fell", False), (0.955, "completed", True)]
)
def test_the_last_moments_of_a_fall_are_not_asked_about(at, end, found):
    """A robot that collapses crashes into the ends of its joints; what holds it up until then is found."""
    t = ran("any/h1", f"push=[{{at={at},duration=0.045,force=[60,40,20],body='left_shank'}}]")
    hidden = t.outside.copy()
    hidden[round(1000 * at) : round(1000 * at) + 45, 3:6] = 0.0
    left = unexplained(replace(t, outside=hidden, end=end))
    assert (left.force[0].share > 0.01) == found


def test_angular_momentum_is_that_of_mujoco():
    plan = plan_of(
        "any/h1",
        [
            "duration=0.3",
            "randomise.runs=1",
            "randomise.draw={}",
            "push=[{at=0.1,duration=0.1,force=[30,20,10],body='left_shank'}]",
        ],
    )
    seen = []

    def watch(model, data, _):
        mujoco.mj_forward(model, data)
        mujoco.mj_subtreeVel(model, data)
        seen.append(data.subtree_angmom[1].copy())

    t = simulate(plan.run(0), watch=watch)
    np.testing.assert_allclose(t.spin[1:], seen[:-1], atol=1e-9)
    assert np.abs(t.spin).max() > 0.05


HELP = {
    "a force on the trunk": "sensed._data.xfrc_applied[1, 0] = 15.0",
    "a force that holds it up": "sensed._data.xfrc_applied[1, 2] = 15.0",
    "a moment": "sensed._data.xfrc_applied[1, 4] = 15.0",
    "a moment about the vertical": "sensed._data.xfrc_applied[1, 5] = 15.0",
    "a force on a foot": "sensed._data.xfrc_applied[-1, 0] = 15.0",
    "forces on the base": "sensed._data.qfrc_applied[2] = 15.0",
    "less gravity": "sensed._model.opt.gravity[2] = -9.3",
    "a lighter trunk": "sensed._model.body_mass[1] *= 0.9",
    "a damper": "sensed._model.dof_damping[:6] = 5000.0",
    "velocities that are set": "sensed._data.qvel[:6] *= 0.97",
    "places that are set": "sensed._data.qpos[0] += 0.0004",
    "wind": "sensed._model.opt.density, sensed._model.opt.wind[0] = 1000.0, 3.0",
}


@pytest.mark.parametrize("how", HELP)
def test_a_law_that_holds_its_robot_is_found(tmp_path, how):
    push = "push=[{at=0.3,duration=0.1,force=[20,10,0]}]"
    assert assess(ran("any/h1", push), WINDOW).numbers["verdict"] == "sound"
    numbers = assess(ran("any/h1", push, law_of(tmp_path, HELP[how])), WINDOW).numbers
    assert "something else holds or drives it" in numbers["doubt"]
    assert not numbers["stood"]


def test_a_law_of_generalized_forces_holds_its_robot(tmp_path):
    path = tmp_path / "l.py"
    path.write_text('class Law:\n    command = "generalized"\n    def __init__(self, setup):\n        pass\n'
                    "    def torques(self, sensed):\n        return sensed.h.copy()\n", encoding="utf-8")  # fmt: skip
    grant(path)
    numbers = assess(ran("any/walker2d", f"law={path}:Law"), WINDOW).numbers
    assert numbers["doubt"].count("something else holds or drives it") == 1
    assert numbers["unexplained_force"] == pytest.approx(1.0, abs=0.02), "all of its weight"


def test_a_torso_that_is_held_upright_is_found():
    """Seven links on whose torso a moment acts that nobody declared: generalized forces that are said to be none."""
    t = made("generalized")
    assert assess(t, WINDOW).numbers["verdict"] == "sound"
    numbers = assess(replace(t, generalized=False), WINDOW).numbers
    assert "something else holds or drives it" in numbers["doubt"]
    assert "about the axis to the left" in numbers["doubt"]


def test_runs_of_earlier_versions_say_nothing(tmp_path):
    t = ran("any/walker2d", "duration=0.3", "window.end=0.3")
    t.save(tmp_path / "t.npz")
    np.testing.assert_array_equal(load(tmp_path / "t.npz").outside, t.outside)
    old = replace(t, outside=None)
    old.save(tmp_path / "old.npz")
    again = load(tmp_path / "old.npz")
    assert again.spin is None
    assert unexplained(again).force[0].share == 0.0
    assert t.mass * GRAVITY > 0.0
