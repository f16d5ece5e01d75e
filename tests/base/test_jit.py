"""Kernels within kernels."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pytest

from biped.base.jit import COMPILED, inner_kernel, kernel, numba


class _Many(NamedTuple):
    """Arrays as a loop is handed them."""

    a: np.ndarray
    b: np.ndarray
    c: np.ndarray
    d: np.ndarray


def _summed(many, k):
    """Large enough that no compiler makes it part of what calls it unless it is told to."""
    s = 0.0
    for i in range(many.a.size):
        for j in range(many.b.size):
            for x in (many.c[i], many.d[j], many.a[j], many.b[i]):
                if x > many.c[k] and i != j:
                    s += x * many.a[i] / (1.0 + many.b[j] * many.b[j])
                elif x < many.d[k]:
                    s -= x * many.d[i] / (1.0 + many.c[j] * many.c[j])
                else:
                    s += np.cos(x) * np.sin(many.a[i]) - np.exp(-many.b[j] * many.b[j])
    return s


_called, _within = kernel(_summed), inner_kernel(_summed)


def _calling(many, n):
    s = 0.0
    for k in range(n):
        s += _called(many, k) + _called(many, 0)
    return s


def _containing(many, n):
    s = 0.0
    for k in range(n):
        s += _within(many, k) + _within(many, 0)
    return s


@pytest.mark.skipif(not COMPILED, reason="nothing is compiled")
def test_an_inner_kernel_becomes_part_of_what_calls_it():
    many = _Many(*np.random.default_rng(0).normal(size=(4, 5)))
    expected = sum(_summed(many, k) + _summed(many, 0) for k in range(3))
    calls = {}
    for function in (_containing, _calling):
        compiled = numba().njit(function)
        assert compiled(many, 3) == pytest.approx(expected, rel=1e-12)
        (code,) = compiled.inspect_llvm().values()
        calls[function] = [line for line in code.splitlines() if " call " in line and "summed" in line]
    assert not calls[_containing]
    assert calls[_calling], "otherwise this shows nothing"
