"""Start postures are put on the ground by the least change."""

from __future__ import annotations

import numpy as np
import pytest

from biped.base.errors import InputError
from biped.base.files import folder
from biped.ensemble.plan import Plan
from biped.robot.planar.description import description_at
from biped.robot.planar.model import posture_of, tree_at
from biped.robot.planar.posture import project
from biped.robot.planar.tree import absolute, from_absolute, motion
from biped.scenario.keys import Scenario, Start

HUMAN = folder("models") / "human.xml"
TREE = tree_at(HUMAN)
POINTS = description_at(HUMAN).points


def heights(q) -> dict[str, float]:
    return dict(zip(POINTS, motion(TREE, q, np.zeros(9)).point[:, 1], strict=True))


@pytest.mark.parametrize("name", ["heel_toe", "flat", "single"])
def test_named_contacts_touch_and_nothing_is_below(name):
    printed, contacts = posture_of(HUMAN, name)
    q = project(TREE, printed, contacts, POINTS)
    there = heights(q)
    assert max(abs(there[point]) for point in contacts) < 1e-12
    assert min(there.values()) > -1e-12
    assert q[4] <= 1e-12
    assert q[7] <= 1e-12
    turned = np.abs(absolute(q) - absolute(printed))[2:].max()
    assert turned < 0.03, "captions are good to two digits, but for 14 mm in one"


def test_the_caption_of_fig_3_5_is_14_mm_off():
    printed, contacts = posture_of(HUMAN, "flat")
    there = heights(printed)
    assert there["left_toe"] - there["right_toe"] == pytest.approx(0.0138, abs=5e-4)
    assert max(abs(h) for h in heights(project(TREE, printed, contacts, POINTS)).values()) < 1e-12


def test_the_change_is_the_least():
    """No nearby posture that touches as well is closer to the printed one in the projection's own measure."""
    printed, contacts = posture_of(HUMAN, "flat")
    q = project(TREE, printed, contacts, POINTS)
    weight = np.array([100.0, 100.0, *[1.0] * 7])

    def size(x):
        return np.linalg.norm((absolute(x) - absolute(printed)) / weight)

    rng = np.random.default_rng(0)
    for _ in range(200):
        near = printed + (q - printed) * rng.uniform(0.5, 1.5) + rng.normal(0.0, 0.02, 9)
        other = project(TREE, near, contacts, POINTS)
        assert size(other) > size(q) * (1.0 - 0.05)


def test_without_contacts_the_lowest_point_touches():
    rng = np.random.default_rng(1)
    for _ in range(20):
        q = rng.normal(0.0, 0.4, 9)
        put = project(TREE, q, (), POINTS)
        assert min(heights(put).values()) == pytest.approx(0.0, abs=1e-14)
        np.testing.assert_array_equal(put[2:], q[2:])


def test_a_posture_that_already_stands_is_kept():
    printed, contacts = posture_of(HUMAN, "heel_toe")
    once = project(TREE, printed, contacts, POINTS)
    np.testing.assert_array_equal(project(TREE, once, contacts, POINTS), once)


def test_out_of_reach():
    q = from_absolute(np.array([0.0, 1.2, 1.57, 3.2, 3.2, 1.6, 1.57, 1.57, 0.0]))
    with pytest.raises(InputError, match=r"left_heel.*start\.settle = false") as caught:
        project(TREE, q, POINTS, POINTS)
    assert caught.value.key == "start.contacts"


def test_start_of_a_run():
    x = (0.3, 1.4, 1.5, 1.7, 1.7, 0.1, 1.4, 1.3, 0.0)
    v = (0.5, 0.0, 0.1, 0.2, 0.3, 0.4, -0.1, -0.2, -0.3)
    free = Plan(Scenario(start=Start(q=x, v=v, settle=False))).run(0)
    np.testing.assert_allclose(absolute(free.q), x, atol=1e-12)
    expected = [0.5, 0.0, 0.1, 0.2 - 0.1, 0.3 - 0.2, 0.4 - 0.3, -0.1 - 0.1, -0.2 + 0.1, -0.3 + 0.2]
    np.testing.assert_allclose(free.v, expected, atol=1e-12)
    settled = Plan(Scenario(start=Start(q=x))).run(0)
    assert min(heights(settled.q).values()) == pytest.approx(0.0, abs=1e-14)


def test_jitter_turns_the_seven_angles_and_stays_on_the_ground():
    from biped.scenario.randomise import Randomise

    bent = Plan(Scenario(start=Start(posture="flat"))).run(0).q.copy()
    bent[[4, 7]] = -0.2  # far from the stops of the knees
    at = tuple(absolute(bent).tolist())
    plan = Plan(Scenario(start=Start(q=at, jitter=0.01), randomise=Randomise(runs=400)))
    still = Plan(Scenario(start=Start(q=at))).run(0)
    turned = np.array([absolute(plan.run(i).q) - absolute(still.q) for i in range(400)])
    np.testing.assert_array_equal(turned[:, 0], 0.0)
    np.testing.assert_allclose(turned[:, 2:].std(axis=0), 0.01, rtol=0.15)
    assert np.abs(np.corrcoef(turned[:, 2:].T) - np.eye(7)).max() < 0.2
    for i in range(10):
        assert min(heights(plan.run(i).q).values()) == pytest.approx(0.0, abs=1e-14)
    np.testing.assert_array_equal(plan.run(3).q, plan.run(3).q)


@pytest.mark.parametrize("settle", [True, False])
def test_jitter_turns_no_knee_through_its_stop(settle):
    from biped.scenario.randomise import Randomise

    start = Start(posture="flat", jitter=0.05, settle=settle)
    plan = Plan(Scenario(start=start, randomise=Randomise(runs=200)))
    knees = np.array([plan.run(i).q[[4, 7]] for i in range(200)])
    before = max(0.01, *Plan(Scenario(start=Start(posture="flat", settle=settle))).run(0).q[[4, 7]])
    assert knees.max() == pytest.approx(before, abs=1e-12)
    assert knees.min() < -0.05


def test_a_biped_beyond_all_measure_cannot_be_put_on_the_ground():
    tree = tree_at(HUMAN)
    huge = tree._replace(joint=tree.joint * 1e306, point=tree.point * 1e306)
    with np.errstate(all="ignore"), pytest.raises(InputError, match="contacts that the legs can reach"):
        project(huge, np.full(9, 0.1), ("right_toe", "left_toe"), description_at(HUMAN).points)
