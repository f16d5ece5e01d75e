"""Where fields lie in MuJoCo's mjData, from MuJoCo's own description of it: asked only of versions not known yet."""

from __future__ import annotations

import ctypes
from typing import Any

_BASIC = {
    "int": ctypes.c_int,
    "float": ctypes.c_float,
    "double": ctypes.c_double,
    "mjtNum": ctypes.c_double,
    "size_t": ctypes.c_size_t,
    "uintptr_t": ctypes.c_size_t,
    "uint64_t": ctypes.c_uint64,
    "mjtSize": ctypes.c_int64,
    "mjtByte": ctypes.c_ubyte,
    "mjtBool": ctypes.c_bool,
}
"""The C types that structs are made of; enumerations are ints."""


def offsets(names: tuple[str, ...]) -> tuple[int, ...]:
    """Offsets [bytes] of fields of mjData, as a C compiler lays them out.

    Raises:
        KeyError: MuJoCo describes no such field, or one of a type that is not known here.
    """
    laid_out = _structure("mjData")
    known = {name for name, *_ in laid_out._fields_}
    missing = [name for name in names if name not in known]
    if missing:
        raise KeyError(missing[0])
    return tuple(getattr(laid_out, name).offset for name in names)


def _structure(name: str) -> type[ctypes.Structure]:
    from mujoco.introspect import structs

    described: tuple[Any, ...] = structs.STRUCTS[name].fields
    fields = [(field.name, _type(field.type)) for field in described]
    return type(name, (ctypes.Structure,), {"_fields_": fields})


def _type(described: Any) -> Any:
    from mujoco.introspect import ast_nodes, enums

    if isinstance(described, ast_nodes.PointerType):
        return ctypes.c_void_p
    if isinstance(described, ast_nodes.ArrayType):
        inner = _type(described.inner_type)
        for extent in reversed(described.extents):
            inner = inner * extent
        return inner
    if described.name in _BASIC:
        return _BASIC[described.name]
    return ctypes.c_int if described.name in enums.ENUMS else _structure(described.name)
