"""Twelve numbers side by side, which go through the processor's vector registers together; and sines of a few at once.

Twelve constraint rows fit: what is done to one row is done to all of them at once. Compilers cannot see by themselves
that the arrays of a record do not overlap, and then take numbers one by one. Every product and sum is rounded, in a
fixed order: results do not depend on how wide the registers are, and are those of plain Python, where the functions
work on arrays (12,). What is done to a few right-hand sides at once takes four lanes.

Angles of sines and cosines are reduced to |r| <= π/4 by multiples of π/2 in three parts (Cody & Waite, Software Manual
for the Elementary Functions, 1980); the polynomials there are those of fdlibm (Sun Microsystems, 1993). Within 1.2e-16
of the truth, without a branch.
"""

import math

import numpy as np

from biped.base.jit import COMPILED, intrinsic, kernel

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


_FAR = 1e4
"""[rad] from which the reduction loses digits: nothing that walks turns that far, but numbers that explode do."""
_P1, _P2, _P3 = 1.57079632673412561417, 6.07710050630396597660e-11, 2.02226624879595063154e-21
_S = (-1.66666666666666324348e-01, 8.33333333332248946124e-03, -1.98412698298579493134e-04,
      2.75573137070700676789e-06, -2.50507602534068634195e-08, 1.58969099521155010221e-10)  # fmt: skip
_C = (4.16666666666666019037e-02, -1.38888888888741095749e-03, 2.48015872894767294178e-05,
      -2.75573143513906633035e-07, 2.08757232129817482790e-09, -1.13596475577881948265e-11)  # fmt: skip


@kernel
def sines(angle, count, sin, cos):
    """Fills the first `count` entries of sin and cos from those of angle [rad]."""
    for i in range(count):
        n = np.rint(angle[i] * (2.0 / math.pi))
        r = ((angle[i] - n * _P1) - n * _P2) - n * _P3
        z = r * r
        s = r + r * z * (_S[0] + z * (_S[1] + z * (_S[2] + z * (_S[3] + z * (_S[4] + z * _S[5])))))
        h = 0.5 * z
        w = 1.0 - h
        polynomial = z * z * (_C[0] + z * (_C[1] + z * (_C[2] + z * (_C[3] + z * (_C[4] + z * _C[5])))))
        c = w + (((1.0 - w) - h) + polynomial)
        quarter = n - 4.0 * np.floor(0.25 * n)
        odd = quarter - 2.0 * np.floor(0.5 * quarter) == 1.0
        first, second = (c, s) if odd else (s, c)
        sin[i] = -first if quarter >= 2.0 else first
        cos[i] = -second if abs(quarter - 1.5) < 1.0 else second
    for i in range(count):
        if not abs(angle[i]) < _FAR:
            sin[i], cos[i] = math.sin(angle[i]), math.cos(angle[i])
