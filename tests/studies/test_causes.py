"""Causes of a difference as a detector: differences that were planted are named, in a plane and in space."""

from __future__ import annotations

import json
from dataclasses import replace

import mujoco
import numpy as np
import pytest

from biped.cli import main as cli
from biped.ensemble.campaign import simulate
from biped.studies.causes import causes, movable
from biped.studies.dials import CAUSES
from biped.studies.run import plan_of

SLOW_CONTROL = ("duration=3.0", "window.start=1.0", "window.end=3.0", "simulation.control_rate=200",
                "ground.contact_time=0.01")  # fmt: skip
"""A tick of 5 ms, which a step of 5 ms fits into, and contacts that such a step resolves."""


def no_armature(m):
    m.dof_armature[:] = 0.0
    mujoco.mj_setConst(m, mujoco.MjData(m))


def heavier(m):
    trunk = int(np.argmax(m.body_mass))
    m.body_mass[trunk] *= 1.1
    m.body_inertia[trunk] *= 1.1
    mujoco.mj_setConst(m, mujoco.MjData(m))


def softer(m):
    m.pair_solref[:, 0] *= 3.7
    m.geom_solref[:, 0] *= 3.7


def no_limits(m):
    m.jnt_limited[:] = 0


def heavy_ground(m):
    m.opt.gravity *= 1.05


PLANTED = {
    "step": (("simulation.timestep=0.005",), None),
    "friction": (("ground.friction=0.3",), None),
    "contact time": ((), softer),
    "armature": ((), no_armature),
    "joint limits": ((), no_limits),
    "gravity": ((), heavy_ground),
    "mass": ((), heavier),
    "solver": (("simulation.iterations=1",), None),
    "cone": (("simulation.cone=pyramidal",), None),
    "joint damping": (("truth.joint_damping=0.17",), None),
}


def found(name, cause):
    """What is found of a planted difference."""
    changes, edit = PLANTED[cause]
    run = replace(plan_of(name, [*SLOW_CONTROL, *changes]).run(0), edit=edit)
    return causes(name, SLOW_CONTROL, simulate(run), "mujoco", f"planted {cause}")


@pytest.mark.slow
def test_a_planted_difference_is_named_with_its_size():
    """The friction that was planted is not among those that are tried first."""
    why = found("upright/own", "friction")
    assert why.named == ["friction"]
    assert why.tried[0].explained > 0.95
    assert why.tried[0].left < 0.05
    assert why.verdict().startswith("friction: friction × ")
    assert {one.cause for one in why.tried} <= set(CAUSES)


def test_what_is_the_same_has_no_cause():
    towards = simulate(plan_of("robot/own", SLOW_CONTROL).run(0))
    why = causes("robot/own", SLOW_CONTROL, towards, "mujoco", "itself")
    assert why.named == []
    assert why.verdict() == "mujoco and itself behave the same in robot/own"


def test_an_edit_is_this_runs_alone_and_the_law_does_not_know_of_it():
    run = plan_of("robot/own", ("duration=0.3", "window.start=0.1", "window.end=0.3")).run(0)
    before = simulate(run)
    edited = simulate(replace(run, edit=no_armature))
    assert edited.log.tobytes() != before.log.tobytes()
    np.testing.assert_array_equal(edited.Q_d[0], before.Q_d[0])
    assert simulate(run).log.tobytes() == before.log.tobytes()


def test_the_engine_that_is_changed_is_one_whose_contacts_give_way():
    assert movable(["home", "mujoco"]) == "mujoco"
    assert movable(["drake", "mujoco"]) == "drake"


@pytest.mark.slow
def test_command_says_why_two_settings_differ(capsys):
    changes = [part for change in SLOW_CONTROL for part in ("--set", change)]
    assert cli.main(["compare", "robot/own", *changes, "--against", "simulation.cone=pyramidal", "--json"]) == 0
    (printed,) = [json.loads(capsys.readouterr().out)]
    assert printed["named"] == ["cone"]


@pytest.mark.slow
@pytest.mark.parametrize("name", ["robot/own", "spatial/own"])
def test_nine_of_ten_planted_differences_are_named(name):
    """Each alone, but where it makes no difference: the human in space has no armature, for example."""
    named = {cause: why.named for cause in PLANTED if (why := found(name, cause)).difference > 0.0}
    right = sum(found_there == [cause] for cause, found_there in named.items())
    assert len(named) >= 9  # of ten: the human in space has no armature
    assert right >= 0.9 * len(named) - 1e-9, named
