"""Lanes compute what arrays of twelve compute, to the last bit."""

from __future__ import annotations

import numpy as np
import pytest

from biped.base.jit import COMPILED, kernel, numba
from biped.numerics import lanes
from biped.numerics.lanes import (
    FEW,
    LANES,
    added,
    everywhere,
    few,
    largest,
    load,
    load_few,
    lone,
    over,
    placed,
    plus,
    squared,
    store,
    times,
    total,
)


@kernel
def _all(a, f, out):
    x, y = load(a, 0), load(a, 1)
    store(out, 0, plus(x, y))
    store(out, 1, times(x, y))
    store(out, 2, added(x, f, y))
    store(out, 3, squared(x, y))
    store(out, 4, everywhere(f))
    return total(x)


@pytest.mark.parametrize("seed", range(3))
def test_every_function(seed):
    rng = np.random.default_rng(seed)
    a, f, out = rng.normal(size=(2, LANES)), rng.normal(), np.full((6, LANES), 7.0)
    x, y = a
    result = _all(a, f, out)
    for row, expected in enumerate((x + y, x * y, x + f * y, x + y * y, np.full(LANES, f), np.full(LANES, 7.0))):
        np.testing.assert_array_equal(out[row], expected)
    assert result == lanes._plain_total(x)
    assert result == pytest.approx(x.sum(), rel=1e-13)


def _carried(a, out):
    x = load(a, 0)
    for row in range(1, a.shape[0]):
        x = squared(x, load(a, row))
    store(out, 0, x)


@pytest.mark.skipif(not COMPILED, reason="nothing is compiled")
def test_lanes_are_as_wide_as_registers_in_loops_too():
    """As one vector of twelve a loop hands them from turn to turn one number at a time."""
    a, out = np.random.default_rng(2).normal(size=(5, LANES)), np.zeros((1, LANES))
    compiled = numba().njit(_carried)
    compiled(a, out)
    wanted = a[0]
    for row in a[1:]:
        wanted = wanted + row * row
    np.testing.assert_array_equal(out[0], wanted)
    (code,) = compiled.inspect_llvm().values()
    assert "<8 x double>" in code
    assert f"<{LANES} x double>" not in code


@kernel
def _few(a, f, out):
    x, y = load_few(a, 0), load_few(a, 1)
    store(out, 0, plus(x, y))
    store(out, 1, times(x, y))
    store(out, 2, added(x, f, y))
    store(out, 3, squared(x, y))
    store(out, 4, few(f))
    store(out, 5, lone(f))
    store(out, 6, over(x, f))


def test_every_function_of_a_few():
    rng = np.random.default_rng(5)
    a, f, out = rng.normal(size=(2, FEW)), rng.normal(), np.full((8, FEW), 7.0)
    x, y = a
    _few(a, f, out)
    first = np.array([f, 0.0, 0.0, 0.0])
    wanted = (x + y, x * y, x + f * y, x + y * y, np.full(FEW, f), first, x / f, np.full(FEW, 7.0))
    np.testing.assert_array_equal(out, wanted)


@kernel
def _largest(a):
    return largest(load(a, 0))


def test_the_first_of_the_largest_is_found():
    rng = np.random.default_rng(0)
    rows = list(rng.normal(size=(300, LANES))) + list(rng.integers(0, 3, (300, LANES)).astype(float))
    rows += [np.zeros(LANES), -np.ones(LANES), *np.eye(LANES)]
    for x in rows:
        sizes = np.maximum(x, 0.0)
        assert _largest(x[None]) == lanes._plain_largest(x) == (sizes.max(), np.argmax(sizes))
    x = np.full(LANES, np.nan)
    assert _largest(x[None]) == lanes._plain_largest(x) == (0.0, 0)
    x[[4, 7]] = 2.0, np.inf
    assert _largest(x[None]) == lanes._plain_largest(x) == (np.inf, 7)


@kernel
def _placed(a, lane, f, out):
    store(out, 0, placed(load(a, 0), lane, f))
    store(out, 1, placed(load(a, 0), 3, f))


def test_one_lane_is_replaced():
    a, out = np.random.default_rng(1).normal(size=(1, LANES)), np.zeros((2, LANES))
    for lane in range(LANES):
        _placed(a, lane, 7.0, out)
        for row, at in enumerate((lane, 3)):
            wanted = a[0].copy()
            wanted[at] = 7.0
            np.testing.assert_array_equal(out[row], wanted)
            np.testing.assert_array_equal(lanes._plain_placed(a[0], at, 7.0), wanted)
