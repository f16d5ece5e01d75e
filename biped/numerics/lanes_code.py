"""What `biped.numerics.lanes` is compiled to."""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic as _intrinsic
from numba.extending import models, register_model

from biped.numerics.lanes import LANES

# What an intrinsic is called with is not what it is defined with.
intrinsic: Any = _intrinsic

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
def load(_, array, row):
    """See `biped.numerics.lanes.load`."""

    def code(context, builder, signature, arguments):
        x = builder.load(_row(context, builder, signature.args[0], *arguments))
        x.align = 8
        return x

    return _LANES(array, types.int64), code


@intrinsic
def store(_, array, row, x):
    """See `biped.numerics.lanes.store`."""

    def code(context, builder, signature, arguments):
        place = _row(context, builder, signature.args[0], *arguments[:2])
        builder.store(arguments[2], place, align=8)
        return context.get_dummy_value()

    return types.void(array, types.int64, _LANES), code


@intrinsic
def everywhere(_, f):
    """See `biped.numerics.lanes.everywhere`."""
    return _LANES(types.float64), lambda context, builder, signature, a: _spread(builder, a[0])


@intrinsic
def times(_, x, y):
    """See `biped.numerics.lanes.times`."""
    return _LANES(_LANES, _LANES), lambda context, builder, signature, a: builder.fmul(a[0], a[1])


@intrinsic
def plus(_, x, y):
    """See `biped.numerics.lanes.plus`."""
    return _LANES(_LANES, _LANES), lambda context, builder, signature, a: builder.fadd(a[0], a[1])


@intrinsic
def added(_, x, f, y):
    """See `biped.numerics.lanes.added`."""

    def code(context, builder, signature, arguments):
        x, f, y = arguments
        return builder.fadd(x, builder.fmul(_spread(builder, f), y))

    return _LANES(_LANES, types.float64, _LANES), code


@intrinsic
def squared(_, x, y):
    """See `biped.numerics.lanes.squared`."""

    def code(context, builder, signature, arguments):
        x, y = arguments
        return builder.fadd(x, builder.fmul(y, y))

    return _LANES(_LANES, _LANES), code


@intrinsic
def total(_, x):
    """See `biped.numerics.lanes.total`."""

    def code(context, builder, signature, arguments):
        parts = [_shuffled(builder, arguments[0], range(at, at + 4)) for at in range(0, LANES, 4)]
        four = builder.fadd(builder.fadd(parts[0], parts[1]), parts[2])
        a, b, c, d = (builder.extract_element(four, ir.Constant(_INDEX, i)) for i in range(4))
        return builder.fadd(builder.fadd(a, b), builder.fadd(c, d))

    return types.float64(_LANES), code
