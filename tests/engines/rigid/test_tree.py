"""The compiled planar tree against Pinocchio on the same model file."""

import numpy as np
import pinocchio
import pytest

from biped.base.files import locate
from biped.engines.home import rigid_record
from biped.engines.rigid.motion import active_rows, applied_forces, gaps, mass_and_bias, place
from biped.robot.planar.description import description_at
from biped.robot.planar.model import tree_at
from biped.robot.planar.order import believed_model, pinocchio_tree
from biped.robot.planar.tree import Tree, motion, true_tree
from biped.scenario.keys import Truth
from tests.energy import energy

HUMAN = locate("models", "human", "test")
SLOPE = 7.0
CASES = 200


def human() -> Tree:
    """Lengths and masses as Pinocchio reads them."""
    return pinocchio_tree(believed_model(HUMAN, SLOPE), description_at(HUMAN))


def configurations():
    rng = np.random.default_rng(5)
    for _ in range(CASES):
        q = rng.uniform(-2.0, 2.0, 9)
        q[0] = rng.uniform(-100.0, 100.0)  # places must not lose digits far along the road
        yield q, rng.uniform(-8.0, 8.0, 9)


@pytest.fixture(scope="module")
def record():
    return rigid_record(human(), SLOPE)


@pytest.fixture(scope="module")
def reference():
    model = believed_model(HUMAN, SLOPE)
    return model, model.createData()


def test_mass_matrix_and_bias_are_pinocchios(record, reference):
    w = record[0]
    model, data = reference
    for q, v in configurations():
        place(w, q, v)
        mass_and_bias(w)
        M = np.triu(pinocchio.crba(model, data, q))
        np.testing.assert_allclose(np.triu(w["system"]["M"]), M, rtol=0, atol=1e-12 * np.abs(M).max())
        h = pinocchio.nonLinearEffects(model, data, q, v)
        np.testing.assert_allclose(w["system"]["h"], h, rtol=0, atol=1e-12 * np.abs(h).max())


def test_rows_places_and_velocity_products_are_pinocchios(record, reference):
    w = record[0]
    model, data = reference
    planar = [2, 0]  # normal, tangential
    for q, v in configurations():
        place(w, q, v)
        gaps(w, q, v)
        w["contact"]["held"] = 0
        pinocchio.forwardKinematics(model, data, q, v, np.zeros(9))
        for i, name in enumerate(description_at(HUMAN).points):
            w["contact"]["active"] = np.eye(6, dtype=np.uint8)[i]
            assert active_rows(w) == 2
            frame = model.getFrameId(name)
            at = pinocchio.ReferenceFrame.LOCAL_WORLD_ALIGNED
            J = pinocchio.computeFrameJacobian(model, data, q, frame, at)[planar]
            np.testing.assert_allclose(w["system"]["A"][:2], J, rtol=0, atol=1e-12)
            bias = pinocchio.getFrameClassicalAcceleration(model, data, frame, at).linear[planar]
            np.testing.assert_allclose(w["system"]["b_v"][:2], -bias, rtol=0, atol=1e-11)
            place_of = pinocchio.updateFramePlacement(model, data, frame).translation
            assert w["system"]["gap"][i] == pytest.approx(place_of[2], abs=1e-13)
            assert w["system"]["gap_rate"][i] == pytest.approx((J @ v)[0], abs=1e-12)


def test_flat_foot_has_one_tangential_row_and_a_knee_turns_backwards(record):
    w = record[0]
    q = np.zeros(9)
    place(w, q, q)
    w["contact"]["active"], w["contact"]["held"] = (1, 1, 0, 1, 0, 1), 0
    m = active_rows(w)
    assert w["system"]["row"][:m].tolist() == [0, 2, 3, 6, 7, 9]
    assert w["system"]["signed"][:m].tolist() == [1, 1, 0, 1, 0, 1]
    # The gap of a knee is the angle to its stop: it opens as the knee flexes, and flexing is negative.
    np.testing.assert_array_equal(w["system"]["A"][m - 1], -np.eye(9)[7])


def test_push_does_the_work_that_its_links_centre_of_mass_sees(record):
    w = record[0]
    tree = tree_at(HUMAN)
    rng = np.random.default_rng(6)
    w["acting"]["Q"] = 0.0
    w["acting"]["pushed"] = 1
    for q, v in list(configurations())[:20]:
        w["acting"]["push"] = rng.normal(size=(7, 2))
        place(w, q, v)
        applied_forces(w, v)
        power = (w["acting"]["push"] * motion(tree, q, v).com_velocity).sum()
        assert w["system"]["force"] @ v == pytest.approx(power, rel=1e-12)


def test_true_biped_has_the_energy_of_its_true_tree():
    truth = Truth(
        mass=(1.1, 0.9, 1.0, 1.2, 1.0, 0.8, 1.0), length=(1.0, 1.1, 1.0, 0.9, 1.0, 1.0, 1.0), joint_damping=0.3
    )
    w = rigid_record(true_tree(human(), truth), SLOPE)[0]
    tree = true_tree(tree_at(HUMAN), truth)
    for name, mine in human()._asdict().items():
        np.testing.assert_allclose(mine, getattr(tree_at(HUMAN), name), rtol=0, atol=1e-14)
    np.testing.assert_array_equal(w["tree"]["damping"], 0.3)
    for q, v in list(configurations())[:20]:
        place(w, q, v)
        mass_and_bias(w)
        M = np.triu(w["system"]["M"]) + np.triu(w["system"]["M"], 1).T
        kinetic = energy(tree, q, v, 0.0) - energy(tree, q, np.zeros(9), 0.0)
        assert 0.5 * v @ M @ v == pytest.approx(kinetic, rel=1e-12)
