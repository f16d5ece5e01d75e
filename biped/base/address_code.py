"""Intrinsics that `biped.base.address` is compiled to."""

from typing import Any

from llvmlite import ir
from numba import int64, types
from numba.extending import intrinsic as _intrinsic
from numba.np.arrayobj import populate_array

# What an intrinsic is called with is not what it is defined with.
intrinsic: Any = _intrinsic

_BYTE = ir.IntType(8).as_pointer()


@intrinsic
def call(_, function, first, second):
    """See `biped.base.address.call`."""

    def code(context, builder, signature, arguments):
        kind = ir.FunctionType(ir.VoidType(), [_BYTE, _BYTE]).as_pointer()
        address, *pointers = arguments
        builder.call(builder.inttoptr(address, kind), [builder.inttoptr(pointer, _BYTE) for pointer in pointers])
        return context.get_dummy_value()

    return types.void(types.int64, types.int64, types.int64), code


@intrinsic
def move(_, function, first, second, third, number):
    """See `biped.base.address.move`."""

    def code(context, builder, signature, arguments):
        kind = ir.FunctionType(ir.VoidType(), [_BYTE, _BYTE, _BYTE, ir.DoubleType()]).as_pointer()
        address, *pointers, amount = arguments
        given = [builder.inttoptr(pointer, _BYTE) for pointer in pointers]
        builder.call(builder.inttoptr(address, kind), [*given, amount])
        return context.get_dummy_value()

    return types.void(types.int64, types.int64, types.int64, types.int64, types.float64), code


@intrinsic
def int32_at(_, address):
    """See `biped.base.address.int32_at`."""

    def code(context, builder, signature, arguments):
        place = builder.inttoptr(arguments[0], ir.IntType(32).as_pointer())
        return builder.sext(builder.load(place), ir.IntType(64))

    return int64(types.int64), code


def _array_at(number: Any, item: Any, bytes_each: int, rank: int) -> Any:
    """Code and type of an array whose own address is kept at an address.

    numba's `carray` is refused where there are no reference counts.
    """
    kind = types.Array(number, rank, "C")

    def code(context, builder, signature, arguments):
        place = builder.inttoptr(arguments[0], item.as_pointer().as_pointer())
        array = context.make_array(kind)(context, builder)
        sizes = arguments[1:]
        each = context.get_constant(types.intp, bytes_each)
        strides = [each] if rank == 1 else [builder.mul(sizes[1], each), each]
        populate_array(array, builder.load(place), sizes, strides, each, None)
        return array._getvalue()

    return code, kind


@intrinsic
def doubles_at(_, address, count):
    """See `biped.base.address.doubles_at`."""
    code, kind = _array_at(types.float64, ir.DoubleType(), 8, 1)
    return kind(types.int64, types.int64), code


@intrinsic
def rows_at(_, address, rows, width):
    """See `biped.base.address.rows_at`."""
    code, kind = _array_at(types.float64, ir.DoubleType(), 8, 2)
    return kind(types.int64, types.int64, types.int64), code


@intrinsic
def int32_rows_at(_, address, rows, width):
    """See `biped.base.address.int32_rows_at`."""
    code, kind = _array_at(types.int32, ir.IntType(32), 4, 2)
    return kind(types.int64, types.int64, types.int64), code
