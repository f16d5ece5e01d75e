"""Friction and softness of the ground that nobody modelled: their strength, and what they do to a robot's contacts."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from biped.base.errors import InputError
from biped.engines.mujoco import simulate
from biped.engines.uneven import PatchedContacts
from biped.robot import unmodelled as fields
from biped.robot.unmodelled import factors_at, patches_of
from biped.studies.run import plan_of
from tests.engines.test_mujoco import IDLE, law_of, named

BOTH = ("truth.unmodelled.friction=0.4", "truth.unmodelled.softness=0.2")
WALK = ("duration=0.8", "ground.friction=0.8")


def logarithms(patches, x, y=0.0):
    return np.log(factors_at(patches, x, y))


@pytest.fixture
def even(monkeypatch):
    """The same factors everywhere, of whatever is asked for."""

    def make(friction, time):
        made = fields.patches_of

        def uniform(run):
            return tuple(
                one._replace(frequencies=0.0 * one.frequencies, phases=0.0 * one.phases,
                             sizes=np.log([[friction], [time]]) / len(one.phases) * np.ones_like(one.sizes))
                for one in made(run)
            )  # fmt: skip

        for place in ("biped.engines.plant", "biped.engines.planar.mujoco"):
            monkeypatch.setattr(f"{place}.patches_of", uniform)

    return make


def test_strength_and_covariance_are_those_asked_for():
    plan, patch = plan_of("upright/own", [*BOTH, "truth.unmodelled.patch=0.7"]), 0.7
    found = []
    for seed in range(600):
        (made,) = patches_of(plan.run_from(seed))
        found.append(
            [logarithms(made, 1.0, 2.0), logarithms(made, 1.0 + patch, 2.0), logarithms(made, 1.0, 2.0 - patch)]
        )
    here, along, aside = np.array(found).transpose(1, 0, 2)
    np.testing.assert_allclose(np.sqrt((here**2).mean(axis=0)), [0.4, 0.2], rtol=0.08)
    for other in (along, aside):
        np.testing.assert_allclose((here * other).mean(axis=0) / (here**2).mean(axis=0), np.exp(-0.5), atol=0.06)
    assert abs(np.corrcoef(here.T)[0, 1]) < 0.15, "friction says nothing of softness"


def test_a_run_has_one_ground_and_twice_the_strength_is_twice_the_same():
    one, two = (plan_of("upright/own", [f"truth.unmodelled.friction={size}"]) for size in (0.1, 0.2))
    (a,), (again,), (b,), (other,) = (patches_of(p.run_from(i)) for p, i in ((one, 3), (one, 3), (two, 3), (one, 4)))
    assert logarithms(a, 2.0).tobytes() == logarithms(again, 2.0).tobytes()
    np.testing.assert_allclose(2.0 * logarithms(a, 2.0), logarithms(b, 2.0), rtol=1e-9)
    assert logarithms(a, 2.0)[0] != logarithms(other, 2.0)[0]
    assert factors_at(a, 2.0, 0.0)[1] == 1.0, "softness was not asked for"
    assert patches_of(plan_of("upright/own", []).run(0)) == ()


@pytest.mark.parametrize("law", ["compiled", "python"])
def test_seven_links_on_the_same_factor_everywhere_walk_as_on_that_ground(even, law):
    even(0.5, 1.0)
    watch = None if law == "compiled" else lambda *_: None
    there = simulate(plan_of("upright/own", [*BOTH, *WALK]).run(0), watch)
    same = simulate(plan_of("upright/own", ["duration=0.8", "ground.friction=0.4"]).run(0), watch)
    usual = simulate(plan_of("upright/own", [*WALK]).run(0), watch)
    np.testing.assert_allclose(there.q, same.q, atol=1e-6)
    assert np.abs(there.q - usual.q).max() > 1e-3


def test_seven_links_meet_other_ground_at_each_place():
    run = plan_of("upright/own", [*BOTH, *WALK]).run_from(1)
    (patches,), points = patches_of(run), ["right_heel", "right_toe", "left_heel", "left_toe"]
    seen = []

    def watch(model, data, _):
        for point in points:
            friction, time = factors_at(patches, data.geom(point).xpos[0], 0.0)
            pair = model.pair(point)
            seen.append([pair.friction[0], 0.8 * friction, pair.solref[0], 0.004 * time, pair.friction[1]])

    simulate(run, watch)
    friction, wanted, time, wanted_time, along = np.array(seen).T
    np.testing.assert_allclose(friction, wanted, rtol=1e-9)
    np.testing.assert_allclose(time, np.maximum(wanted_time, 0.002), rtol=1e-9)
    assert (friction == along).all()
    assert np.ptp(friction) > 0.05
    one, other = (simulate(plan_of("upright/own", [*BOTH, *WALK]).run_from(seed)) for seed in (1, 2))
    usual = simulate(plan_of("upright/own", [*WALK]).run_from(1))
    assert np.abs(one.q - other.q).max() > 1e-4
    assert np.abs(one.q - usual.q).max() > 1e-4
    again = simulate(plan_of("upright/own", [*BOTH, *WALK]).run_from(1))
    assert one.log.tobytes() == again.log.tobytes()


def slid(tmp_path, *changes):
    idle = law_of(tmp_path, IDLE.replace("return {}", "return np.zeros(19)"))
    return simulate(plan_of(named("h1"), (idle, "duration=0.3", *changes)).run(0))


def test_any_robot_on_the_same_factor_everywhere_moves_as_on_that_ground(even, tmp_path):
    even(0.1, 2.0)
    there = slid(tmp_path, *BOTH, "ground.friction=0.5", "ground.slope=8")
    same = slid(tmp_path, "ground.friction=0.05", "ground.slope=8", "ground.contact_time=0.008")
    usual = slid(tmp_path, "ground.friction=0.5", "ground.slope=8")
    np.testing.assert_allclose(there.q, same.q, atol=1e-9)
    np.testing.assert_allclose(there.ground_force, same.ground_force, atol=1e-5)
    rows = min(len(there), len(usual))
    assert np.abs(there.q[:rows] - usual.q[:rows]).max() > 1e-3


def test_each_contact_has_the_friction_of_its_place():
    plan = plan_of(named("h1"), [*BOTH])
    run = plan.run_from(5)
    (patches,) = patches_of(run)
    model = run.stepped_model("torque")
    data = mujoco.MjData(model)
    data.qpos[:], data.qpos[2] = run.q, run.q[2] - 0.005
    mujoco.mj_step1(model, data)
    before = data.contact.friction.copy(), data.contact.solref.copy()
    is_ground = np.arange(model.ngeom) == run.robot.ground
    PatchedContacts(patches, model, data, is_ground).change()
    assert len(before[0]) >= 4
    for c, place in enumerate(data.contact.pos):
        friction, time = factors_at(patches, place[0], place[1])
        np.testing.assert_allclose(data.contact.friction[c, :2], friction * before[0][c, :2])
        assert data.contact.solref[c, 0] == pytest.approx(max(time * before[1][c, 0], 0.002))


def test_softness_never_asks_for_less_than_two_steps():
    (made,) = patches_of(plan_of("upright/own", ["truth.unmodelled.softness=3", "simulation.timestep=0.0005"]).run(0))
    assert made.least == pytest.approx(0.001)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        (
            ["engine=home"],
            r"truth.unmodelled.friction: expected 0: in the engine 'home' contacts are rigid, with friction",
        ),
        (
            ["engine=drake"],
            r"truth.unmodelled.friction: expected 0: in the engine 'drake' friction and stiffness belong",
        ),
        (["truth.unmodelled.patch=0"], r"truth.unmodelled.patch"),
        (["simulation.cone=pyramidal"], r"simulation.cone: expected 'elliptic' with truth.unmodelled.friction"),
    ],
)
def test_where_it_is_impossible_it_is_refused_in_one_sentence(changes, words):
    with pytest.raises(InputError, match=words):
        simulate(plan_of("upright/own", ["truth.unmodelled.friction=0.1", *changes]).run(0))


def test_a_step_that_leaves_no_moment_for_it_is_refused():
    with pytest.raises(
        InputError, match=r"simulation.integrator: expected one of Euler, implicit, implicitfast: within"
    ):
        plan_of(named("h1"), ["truth.unmodelled.softness=0.1", "simulation.integrator=RK4"]).run(0)
