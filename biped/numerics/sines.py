"""Sines and cosines of a few angles at once, without a branch, so that they share vector registers.

Angles are reduced to |r| <= π/4 by multiples of π/2 in three parts (Cody & Waite, Software Manual for the Elementary
Functions, 1980); the polynomials there are those of fdlibm (Sun Microsystems, 1993). Within 1.2e-16 of the truth.
"""

import math

import numpy as np

from biped.base.jit import kernel

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
