"""The search to failure: a ladder, then bisection; a lucky pocket beyond a failure counts nothing."""

from __future__ import annotations

import pytest

from biped.scenario.goals import Standard
from biped.studies.standard.search import TriedValue, limit, try_values

RATE = 0.7


def test(**keys) -> Standard:
    return Standard(**{"title": "t", "key": "ground.slope", "first": 1.0, "step": 4.0, "last": 41.0} | keys)


def asked(standard, reached, runs=20):
    """What a search tries of a rule from value to runs that reach the goal, and in which order."""
    order = []

    def at(value):
        order.append(value)
        return TriedValue(value, reached(value), runs, {})

    return try_values(standard, RATE, at), order


test.__test__ = False  # a maker of tests for gaits, not one of ours


@pytest.mark.parametrize("edge", [1.0, 4.0, 5.0, 12.5, 28.0, 40.0])
def test_bisection_ends_a_resolution_from_the_edge(edge):
    tried, order = asked(test(), lambda value: 20 if value <= edge else 0)
    found = limit(tried, RATE)
    assert found.holds_to == found.sure_to == int(edge)
    assert found.fails_at == found.surely_fails_at == int(edge) + 1
    assert len(order) == len(set(order)) <= edge / 4 + 1 + 2 + 2
    assert [one.value for one in tried] == sorted(order)


def test_downwards():
    tried, _ = asked(test(first=-1.0, step=-4.0, last=-41.0), lambda value: 20 if value >= -9.0 else 0)
    found = limit(tried, RATE)
    assert (found.holds_to, found.fails_at) == (-9.0, -10.0)
    assert [one.value for one in tried] == sorted((one.value for one in tried), reverse=True)


def test_nothing_holds():
    tried, order = asked(test(), lambda value: 3)
    assert limit(tried, RATE) == (None, None, 1.0, 1.0)
    assert order == [1.0]


def test_everything_holds():
    tried, order = asked(test(), lambda value: 20)
    assert limit(tried, RATE) == (41.0, 41.0, None, None)
    assert order == [1.0 + 4.0 * i for i in range(11)]


def test_the_last_value_is_tried_although_it_is_no_whole_step():
    _, order = asked(test(last=7.0), lambda value: 20)
    assert order == [1.0, 5.0, 7.0]


def test_it_goes_on_to_a_value_that_is_sure_to_fail():
    """13 of 20 is too few, but its interval reaches beyond 70 %."""
    tried, order = asked(test(), lambda value: 20 if value <= 5.0 else 13 if value < 13.0 else 2)
    found = limit(tried, RATE)
    assert (found.holds_to, found.fails_at, found.surely_fails_at) == (5.0, 6.0, 13.0)
    assert order[:4] == [1.0, 5.0, 9.0, 13.0]


def test_what_the_intervals_are_sure_of_ends_before():
    tried, _ = asked(test(), lambda value: 20 if value <= 5.0 else 15 if value <= 17.0 else 0)
    found = limit(tried, RATE)
    assert (found.holds_to, found.sure_to) == (17.0, 5.0)


def test_a_lucky_pocket_beyond_a_failure_counts_nothing():
    tried = [TriedValue(value, reached, 20, {}) for value, reached in ((1.0, 20), (2.0, 5), (3.0, 20))]
    assert limit(tried, RATE) == (1.0, 1.0, 2.0, 2.0)


def test_bounds_of_a_count():
    one = TriedValue(1.0, 14, 20, {})
    assert one.holds(RATE)
    assert not one.surely_holds(RATE)
    assert not one.surely_fails(RATE)
    assert TriedValue(1.0, 10, 10, {}).surely_holds(RATE)
    assert TriedValue(1.0, 3, 10, {}).surely_fails(RATE)
