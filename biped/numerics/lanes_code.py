"""Intrinsics that `biped.numerics.lanes` is compiled to.

Twelve numbers are eight and four, the widths of vector registers: what is as wide as no register LLVM takes apart into
single numbers wherever a loop hands it from one turn to the next.
"""

from collections.abc import Callable, Iterable
from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic as _intrinsic
from numba.extending import models, register_model

from biped.numerics.lanes import FEW, LANES

# What an intrinsic is called with is not what it is defined with.
intrinsic: Any = _intrinsic

_INDEX = ir.IntType(32)
_BITS = ir.IntType(64)


class _Part(types.Type):
    """Numba's type of the numbers in a vector register."""

    def __init__(self, width: int):
        self.width = width
        super().__init__(f"Part({width})")


class _Lanes(types.Type):
    """Numbers side by side, in parts of these widths."""

    def __init__(self, *widths: int):
        self.parts = [_Part(width) for width in widths]
        self.starts = [sum(widths[:i]) for i in range(len(widths))]
        super().__init__(f"Lanes{widths}")


_ALL, _FEW = _Lanes(8, LANES - 8), _Lanes(FEW)


@register_model(_Part)
class _PartModel(models.PrimitiveModel):
    def __init__(self, manager, kind):
        super().__init__(manager, kind, _vector(kind.width))


@register_model(_Lanes)
class _LanesModel(models.StructModel):
    def __init__(self, manager, kind):
        named = [(f"from_{start}", part) for start, part in zip(kind.starts, kind.parts, strict=True)]
        super().__init__(manager, kind, named)


def _vector(width):
    return ir.VectorType(ir.DoubleType(), width)


def _shuffled(builder, x, indices):
    mask = ir.Constant(ir.VectorType(_INDEX, len(indices)), list(indices))
    return builder.shuffle_vector(x, ir.Constant(x.type, ir.Undefined), mask)


def _spread(builder, f, width):
    one = ir.Constant(ir.VectorType(f.type, width), ir.Undefined)
    return _shuffled(builder, builder.insert_element(one, f, ir.Constant(_INDEX, 0)), [0] * width)


def _number(value, width):
    return ir.Constant(_vector(width), [ir.Constant(ir.DoubleType(), value)] * width)


def _apart(builder, value):
    """The parts of lanes."""
    return [builder.extract_value(value, i) for i in range(len(value.type.elements))]


def _joined(builder, parts: Iterable[Any]):
    """Lanes of parts."""
    parts = list(parts)
    out = ir.Constant(ir.LiteralStructType([part.type for part in parts]), ir.Undefined)
    for i, part in enumerate(parts):
        out = builder.insert_value(out, part, i)
    return out


def _fours(builder, parts):
    """Parts of four lanes each."""
    for part in parts:
        for at in range(0, part.type.count, 4):
            yield part if part.type.count == 4 else _shuffled(builder, part, range(at, at + 4))


def _by_part(work: Callable[..., Any]) -> Callable[..., Any]:
    """Code that does the same to all parts: lanes are handed over part by part, numbers in every lane."""

    def code(context, builder, signature, arguments):
        given = list(zip(arguments, signature.args, strict=True))
        parts = []
        for i, part in enumerate(signature.return_type.parts):
            these = (
                builder.extract_value(a, i) if isinstance(kind, _Lanes) else _spread(builder, a, part.width)
                for a, kind in given
            )
            parts.append(work(builder, *these))
        return _joined(builder, parts)

    return code


def _places(context, builder, kind, array, row, lanes):
    """Where the parts of a row of an array are."""
    data = context.make_array(kind)(context, builder, array).data
    width = sum(part.width for part in lanes.parts)
    first = builder.mul(row, ir.Constant(row.type, width))
    for start, part in zip(lanes.starts, lanes.parts, strict=True):
        place = builder.gep(data, [builder.add(first, ir.Constant(row.type, start))])
        yield builder.bitcast(place, _vector(part.width).as_pointer())


def _loaded(kind_of_array, kind):
    def code(context, builder, signature, arguments):
        array, row = arguments
        places = _places(context, builder, signature.args[0], array, row, kind)
        return _joined(builder, (builder.load(place, align=8) for place in places))

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
        array, row, value = arguments
        places = _places(context, builder, signature.args[0], array, row, x)
        for place, part in zip(places, _apart(builder, value), strict=True):
            builder.store(part, place, align=8)
        return context.get_dummy_value()

    return types.void(array, types.int64, x), code


