"""What the ground would have to pull is let go or slides, and what slides comes to rest."""

import numpy as np
import pytest

from biped.engines.home import rigid_record
from biped.engines.rigid.gauss import bias_on, row_on
from biped.engines.rigid.motion import active_rows, evaluate, place
from biped.engines.rigid.release import come_to_rest, release
from biped.robot.ground import Profile
from biped.robot.planar.model import tree_at
from tests.engines.rigid.test_impact import HUMAN, new


def test_release_lets_go_what_would_pull_and_keeps_what_pushes():
    released, kept = 0, 0
    for seed in range(200):
        w, q, v = new(seed)
        w["acting"]["Q"] = np.random.default_rng(seed).normal(scale=300.0, size=9)
        w["contact"]["active"][4:] = 0
        v[:] = 0.0
        before = w["contact"]["active"].copy()
        release(w, q, v)
        m = active_rows(w)
        force = w["motion"]["lam"][w["system"]["row"][:m]][w["system"]["signed"][:m].astype(bool)]
        assert (force > -1e-6).all()
        released += int((before > w["contact"]["active"]).sum())
        kept += int(w["contact"]["active"].sum())
    assert released > 50
    assert kept > 50


def test_a_point_that_pulls_where_it_is_and_would_fall_without_the_ground_slides():
    """One point on the ground, at rest, and random torques: what goes on is pushed, and only that along the normal."""
    slid, left, stayed = 0, 0, 0
    for seed in range(1000):
        rng = np.random.default_rng(seed)
        w, q, v = new(seed)
        v[:] = 0.0
        contact, i = w["contact"], int(rng.integers(4))
        contact["active"] = np.arange(6) == i
        place(w, q, v)
        q[1] -= q[1] + w["at"]["point"][i, 1]
        place(w, q, v)
        contact["anchor"] = q[0] + w["at"]["point"][:, 0]
        w["acting"]["Q"][3:] = rng.normal(scale=100.0, size=6)
        release(w, q, v)
        assert not contact["held"].any()
        row = np.zeros((2, 9))
        row_on(w, i, 0, row[0])
        row_on(w, i, 1, row[1])
        up, along = row @ w["motion"]["v_dot"] + [bias_on(w, i, 0), bias_on(w, i, 1)]
        if not contact["active"][i]:
            left += 1
            assert up > -1e-6
            continue
        slides = bool(contact["slides"][i])
        slid, stayed = slid + slides, stayed + (not slides)
        assert abs(up) < 1e-8
        assert w["motion"]["lam"][2 * i] > 0.0
        assert (abs(along) > 1e-6) == slides
        assert (abs(w["motion"]["lam"][2 * i + 1]) > 1e-9) == (not slides)
    assert slid > 10
    assert left > 200
    assert stayed > 200


def test_release_on_redundant_rows_is_decided_by_the_motion():
    """Both feet flat, legs parallel, knees straight: ten rows of rank eight, and standing under gravity."""
    w = rigid_record(tree_at(HUMAN), 0.0)[0]
    q, v = np.zeros(9), np.zeros(9)
    w["contact"]["active"] = 1
    place(w, q, v)
    w["contact"]["anchor"] = q[0] + w["at"]["point"][:, 0]
    release(w, q, v)
    assert w["contact"]["active"][:4].all()
    normal = w["motion"]["lam"][:8:2]
    assert normal.sum() == pytest.approx(w["tree"]["mass"].sum() * 9.81, rel=0.2)
    assert (w["motion"]["lam"][[0, 2, 4, 6, 8, 9]] > -1e-6).all()
    assert np.abs(w["system"]["A"] @ w["motion"]["v_dot"]).max() < 1e-9


@pytest.mark.parametrize(("beyond", "kept", "stopped"), [(0.0, True, False), (-0.05, False, False), (0.05, True, True)])
def test_a_sliding_foot_stays_on_its_piece_of_the_ground(beyond, kept, stopped):
    """A toe slides past x = 0, from where the ground goes on level, falls away, or rises."""
    profile = Profile(np.array([-1.0, 0.0, 0.5, 1.0]), np.array([0.0, 0.0, beyond, beyond]))
    w = rigid_record(tree_at(HUMAN), 0.0, profile)[0]
    q, v, contact = np.zeros(9), np.zeros(9), w["contact"]
    q[[5, 8]] = -0.4  # toes down
    place(w, q, v)
    q[0] -= w["at"]["point"][0, 0] - 0.02  # [m] past the corner
    q[1] -= q[1] + w["at"]["point"][:, 1].min()
    v[0] = 0.1
    contact["active"][0] = contact["slides"][0] = 1
    contact["anchor"][0], contact["cos"][0] = -0.01, 1.0
    come_to_rest(w, q, v)
    assert contact["active"][0] == kept
    assert contact["held"][0] == stopped
    if kept:
        assert contact["anchor"][0] == pytest.approx(0.02)
        assert contact["landed"][0] == 0.0  # still the piece on which it landed
        row = np.zeros(9)
        row_on(w, 0, 1, row)
        assert contact["slides"][0] or abs(row @ v) < 1e-12
    else:
        assert v[0] == 0.1


def test_a_foot_comes_to_rest_only_where_its_place_needs_no_pull():
    """From the states of the test above, with a slip: after `come_to_rest` it is at rest, or slides on as fast."""
    rested, slid = 0, 0
    for seed in range(300):
        rng = np.random.default_rng(seed)
        w, q, v = new(seed)
        contact, i = w["contact"], int(rng.integers(4))
        contact["active"] = np.arange(6) == i
        contact["slides"][i] = 1
        place(w, q, v)
        q[1] -= q[1] + w["at"]["point"][i, 1]
        w["acting"]["Q"][3:] = rng.normal(scale=100.0, size=6)
        evaluate(w, q, v)
        v[:] = w["motion"]["q_dot"]  # along the ground
        row = np.zeros((2, 9))
        for direction in range(2):
            row_on(w, i, direction, row[direction])
        before = row @ v
        come_to_rest(w, q, v)
        if not contact["active"][i]:
            continue
        after = row @ v
        assert abs(after[0]) < 1e-9 * max(1.0, abs(before[1]))
        if contact["slides"][i]:
            slid += 1
            assert after[1] == pytest.approx(before[1], abs=1e-12)
        else:
            rested += 1
            assert abs(after[1]) < 1e-9 * max(1.0, abs(before[1]))
            assert w["ledger"]["least_loss"] >= -1e-12
    assert rested > 50
    assert slid > 3
