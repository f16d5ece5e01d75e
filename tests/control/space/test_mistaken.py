"""A law in space that is mistaken about masses and lengths: what it believes in, and what it still senses."""

import copy

import mujoco
import numpy as np
import pytest

from biped.base.errors import InputError
from biped.control.space.law import Spatial
from biped.control.space.mistaken import mistaken_own
from biped.control.space.own import compute
from biped.engines.loop import drive
from biped.engines.plant import MujocoPlant
from biped.ensemble.plan import Plan
from biped.scenario.reading import read_scenario
from biped.scenario.vary import stream
from tests.control.space.any_scene import AnyScene

WRONG = "randomise.controller_mass_matrix=0.1", "randomise.controller_constraints=0.1"
WALKS = pytest.mark.parametrize("walk", [
    ("any/cells/level", "model=human3d", "controller=any/steady"), ("any/cells/level", "model=h1", "controller=any/h1"),
], ids=["human3d", "h1"])  # fmt: skip


def with_mistakes(model: mujoco.MjModel, seed: int) -> mujoco.MjModel:
    """MuJoCo's model of what the law believes in, by its own names."""
    out = copy.copy(model)
    heavier = 1.0 + 0.1 * stream(seed, "controller_mass_matrix").standard_normal((model.nbody, 1))
    longer = 1.0 + 0.1 * stream(seed, "controller_constraints").standard_normal((model.nbody, 3))
    out.body_mass *= heavier[:, 0]
    out.body_inertia *= heavier
    out.body_pos *= longer
    mujoco.mj_setConst(out, mujoco.MjData(out))  # masses of sub-trees
    return out


@WALKS
def test_the_mechanics_are_those_of_a_model_with_other_masses_and_lengths(walk):
    scene = AnyScene(*walk, *WRONG)
    other = with_mistakes(scene.model, scene.setup.seed)
    data = mujoco.MjData(other)
    own = mistaken_own(scene.c, scene.setup, data.qpos, data.qvel)
    assert own is not None
    for q, v in scene.states(3):
        data.qpos[:], data.qvel[:] = q, v
        mujoco.mj_step1(other, data)
        compute(*own)
        assert pytest.approx(data.M, rel=1e-9, abs=1e-9) == own.mechanics.M
        assert own.mechanics.axes == pytest.approx(data.cdof, rel=1e-9, abs=1e-9)


@WALKS
def test_torques_are_others_but_leg_states_and_springs_are_not(walk):
    right, wrong, hardly = (
        AnyScene(*walk, *changes) for changes in ((), WRONG, [change.replace("0.1", "1e-10") for change in WRONG])
    )
    for q, v in right.states(5):
        torques = []
        for scene in (right, wrong, hardly):
            scene.put(q, v)
            torques.append(scene.torques())
        scale = np.abs(torques[0]).max()
        assert np.abs(torques[1] - torques[0]).max() > 1e-3 * scale
        assert torques[2] == pytest.approx(torques[0], abs=1e-5 * scale)
        assert np.array_equal(wrong.c["tick"]["Q_d"], right.c["tick"]["Q_d"])
        assert np.array_equal(wrong.c["memory"]["phase"], right.c["memory"]["phase"])
        assert np.array_equal(wrong.c["at"]["height"], right.c["at"]["height"])


def test_every_run_has_mistakes_of_its_own():
    plan = Plan(read_scenario("any/cells/level", [
        "model=human3d", "controller=any/steady", "duration=0.1", "window.start=0.0", "start.jitter=0.0", *WRONG,
    ]))  # fmt: skip
    first, again, second = (drive(MujocoPlant(plan.run(i))).log for i in (0, 0, 1))
    assert np.array_equal(first, again, equal_nan=True)
    assert not np.array_equal(first, second, equal_nan=True)


@pytest.mark.parametrize(("change", "words"), [
    ("randomise.controller_errors=tick", "randomise.controller_errors: expected"),
    ("actuation.mode=generalized", "randomise.controller_mass_matrix: expected 0, or actuation.mode = 'joint'"),
])  # fmt: skip
def test_mistakes_that_nobody_would_notice_are_refused(change, words):
    with pytest.raises(InputError, match=words):
        Plan(read_scenario("any/cells/level", ["model=human3d", "controller=any/steady", *WRONG, change]))


def test_no_mistakes_are_none():
    scene = AnyScene("any/cells/level", "model=human3d", "controller=any/steady")
    assert not Spatial(scene.setup).mistaken
    assert mistaken_own(scene.c, scene.setup, scene.data.qpos, scene.data.qvel) is None
