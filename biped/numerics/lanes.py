"""Twelve numbers side by side, which go through the processor's vector registers together.

Twelve constraint rows fit: what is done to one row is done to all of them at once. Compilers cannot see by themselves
that the arrays of a record do not overlap, and then take numbers one by one. Every product and sum is rounded, in a
fixed order: results do not depend on how wide the registers are, and are those of plain Python, where the functions
work on arrays (12,).
"""

from __future__ import annotations

from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic as _intrinsic
from numba.extending import models, register_model

from biped.base.jit import COMPILED

# What an intrinsic is called with is not what it is defined with.
intrinsic: Any = _intrinsic

LANES = 12

_VECTOR = ir.VectorType(ir.DoubleType(), LANES)
_INDEX = ir.IntType(32)


class _Lanes(types.Type):
    def __init__(self):
        super().__init__("Lanes")


_LANES = _Lanes()


@register_model(_Lanes)
class _Model(models.PrimitiveModel):
    def __init__(self, manager, kind):
        super().__init__(manager, kind, _VECTOR)


def _shuffled(builder, x, indices):
    mask = ir.Constant(ir.VectorType(_INDEX, len(indices)), list(indices))
    return builder.shuffle_vector(x, ir.Constant(_VECTOR, ir.Undefined), mask)


def _spread(builder, f):
    one = builder.insert_element(ir.Constant(_VECTOR, ir.Undefined), f, ir.Constant(_INDEX, 0))
    return _shuffled(builder, one, [0] * LANES)


def _row(context, builder, kind, array, row):
    data = context.make_array(kind)(context, builder, array).data
    first = builder.gep(data, [builder.mul(row, ir.Constant(row.type, LANES))])
    return builder.bitcast(first, _VECTOR.as_pointer())


@intrinsic
def _load(_, array, row):
    def code(context, builder, signature, arguments):
        x = builder.load(_row(context, builder, signature.args[0], *arguments))
        x.align = 8
        return x

    return _LANES(array, types.int64), code


@intrinsic
def _store(_, array, row, x):
    def code(context, builder, signature, arguments):
        place = _row(context, builder, signature.args[0], *arguments[:2])
        builder.store(arguments[2], place, align=8)
        return context.get_dummy_value()

    return types.void(array, types.int64, _LANES), code


@intrinsic
def _all(_, f):
    return _LANES(types.float64), lambda context, builder, signature, a: _spread(builder, a[0])


@intrinsic
def _times(_, x, y):
    return _LANES(_LANES, _LANES), lambda context, builder, signature, a: builder.fmul(a[0], a[1])


@intrinsic
def _plus(_, x, y):
    return _LANES(_LANES, _LANES), lambda context, builder, signature, a: builder.fadd(a[0], a[1])


@intrinsic
def _added(_, x, f, y):
    def code(context, builder, signature, arguments):
        x, f, y = arguments
        return builder.fadd(x, builder.fmul(_spread(builder, f), y))

    return _LANES(_LANES, types.float64, _LANES), code


@intrinsic
def _squared(_, x, y):
    def code(context, builder, signature, arguments):
        x, y = arguments
        return builder.fadd(x, builder.fmul(y, y))

    return _LANES(_LANES, _LANES), code


@intrinsic
def _total(_, x):
    def code(context, builder, signature, arguments):
        parts = [_shuffled(builder, arguments[0], range(at, at + 4)) for at in range(0, LANES, 4)]
        four = builder.fadd(builder.fadd(parts[0], parts[1]), parts[2])
        a, b, c, d = (builder.extract_element(four, ir.Constant(_INDEX, i)) for i in range(4))
        return builder.fadd(builder.fadd(a, b), builder.fadd(c, d))

    return types.float64(_LANES), code


def _plain_store(array, row, x):
    array.reshape(-1, LANES)[row] = x


def _plain_total(x):
    a, b, c, d = x[:4] + x[4:8] + x[8:]
    return (a + b) + (c + d)


load = _load if COMPILED else lambda array, row: np.array(array.reshape(-1, LANES)[row])
"""(array, row): the numbers of a row of an array (n, 12), contiguous; one of (n, 24) has two of them in a row."""
store = _store if COMPILED else _plain_store
"""(array, row, x): writes a row."""
everywhere = _all if COMPILED else lambda f: np.full(LANES, f)
"""(f): a number in every lane."""
times = _times if COMPILED else lambda x, y: x * y
"""(x, y): products."""
plus = _plus if COMPILED else lambda x, y: x + y
"""(x, y): sums."""
added = _added if COMPILED else lambda x, f, y: x + f * y
"""(x, f, y): x + f y for a number f."""
squared = _squared if COMPILED else lambda x, y: x + y * y
"""(x, y): x + y²."""
total = _total if COMPILED else _plain_total
"""(x): the sum of all lanes."""
