"""Joints that are taken out of a model file: everything else is where it was, and weighs what it weighed."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from biped.base.errors import InputError
from biped.base.files import locate
from biped.robot.anatomy import anatomy_of
from biped.robot.recognise import looked_at, robot_of
from biped.robot.spec import parsed
from biped.scenario.robot import Described

PATH = locate("models", "h1", "model")
ARMS = tuple(f"{side}_{joint}" for side in ("right", "left") for joint in
             ("shoulder_pitch", "shoulder_roll", "shoulder_yaw", "elbow"))  # fmt: skip
STIFF = Described(rigid=(*ARMS, "torso"))


def state(model, joints):
    """Data of a model whose named joints have these angles, at the first keyframe otherwise."""
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    for name, angle in joints.items():
        data.qpos[model.jnt_qposadr[model.joint(name).id]] = angle
    mujoco.mj_forward(model, data)
    return data


def test_bodies_and_the_mass_matrix_are_those_of_the_robot_with_its_joints_at_rest():
    full, stiff = parsed(PATH, Described())[1], parsed(PATH, STIFF)[1]
    assert stiff.nv == full.nv - len(STIFF.rigid)
    assert stiff.nu == full.nu - len(STIFF.rigid)
    legs = {stiff.joint(j).name: 0.2 * np.sin(j) for j in range(1, stiff.njnt)}
    whole, part = state(full, legs), state(stiff, legs)
    for body in range(full.nbody):
        there = stiff.body(full.body(body).name).id
        assert part.xpos[there] == pytest.approx(whole.xpos[body], abs=1e-12)
        assert part.xmat[there] == pytest.approx(whole.xmat[body], abs=1e-12)
    M, smaller = np.zeros((full.nv, full.nv)), np.zeros((stiff.nv, stiff.nv))
    mujoco.mj_fullM(full, whole, M)
    mujoco.mj_fullM(stiff, part, smaller)
    stays = [i for i in range(full.nv) if full.joint(full.dof_jntid[i]).name not in STIFF.rigid]
    assert smaller == pytest.approx(M[np.ix_(stays, stays)], abs=1e-10)


def test_it_is_recognised_as_the_same_walker():
    full, stiff = robot_of(PATH, Described()), robot_of(PATH, STIFF)
    assert stiff.mass == pytest.approx(full.mass, rel=1e-12)
    assert stiff.starts == full.starts
    anatomy = anatomy_of(parsed(PATH, STIFF)[1], stiff)
    assert anatomy.trunk == ()
    assert anatomy.leg == pytest.approx(anatomy_of(parsed(PATH, Described())[1], full).leg, rel=1e-12)


@pytest.mark.parametrize(("name", "words"), [("right_elbw", "no joint 'right_elbw'"), ("root", "expected a hinge")])
def test_mistakes_are_named(name, words):
    model = parsed(PATH, Described())[1]
    name = model.joint(0).name if name == "root" else name
    with pytest.raises(InputError, match=words):
        looked_at(PATH, Described(rigid=(name,)))
