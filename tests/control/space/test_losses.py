"""What a swinging leg shows of its joints' losses: the factor that is true of the robot, which the law is not told."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from biped.control.observation import Observation
from biped.ensemble.plan import Plan
from biped.robot.build import compiled
from biped.scenario.reading import read_scenario
from tests.control.space.any_scene import AnyScene

JOINT, LEARNING = "actuation.mode=joint", "actuation.pushing.learning=true"


def walked(seconds: float, losses: float, *changes: str) -> AnyScene:
    """H1 after some seconds of a walk with joint torques; its joints lose a factor of what its file and law say."""
    scene = AnyScene("any/h1_walk", JOINT, "start.posture=heel_toe", *changes)
    run = Plan(read_scenario("any/h1_walk", [JOINT, f"truth.joint_losses={losses}"])).run(0)
    scene.model = compiled(run.model, run.scenario, "torque")
    scene.data = mujoco.MjData(scene.model)
    scene.sensed = Observation(scene.model, scene.data, scene.robot)
    scene.put(scene.q, scene.v)
    scene.c["actuation"]["tick"] = scene.model.opt.timestep  # not that of a scene, which stands still
    for k in range(round(seconds / scene.model.opt.timestep)):
        scene.sensed.begin(k * scene.model.opt.timestep)
        scene.data.ctrl[:] = scene.law.torques(scene.sensed)
        mujoco.mj_step2(scene.model, scene.data)
        mujoco.mj_step1(scene.model, scene.data)
    return scene


@pytest.mark.parametrize("losses", [0.5, 1.0, 1.6])
def test_a_swing_shows_the_true_factor(losses):
    scene = walked(0.5, losses, LEARNING)
    memory, worth = scene.c["memory"], scene.c["actuation"]["worth"]
    shown, weight = memory["shown"], memory["weight"]
    moved = weight > 0.3 * weight.max()  # of a joint that moves little, how fast M changes counts as much: 0.14
    assert moved.sum() >= 3
    np.testing.assert_allclose(shown[moved] / weight[moved], losses, atol=0.06)
    # H1's joints lose little for its size: the file counts as much as what one swing shows.
    common = (worth + shown.sum()) / (worth + weight.sum())
    legs = memory["factor"][-12:].reshape(2, 6)
    np.testing.assert_allclose(legs, [(shown + 4.0 * worth * common) / (weight + 4.0 * worth)] * 2)
    np.testing.assert_allclose(memory["factor"][:-12], common)
    assert np.abs(common - 1.0) >= 0.25 * np.abs(losses - 1.0)


def test_what_is_made_up_for_is_what_was_learnt():
    scene = walked(0.5, 0.5, LEARNING)
    v, belief = scene.c["at"]["v"], scene.c["belief"]
    lost = belief["damping"] * v + belief["dry"] * v / np.hypot(v, 0.05)
    assert np.abs(lost).max() > 0.5
    np.testing.assert_allclose(scene.c["tick"]["passive"], scene.c["memory"]["factor"] * lost, rtol=1e-12)


def test_a_law_that_does_not_learn_keeps_what_it_was_told():
    scene = walked(0.3, 0.5, "actuation.pushing.compensation=0.8")
    assert (scene.c["memory"]["factor"] == 0.8).all()
    assert (scene.c["memory"]["weight"] == 0.0).all()


def test_legs_that_stand_show_nothing():
    scene = walked(0.02, 0.5, LEARNING, "start.posture=flat")
    standing = [leg for leg in range(2) if not scene.c["memory"]["clear"][leg]]
    assert len(standing) == 2
    assert (scene.c["memory"]["weight"] == 0.0).all()
