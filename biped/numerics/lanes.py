"""Twelve numbers side by side, which go through the processor's vector registers together.

Twelve constraint rows fit: what is done to one row is done to all of them at once. Compilers cannot see by themselves
that the arrays of a record do not overlap, and then take numbers one by one. Every product and sum is rounded, in a
fixed order: results do not depend on how wide the registers are, and are those of plain Python, where the functions
work on arrays (12,). What is done to a few right-hand sides at once takes four lanes.
"""

import numpy as np

from biped.base.jit import COMPILED, intrinsic

LANES = 12
FEW = 4

_CODE = "biped.numerics.lanes_code"


def _plain_store(array, row, x):
    array.reshape(-1, len(x))[row] = x


def _plain_total(x):
    a, b, c, d = x[:4] + x[4:8] + x[8:]
    return (a + b) + (c + d)


def _plain_lone(f):
    return np.array([f, 0.0, 0.0, 0.0])


def _plain_largest(x):
    sizes = np.where(x > 0.0, x, 0.0)
    lane = int(np.argmax(sizes))
    return float(sizes[lane]), lane


def _plain_placed(x, lane, f):
    out = np.array(x)
    out[lane] = f
    return out


load = intrinsic(_CODE, "load") if COMPILED else lambda array, row: np.array(array.reshape(-1, LANES)[row])
"""(array, row): the numbers of a row of an array (n, 12), contiguous; one of (n, 24) has two of them in a row."""
load_few = intrinsic(_CODE, "load_few") if COMPILED else lambda array, row: np.array(array[row])
"""(array, row): the numbers of a row of an array (n, 4), contiguous."""
store = intrinsic(_CODE, "store") if COMPILED else _plain_store
"""(array, row, x): writes a row of an array as wide as x."""
everywhere = intrinsic(_CODE, "everywhere") if COMPILED else lambda f: np.full(LANES, f)
"""(f): a number in every lane."""
few = intrinsic(_CODE, "few") if COMPILED else lambda f: np.full(FEW, f)
"""(f): a number in each of four lanes."""
lone = intrinsic(_CODE, "lone") if COMPILED else _plain_lone
"""(f): a number in the first of four lanes, zeros in the others."""
times = intrinsic(_CODE, "times") if COMPILED else lambda x, y: x * y
"""(x, y): products."""
plus = intrinsic(_CODE, "plus") if COMPILED else lambda x, y: x + y
"""(x, y): sums."""
added = intrinsic(_CODE, "added") if COMPILED else lambda x, f, y: x + f * y
"""(x, f, y): x + f y for a number f."""
over = intrinsic(_CODE, "over") if COMPILED else lambda x, f: x / f
"""(x, f): x / f for a number f."""
squared = intrinsic(_CODE, "squared") if COMPILED else lambda x, y: x + y * y
"""(x, y): x + y²."""
total = intrinsic(_CODE, "total") if COMPILED else _plain_total
"""(x): the sum of all lanes."""
largest = intrinsic(_CODE, "largest") if COMPILED else _plain_largest
"""(x): the largest number and the first lane that has it; what is not positive, or no number, counts as zero."""
placed = intrinsic(_CODE, "placed") if COMPILED else _plain_placed
"""(x, lane, f): x with a number f in one lane. Without memory: a processor waits for what it has written by numbers and
reads as lanes."""
