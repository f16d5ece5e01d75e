"""What steps a run in Drake, for tests; it is imported where Drake is installed."""

from __future__ import annotations

import mujoco
import numpy as np

from biped.engines.sap.stepper import Stepper
from biped.robot.planar.build import compile_foreign
from biped.studies.run import plan_of


def run_of(name, *changes):
    return plan_of(name, [*changes, "engine=drake"]).run(0)


def stepper_of(name, *changes):
    """What steps a run, at its start, and the run."""
    run = run_of(name, *changes)
    if run.scenario.robot is None:
        model = compile_foreign(run.model, run.scenario).model
    else:
        from biped.robot.build import compiled

        model = compiled(run.model, run.scenario, "torque")
    out = Stepper(model, run.robot, run.profile.level, run.scenario.model)
    out.q[:], out.v[:] = run.q, run.v
    return out, run


def disturbed(stepper, seed):
    """Has it in the air, within its stops, with velocities."""
    m, random = stepper.model, np.random.default_rng(seed)
    for j in range(m.njnt):
        at = m.jnt_qposadr[j]
        if m.jnt_type[j] == mujoco.mjtJoint.mjJNT_FREE:
            stepper.q[at + 2] += 3.0
            turned = random.normal(size=4)
            stepper.q[at + 3 : at + 7] = turned / np.linalg.norm(turned)
        elif m.jnt_limited[j]:
            low, high = m.jnt_range[j]
            stepper.q[at] = low + (high - low) * random.uniform(0.3, 0.7)
        else:
            stepper.q[at] += random.uniform(-0.3, 0.3) + (3.0 if m.joint(j).name == "root_z" else 0.0)
    stepper.v[:] = random.normal(size=m.nv)
