"""What `biped.numerics.lanes` is compiled to."""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic as _intrinsic
from numba.extending import models, register_model

from biped.numerics.lanes import FEW, LANES

# What an intrinsic is called with is not what it is defined with.
intrinsic: Any = _intrinsic

_INDEX = ir.IntType(32)
_SEARCHED = 16
"""Lanes among which the largest is looked for: comparisons of as many fill a mask of the processor's."""


def _vector(width):
    return ir.VectorType(ir.DoubleType(), width)


class _Lanes(types.Type):
    def __init__(self, width):
        self.width = width
        super().__init__(f"Lanes({width})")


_ALL, _FEW = _Lanes(LANES), _Lanes(FEW)


@register_model(_Lanes)
class _Model(models.PrimitiveModel):
    def __init__(self, manager, kind):
        super().__init__(manager, kind, _vector(kind.width))


def _shuffled(builder, x, indices, other=None):
    mask = ir.Constant(ir.VectorType(_INDEX, len(indices)), list(indices))
    return builder.shuffle_vector(x, ir.Constant(x.type, ir.Undefined) if other is None else other, mask)


def _spread(builder, f, width):
    one = builder.insert_element(ir.Constant(_vector(width), ir.Undefined), f, ir.Constant(_INDEX, 0))
    return _shuffled(builder, one, [0] * width)


def _row(context, builder, kind, array, row, width):
    data = context.make_array(kind)(context, builder, array).data
    first = builder.gep(data, [builder.mul(row, ir.Constant(row.type, width))])
    return builder.bitcast(first, _vector(width).as_pointer())


def _loaded(kind_of_array, kind):
    def code(context, builder, signature, arguments):
        array, row = arguments
        x = builder.load(_row(context, builder, signature.args[0], array, row, kind.width))
        x.align = 8
        return x

    return kind(kind_of_array, types.int64), code


@intrinsic
def load(_, array, row):
    """See `biped.numerics.lanes.load`."""
    return _loaded(array, _ALL)


@intrinsic
def load_few(_, array, row):
    """See `biped.numerics.lanes.load_few`."""
    return _loaded(array, _FEW)


@intrinsic
def store(_, array, row, x):
    """See `biped.numerics.lanes.store`."""

    def code(context, builder, signature, arguments):
        place = _row(context, builder, signature.args[0], arguments[0], arguments[1], x.width)
        builder.store(arguments[2], place, align=8)
        return context.get_dummy_value()

    return types.void(array, types.int64, x), code


@intrinsic
def everywhere(_, f):
    """See `biped.numerics.lanes.everywhere`."""
    return _ALL(types.float64), lambda context, builder, signature, a: _spread(builder, a[0], LANES)


@intrinsic
def few(_, f):
    """See `biped.numerics.lanes.few`."""
    return _FEW(types.float64), lambda context, builder, signature, a: _spread(builder, a[0], FEW)


@intrinsic
def lone(_, f):
    """See `biped.numerics.lanes.lone`."""

    def code(context, builder, signature, arguments):
        nothing = ir.Constant(_vector(FEW), [ir.Constant(ir.DoubleType(), 0.0)] * FEW)
        return builder.insert_element(nothing, arguments[0], ir.Constant(_INDEX, 0))

    return _FEW(types.float64), code


@intrinsic
def times(_, x, y):
    """See `biped.numerics.lanes.times`."""
    return x(x, x), lambda context, builder, signature, a: builder.fmul(a[0], a[1])


@intrinsic
def plus(_, x, y):
    """See `biped.numerics.lanes.plus`."""
    return x(x, x), lambda context, builder, signature, a: builder.fadd(a[0], a[1])


@intrinsic
def added(_, x, f, y):
    """See `biped.numerics.lanes.added`."""

    def code(context, builder, signature, arguments):
        start, f, y = arguments
        return builder.fadd(start, builder.fmul(_spread(builder, f, x.width), y))

    return x(x, types.float64, x), code


@intrinsic
def over(_, x, f):
    """See `biped.numerics.lanes.over`."""
    return x(x, types.float64), lambda context, builder, signature, a: builder.fdiv(
        a[0], _spread(builder, a[1], x.width)
    )


@intrinsic
def squared(_, x, y):
    """See `biped.numerics.lanes.squared`."""

    def code(context, builder, signature, arguments):
        start, y = arguments
        return builder.fadd(start, builder.fmul(y, y))

    return x(x, x), code


@intrinsic
def total(_, x):
    """See `biped.numerics.lanes.total`."""

    def code(context, builder, signature, arguments):
        parts = [_shuffled(builder, arguments[0], range(at, at + 4)) for at in range(0, LANES, 4)]
        four = builder.fadd(builder.fadd(parts[0], parts[1]), parts[2])
        a, b, c, d = (builder.extract_element(four, ir.Constant(_INDEX, i)) for i in range(4))
        return builder.fadd(builder.fadd(a, b), builder.fadd(c, d))

    return types.float64(_ALL), code


@intrinsic
def largest(_, x):
    """See `biped.numerics.lanes.largest`."""

    def code(context, builder, signature, arguments):
        def larger(a, b):
            return builder.select(builder.fcmp_ordered(">", a, b), a, b)

        def number(value, width):
            return ir.Constant(_vector(width), [ir.Constant(ir.DoubleType(), value)] * width)

        sizes = larger(arguments[0], number(0.0, LANES))
        parts = [_shuffled(builder, sizes, range(at, at + 4)) for at in range(0, LANES, 4)]
        four = larger(larger(parts[0], parts[1]), parts[2])
        two = larger(_shuffled(builder, four, (0, 1)), _shuffled(builder, four, (2, 3)))
        most = larger(*(builder.extract_element(two, ir.Constant(_INDEX, i)) for i in range(2)))
        # Lanes that there are not stand below all others.
        wide = _shuffled(builder, sizes, range(_SEARCHED), number(-1.0, LANES))
        mask = builder.fcmp_ordered("==", wide, _spread(builder, most, _SEARCHED))
        bits = builder.zext(builder.bitcast(mask, ir.IntType(_SEARCHED)), ir.IntType(64))
        return builder.cttz(bits, ir.Constant(ir.IntType(1), 1))

    return types.int64(_ALL), code
