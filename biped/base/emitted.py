"""Writes code that numba has compiled as object code that is called without it (`biped.base.objects`)."""

import json
import math
from functools import lru_cache
from typing import Any

import llvmlite.binding as llvm
from llvmlite import ir
from numba import typeof, types
from numba.core import registry

from biped.base.nested import CONFIG, optimised
from biped.base.objects import BASELINE, PORTABLE, file_of, letters_of, there
from biped.base.sealed import sealed
from biped.base.writing import written

# numba's types know little of itself.
_TARGET: Any = registry.cpu_target
_ARRAY = ("meminfo", "parent", "nitems", "itemsize", "data", "shape", "strides")
"""Fields of numba's arrays."""
_RESULTS = {types.none: "", types.int64: "q", types.float64: "d", types.boolean: "?"}


def write(name: str, dispatcher: Any, arguments: tuple[Any, ...]) -> bool:
    """Compiles a kernel for arguments of these kinds and writes its object code; returns whether it could.

    It cannot where numba hands anything over, or calls anything, that `biped.base.objects` does not know.

    Args:
        name: Of the kernel, with its module.
        dispatcher: numba's own of the kernel, for calls from other kernels.
        arguments: Of the call.
    """
    kinds = tuple(typeof(argument) for argument in arguments)
    dispatcher.compile(kinds)
    compiled = dispatcher.overloads[kinds]
    try:
        known = letters_of(arguments) == _parameters(kinds)
    except TypeError:
        return False
    result = _result(compiled.signature.return_type)
    if not known or result is None:
        return False
    code, calls = _object(compiled)
    if not code or not there(calls):
        return False
    head = {"name": compiled.fndesc.llvm_func_name, "result": result, "calls": calls}
    file = file_of(name, arguments)
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        with written(file) as part:
            part.write_bytes(sealed(json.dumps(head).encode() + b"\n" + code))
    except OSError:  # a full disk, or another process that keeps the same
        return False
    return True


def _parameters(kinds: tuple[Any, ...]) -> str | None:
    """The numbers that numba's code takes for arguments of these types; None if they are not as known here."""
    context = _TARGET.target_context
    if context.data_model_manager.lookup(types.float64[:])._fields != _ARRAY:
        return None
    letters = ""
    for kind in context.get_arg_packer(kinds).argument_types:
        if isinstance(kind, ir.PointerType) or kind == ir.IntType(64):
            letters += "q"
        elif kind == ir.DoubleType():
            letters += "d"
        elif kind == ir.IntType(8):
            letters += "?"
        else:
            return None
    return letters


def _result(kind: Any) -> str | None:
    """The numbers of a result of a type, in brackets if it is a tuple; None if it is anything else."""
    if not isinstance(kind, types.BaseTuple):
        return _RESULTS.get(kind)
    parts: Any = kind
    letters = [_RESULTS.get(part) for part in parts]
    return f"({''.join(letter for letter in letters if letter)})" if all(letters) else None


@lru_cache(maxsize=1)
def _portable_machine() -> Any:
    """LLVM's machine of all processors that shipped kernels run on."""
    target = llvm.Target.from_triple(llvm.get_process_triple())
    return target.create_target_machine(cpu=BASELINE, opt=CONFIG.OPT, reloc="static", codemodel="jitdefault", jit=True)


def _object(compiled: Any) -> tuple[bytes, list[str]]:
    """Object code of a compiled kernel without what Python calls it by, and the functions of others that it calls.

    There is none (b"") of a kernel that holds addresses of this process.
    """
    machine = _portable_machine() if PORTABLE else _TARGET.target_context.codegen()._tm
    module = optimised(compiled.library, compiled.fndesc.llvm_func_name, machine)
    if any(variable.name.startswith("numba.dynamic.globals") for variable in module.global_variables):
        return b"", []
    calls = [function.name for function in module.functions if function.is_declaration]
    # llvm.sin.f64 is a call of sin, llvm.fabs.f64 an instruction.
    parts = [call.split(".") for call in calls]
    needed = {
        part[1] if part[0] == "llvm" else part[0] for part in parts if part[0] != "llvm" or hasattr(math, part[1])
    }
    return machine.emit_object(module), sorted(needed)
