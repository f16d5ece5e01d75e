"""Twelve numbers side by side, which go through the processor's vector registers together.

Twelve constraint rows fit: what is done to one row is done to all of them at once. Compilers cannot see by themselves
that the arrays of a record do not overlap, and then take numbers one by one. Every product and sum is rounded, in a
fixed order: results do not depend on how wide the registers are, and are those of plain Python, where the functions
work on arrays (12,).
"""

from __future__ import annotations

import numpy as np

from biped.base.jit import COMPILED, intrinsic

LANES = 12

_CODE = "biped.numerics.lanes_code"


def _plain_store(array, row, x):
    array[row] = x


def _plain_total(x):
    a, b, c, d = x[:4] + x[4:8] + x[8:]
    return (a + b) + (c + d)


load = intrinsic(_CODE, "load") if COMPILED else lambda array, row: np.array(array[row])
"""(array, row): the numbers of a row of an array (n, 12), contiguous."""
store = intrinsic(_CODE, "store") if COMPILED else _plain_store
"""(array, row, x): writes a row."""
everywhere = intrinsic(_CODE, "everywhere") if COMPILED else lambda f: np.full(LANES, f)
"""(f): a number in every lane."""
times = intrinsic(_CODE, "times") if COMPILED else lambda x, y: x * y
"""(x, y): products."""
plus = intrinsic(_CODE, "plus") if COMPILED else lambda x, y: x + y
"""(x, y): sums."""
added = intrinsic(_CODE, "added") if COMPILED else lambda x, f, y: x + f * y
"""(x, f, y): x + f y for a number f."""
squared = intrinsic(_CODE, "squared") if COMPILED else lambda x, y: x + y * y
"""(x, y): x + y²."""
total = intrinsic(_CODE, "total") if COMPILED else _plain_total
"""(x): the sum of all lanes."""
