"""Which law a compiled loop holds is decided when it is compiled."""

from __future__ import annotations

from types import FunctionType

import numpy as np
import pytest

from biped.base.jit import COMPILED, numba
from biped.control.planar import tick


@pytest.mark.skipif(not COMPILED, reason="nothing is compiled")
@pytest.mark.parametrize("pushing", [(), (True,)])
def test_a_loop_is_compiled_with_the_law_that_it_runs_and_not_with_the_other(pushing):
    laws = {name: numba().njit(lambda record, q, v, log, k, time: k) for name in ("thesis_tick", "pushing_tick")}
    of_loop = numba().njit(FunctionType(tick.law_tick.py_func.__code__, laws))
    record, q, log = np.zeros(1), np.zeros(9), np.zeros((1, 1))
    assert of_loop(record, q, q, log, 5, 0.0, pushing) == 5
    compiled = [name for name, law in laws.items() if law.signatures]
    assert compiled == ["thesis_tick" if pushing == () else "pushing_tick"]
