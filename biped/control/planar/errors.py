"""Errors of the controller's M and A that are drawn anew at every tick (Fig 3.14 does not say how often).

The generator is the combined one of L'Ecuyer (Communications of the ACM 31, 1988): its products fit into 64 bits with a
sign, so that compiled code and plain Python find the same numbers. Normals are Box and Muller's (1958).
"""

import math

from biped.base.jit import kernel
from biped.robot.planar.topology import N_ROWS, NQ

_M1, _A1, _M2, _A2 = 2147483563, 40014, 2147483399, 40692
GENERATOR_SEEDS = _M2
"""Both states begin between 1 and this, exclusive."""


@kernel
def uniform(generator):
    """A number in (0, 1); advances the generator's two states."""
    generator[0] = generator[0] * _A1 % _M1
    generator[1] = generator[1] * _A2 % _M2
    z = generator[0] - generator[1]
    if z < 1:
        z += _M1 - 1
    return z / _M1


@kernel
def redraw(belief):
    """Draws the factors of M (9, 9), of which the upper triangle counts, and of A (10, 9): 1 + error N(0, 1) each."""
    generator = belief["generator"]
    for i in range(NQ + N_ROWS):
        for j in range(NQ):
            radius = math.sqrt(-2.0 * math.log(uniform(generator)))
            z = radius * math.cos(2.0 * math.pi * uniform(generator))
            if i < NQ:
                belief["mass_factor"][i, j] = 1.0 + belief["mass_error"] * z
            else:
                belief["row_factor"][i - NQ, j] = 1.0 + belief["row_error"] * z