@intrinsic
def everywhere(_, f):
    """See `biped.numerics.lanes.everywhere`."""
    return _ALL(types.float64), _by_part(lambda builder, f: f)


@intrinsic
def few(_, f):
    """See `biped.numerics.lanes.few`."""
    return _FEW(types.float64), _by_part(lambda builder, f: f)


@intrinsic
def lone(_, f):
    """See `biped.numerics.lanes.lone`."""

    def code(context, builder, signature, arguments):
        return _joined(builder, [builder.insert_element(_number(0.0, FEW), arguments[0], ir.Constant(_INDEX, 0))])

    return _FEW(types.float64), code


@intrinsic
def times(_, x, y):
    """See `biped.numerics.lanes.times`."""
    return x(x, x), _by_part(lambda builder, x, y: builder.fmul(x, y))


@intrinsic
def plus(_, x, y):
    """See `biped.numerics.lanes.plus`."""
    return x(x, x), _by_part(lambda builder, x, y: builder.fadd(x, y))


@intrinsic
def added(_, x, f, y):
    """See `biped.numerics.lanes.added`."""
    return x(x, types.float64, x), _by_part(lambda builder, x, f, y: builder.fadd(x, builder.fmul(f, y)))


@intrinsic
def over(_, x, f):
    """See `biped.numerics.lanes.over`."""
    return x(x, types.float64), _by_part(lambda builder, x, f: builder.fdiv(x, f))


@intrinsic
def squared(_, x, y):
    """See `biped.numerics.lanes.squared`."""
    return x(x, x), _by_part(lambda builder, x, y: builder.fadd(x, builder.fmul(y, y)))


@intrinsic
def total(_, x):
    """See `biped.numerics.lanes.total`."""

    def code(context, builder, signature, arguments):
        first, second, third = _fours(builder, _apart(builder, arguments[0]))
        four = builder.fadd(builder.fadd(first, second), third)
        a, b, c, d = (builder.extract_element(four, ir.Constant(_INDEX, i)) for i in range(4))
        return builder.fadd(builder.fadd(a, b), builder.fadd(c, d))

    return types.float64(_ALL), code


@intrinsic
def largest(_, x):
    """See `biped.numerics.lanes.largest`."""

    def code(context, builder, signature, arguments):
        def larger(a, b):
            return builder.select(builder.fcmp_ordered(">", a, b), a, b)

        sizes = [larger(part, _number(0.0, part.type.count)) for part in _apart(builder, arguments[0])]
        first, second, third = _fours(builder, sizes)
        four = larger(larger(first, second), third)
        two = larger(_shuffled(builder, four, (0, 1)), _shuffled(builder, four, (2, 3)))
        most = larger(*(builder.extract_element(two, ir.Constant(_INDEX, i)) for i in range(2)))
        bits = ir.Constant(_BITS, 0)
        for start, part in zip(signature.args[0].starts, sizes, strict=True):
            width = part.type.count
            mask = builder.bitcast(builder.fcmp_ordered("==", part, _spread(builder, most, width)), ir.IntType(width))
            bits = builder.or_(bits, builder.shl(builder.zext(mask, _BITS), ir.Constant(_BITS, start)))
        lane = builder.cttz(bits, ir.Constant(ir.IntType(1), 1))
        return context.make_tuple(builder, signature.return_type, (most, lane))

    return types.Tuple((types.float64, types.int64))(_ALL), code


@intrinsic
def placed(_, x, lane, f):
    """See `biped.numerics.lanes.placed`."""

    def code(context, builder, signature, arguments):
        value, lane, f = arguments
        parts = []
        for start, part in zip(x.starts, _apart(builder, value), strict=True):
            width = part.type.count
            numbers = ir.Constant(ir.VectorType(lane.type, width), list(range(start, start + width)))
            here = builder.icmp_signed("==", _spread(builder, lane, width), numbers)
            parts.append(builder.select(here, _spread(builder, f, width), part))
        return _joined(builder, parts)

    return x(x, types.int64, types.float64), code
