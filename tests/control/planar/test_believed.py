"""Forces that the law counts on, from the log: those that it counted on when it ticked."""

import numpy as np
import pytest

from biped.control.planar.controller import ThesisLaw
from biped.control.planar.setup import believed_forces
from biped.engines.planar.mujoco import simulate
from biped.robot.columns import WIDTH
from biped.robot.ground import GRAVITY
from biped.robot.planar.model import tree_at
from biped.studies.run import plan_of


def run_of(*changes):
    return plan_of("calm/own", ["duration=2.0", "window={start=1.0,end=2.0}", *changes]).run(0)


@pytest.fixture(scope="module", params=["", "randomise.controller_constraints=0.1"])
def run(request):
    return run_of(*filter(None, [request.param]))


@pytest.fixture(scope="module")
def walked(run):
    return simulate(run)


def test_they_are_those_of_the_ticks(run, walked):
    t, found = walked, believed_forces(run, walked)
    assert found is not None
    q, v = np.array(t.q[0]), np.array(t.v[0])
    law = ThesisLaw(run, tree_at(run.model), q, v, np.zeros((len(t), WIDTH)))
    tick, push = law.tick, law.c["push"]
    for k in range(len(t)):
        q[:], v[:] = t.q[k], t.v[k]
        tick(k, t.time[k])
        edges = push["force"][0, :8].reshape(4, 2)
        np.testing.assert_allclose(law.u, t.u[k], atol=1e-6)
        np.testing.assert_allclose(found[k, :, 1], edges.sum(axis=1), atol=1e-6)
        np.testing.assert_allclose(found[k, :, 0], push["friction"] * (edges[:, 0] - edges[:, 1]), atol=1e-6)


def test_they_carry_the_weight_and_are_where_forces_are(run, walked):
    t, found = walked, believed_forces(run, walked)
    weight = t.tree.mass.sum() * GRAVITY
    settled = t.time > 1.0
    assert found[settled, :, 1].sum(axis=1).mean() == pytest.approx(weight, rel=0.2)
    assert (found[..., 1] >= 0.0).all()
    alone = (t.believed.sum(axis=1) == 2) & settled & (t.force[..., 2].sum(axis=1) > 0.5 * weight)
    foot = t.force[alone][..., 2].reshape(-1, 2, 2).sum(axis=2).argmax(axis=1)
    counted = found[alone][..., 1].reshape(-1, 2, 2).sum(axis=2)
    assert (counted.argmax(axis=1) == foot).mean() > 0.9


@pytest.mark.parametrize(
    "change",
    [
        "actuation.contacts=released",
        "actuation.mode=generalized",
        "sensors={angle_noise=1e-4}",
        "sensors.delay=0.002",
    ],
)
def test_where_there_are_none(change):
    run = run_of("duration=0.2", "window={start=0.1,end=0.2}", change)
    assert believed_forces(run, simulate(run)) is None
