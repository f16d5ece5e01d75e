"""Lanes compute what arrays of twelve compute, to the last bit."""

from __future__ import annotations

import numpy as np
import pytest

from biped.base.jit import kernel
from biped.numerics import lanes
from biped.numerics.lanes import LANES, added, everywhere, load, plus, squared, store, times, total


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
