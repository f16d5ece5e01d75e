"""The price list: its parts add up, and what a scene does not use it does not load."""

import mujoco
import numpy as np
import pytest

from biped.engines.mujoco import simulate
from biped.engines.native import native
from biped.ensemble.plan import Plan
from biped.robot.model import compile_foreign
from biped.scenario.keys import Scenario, Start
from biped.show.replay import record_runs
from biped.studies.bench.features import FEATURES, prices
from biped.studies.bench.inner import steps
from biped.studies.bench.parts import contact_costs, tick_parts

SECONDS = 0.1


@pytest.fixture(scope="module")
def walked():
    run = Plan(Scenario(duration=1.5, controller="normal", start=Start(posture="heel_toe"))).run(0)
    return run, simulate(run)


def test_parts_add_up_to_the_closed_loop(walked):
    parts = tick_parts(*walked)
    named = ("steps", "tree", "torques", "decisions", "set_up")
    assert sum(parts[name] for name in (*named, "loop")) == pytest.approx(parts["closed_loop"])
    assert all(parts[name] > 0.0 for name in named)


def test_bare_steps_in_compiled_code_are_the_same_steps(walked):
    """Torques of the run through bare steps end where the run ended, from Python and compiled."""
    run, trajectory = walked
    ends = []
    for compiled in (False, True):
        foreign = compile_foreign(run.model, run.scenario)
        data = mujoco.MjData(foreign.model)
        data.qpos[:], data.qvel[:] = run.q, run.v
        given = np.ascontiguousarray(trajectory.u[:-1])
        if compiled:
            step = native(foreign.model, foreign.order).step
            steps(step, foreign.model._address, data._address, data.ctrl, given)
        else:
            for u in given:
                data.ctrl[:] = u
                mujoco.mj_step(foreign.model, data)
        ends.append(np.array(data.qpos))
    np.testing.assert_array_equal(ends[0], ends[1])
    np.testing.assert_array_equal(ends[0], trajectory.q[-1])


def test_a_step_with_more_contacts_is_told_apart(walked):
    assert len(contact_costs(*walked)) >= 2


# What each feature needs of biped's own and of other packages; nothing else may load it.
NEEDS = {
    "sensor noise": ("biped.control.sensors",),
    "torque limit by OSQP": ("qpsolvers", "osqp"),
    "home engine": ("biped.engines.home", "biped.engines.rigid.events"),
    "recording": ("biped.show.recording", "rerun"),
}


@pytest.fixture(scope="module")
def priced():
    return prices(
        ("plain", "ground that only pushes", "Q_d itself", "push", "actuator lag", *NEEDS), SECONDS, record_runs
    )


@pytest.mark.parametrize("feature", ["ground that only pushes", "Q_d itself", "push", "actuator lag", *NEEDS])
def test_only_scenes_with_a_feature_load_it(priced, feature):
    own = priced[feature]["only_imported"]
    assert set(NEEDS.get(feature, ())) <= set(own)
    for other, needed in NEEDS.items():
        if other != feature:
            assert not set(needed) & set(own), f"{feature} loads what only {other} needs"


def test_a_scene_without_the_home_engine_compiles_no_kernel_of_it(priced):
    assert not [name for name in priced["plain"]["kernels"] if name.startswith("engines.rigid.")]
    assert [name for name in priced["home engine"]["only_kernels"] if name.startswith("engines.rigid.")]


def test_every_feature_is_a_valid_scene():
    from biped.scenario.reading import read_scenario
    from biped.studies.bench.features import BASE

    for changes in FEATURES.values():
        Plan(read_scenario(BASE, list(changes)))
