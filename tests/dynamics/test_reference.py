"""Named tuples that compiled functions get by their address: the same arrays, whoever reads them."""

from typing import NamedTuple

import numpy as np
import pytest
from numba import typeof

from biped.base.jit import COMPILED, kernel
from biped.dynamics.reference import ReferenceType, by_reference, refer
from biped.dynamics.room import room


@by_reference
class Inner(NamedTuple):
    count: np.ndarray


@by_reference
class Outer(NamedTuple):
    x: np.ndarray
    inner: Inner
    share: float


class Pair(NamedTuple):
    a: float
    b: float


@kernel
def add(pair):
    return pair.a + pair.b


@kernel
def use(outer, times):
    pair = refer(Pair(1.0, outer.share))
    for i in range(times):
        outer.inner.count[i] += 1
        outer.x[0] += add(pair)
    return outer.x[0]


def test_arrays_are_reached_through_addresses_and_stay_where_they_are():
    outer = Outer(np.zeros(2), Inner(np.zeros(3, np.int64)), 0.5)
    assert use(outer, 3) == 4.5
    assert outer.x.tolist() == [4.5, 0.0]
    assert outer.inner.count.tolist() == [1, 1, 1]
    assert use.py_func(outer, 1) == 6.0 if COMPILED else use(outer, 1) == 6.0


@pytest.mark.skipif(not COMPILED, reason="nothing is compiled")
def test_a_room_is_one_address_whatever_its_size():
    assert isinstance(typeof(room(2, 1, 4)), ReferenceType)
    assert typeof(room(2, 1, 4)) == typeof(room(30, 20, 12, 2, 1))


@pytest.mark.skipif(not COMPILED, reason="nothing is compiled")
def test_a_field_that_is_not_there_is_an_error():
    @kernel
    def wrong(outer):
        return outer.y

    with pytest.raises(Exception, match="Unknown attribute 'y'"):
        wrong(Outer(np.zeros(1), Inner(np.zeros(1, np.int64)), 0.5))
