"""Tuples of arrays handed on by their address.

By value an array is some eight words, and the march's room some two hundred and forty: copied at each of the eight
calls of an evaluation they took half a microsecond, more than the arithmetic of a small mechanism.
"""

from typing import Any, TypeVar

from numba import types
from numba.core import cgutils
from numba.core.typing.templates import AttributeTemplate
from numba.extending import (
    NativeValue,
    infer_getattr,
    intrinsic,
    lower_getattr_generic,
    models,
    overload,
    register_model,
    typeof_impl,
    unbox,
)

T = TypeVar("T")


class ReferenceType(types.Type):
    """The address of a named tuple, which nobody changes: its arrays stay where they are."""

    def __init__(self, target: types.BaseNamedTuple) -> None:
        """To a named tuple of this type."""
        self.target = target
        super().__init__(name=f"Reference({target})")


register_model(ReferenceType)(models.OpaqueModel)


def by_reference(named: type[T]) -> type[T]:
    """Mark a class of named tuples: compiled functions get its instances by address."""

    def reference(value: Any, c: Any) -> ReferenceType:
        return ReferenceType(types.NamedTuple([typeof_impl(x, c) for x in value], named))

    typeof_impl.register(named, reference)
    return named


def refer(x: T) -> T:
    """The address of a named tuple that compiled code has built; valid until the caller returns."""
    return x


@intrinsic
def _address(_: Any, x: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.bitcast(cgutils.alloca_once_value(builder, arguments[0]), cgutils.voidptr_t)

    return ReferenceType(x)(x), generate


@overload(refer, inline="always")
def _refer(x):  # numba compares parameters with those below, types included
    def implementation(x):
        return _address(x)  # pyright: ignore[reportCallIssue]

    return implementation


@unbox(ReferenceType)
def _unbox(reference: Any, value: Any, c: Any) -> NativeValue:
    native = c.unbox(reference.target, value)
    place = c.builder.bitcast(cgutils.alloca_once_value(c.builder, native.value), cgutils.voidptr_t)
    return NativeValue(place, is_error=native.is_error, cleanup=native.cleanup)


@infer_getattr
class _Fields(AttributeTemplate):
    key = ReferenceType

    def generic_resolve(self, reference: Any, name: str) -> Any:
        target = reference.target
        return target.types[target.fields.index(name)] if name in target.fields else None


@lower_getattr_generic(ReferenceType)
def _load(context: Any, builder: Any, reference: Any, value: Any, name: str) -> Any:
    target = reference.target
    start = builder.bitcast(value, context.get_value_type(target).as_pointer())
    return builder.load(cgutils.gep_inbounds(builder, start, 0, target.fields.index(name)))
