"""Kernels within kernels."""

from __future__ import annotations

import numpy as np
import pytest

from biped.base.jit import COMPILED, inner_kernel, kernel, numba


def _summed(a):
    s = 0.0
    for x in a:
        s += x
    return s


_within = inner_kernel(_summed)


@kernel
def _containing(a, b):
    return _within(a) - _within(b)


def test_an_inner_kernel_is_called_like_any_other():
    a, b = np.arange(4.0), np.ones(3)
    assert _containing(a, b) == 3.0
    assert _within(a) == 6.0


@pytest.mark.skipif(not COMPILED, reason="nothing is compiled")
@pytest.mark.parametrize(("made", "always"), [(kernel, False), (inner_kernel, True)])
def test_only_inner_kernels_always_become_part_of_what_calls_them(made, always):
    compiled = numba().njit(**made(_summed)._options | {"cache": False})(_summed)
    compiled(np.ones(2))
    (code,) = compiled.inspect_llvm().values()
    assert ("alwaysinline" in code) == always
