"""numba's compiler as kernels use it: for kernels that other kernels call, and for code that is called without numba.

numba optimises every function together with all that it calls, again in each of its callers, and makes machine code and
two wrappers of it. A kernel that only compiled code calls needs none of that: its code is kept as numba writes it down,
and is linked and optimised once, in the kernel that Python calls. Besides, numba looks at thirty implementations of an
operator, most of them for strings and lists, whenever it meets one: what it finds for numbers, arrays and tuples is
remembered here while something of biped's is being compiled.
"""

import json
import math
import os
from collections.abc import Iterator
from contextlib import contextmanager
from functools import lru_cache
from typing import Any

import llvmlite.binding as llvm
from llvmlite import ir
from numba import typeof, types
from numba._dynfunc import make_function
from numba.core import caching, codegen, compiler, config, llvm_bindings, registry, typed_passes
from numba.core.compiler_machinery import register_pass

from biped.base.kernels import sealed
from biped.base.objects import BASELINE, PORTABLE, file_of, letters_of, there
from biped.base.writing import written

# numba's classes know little of themselves.
_FUNCTION: Any = types.BaseFunction
_JITTED: Any = codegen.JITCodeLibrary
CONFIG: Any = config
"""numba's settings."""
_PLAIN = (types.Number, types.Boolean, types.Array, types.BaseTuple, types.SliceType, types.Record, types.NoneType)
"""Types for which numba finds the same implementation every time."""
_known: dict[Any, Any] = {}
_search = _FUNCTION.get_call_type


def _call_type(function: Any, context: Any, arguments: Any, named: Any) -> Any:
    """The signature of a call, as `numba.types.BaseFunction.get_call_type`."""
    if named or not all(isinstance(argument, _PLAIN) for argument in arguments):
        return _search(function, context, arguments, named)
    key = context, function, tuple(arguments)
    found = _known.get(key)
    if found is None:
        found = _known[key] = _search(function, context, arguments, named)
    return found


@contextmanager
def _remembering() -> Iterator[None]:
    """Within, numba asks `_call_type`; it compiles one function at a time, one within another."""
    before = _FUNCTION.get_call_type
    _FUNCTION.get_call_type = _call_type
    try:
        yield
    finally:
        _FUNCTION.get_call_type = before


class OuterCompiler(compiler.Compiler):
    """numba's own compiler for a kernel that Python calls."""

    def _compile_core(self) -> Any:
        with _remembering():
            return super()._compile_core()


class NestedLibrary(_JITTED):
    """The code of one kernel, as numba wrote it down."""

    _whole: Any = None
    _stored: bytes | None = None

    def _optimize_functions(self, ll_module: Any) -> None:
        ll_module.data_layout = self._codegen._data_layout

    def finalize(self) -> None:
        """Whoever calls the kernel links and optimises it."""
        passes = llvm.create_new_module_pass_manager()
        # numba loads addresses of this process that nothing uses once the code is in order.
        passes.add_sroa_pass()
        passes.add_dead_code_elimination_pass()
        passes.add_global_dead_code_eliminate_pass()
        _run(passes, self._final_module, self._codegen._tm)
        self._finalize_dynamic_globals()
        self._finalized = True

    def _collect(self, found: dict[Any, Any]) -> None:
        """Notes the code of the kernel and of all that it calls, each once."""
        if self in found:
            return
        found[self] = self._get_module_for_linking() if self._stored else super()._get_module_for_linking()
        for library in self._linking_libraries:
            if isinstance(library, NestedLibrary):
                library._collect(found)
            elif library not in found:
                found[library] = library._get_module_for_linking()

    def _get_module_for_linking(self) -> Any:
        """The code of the kernel and of all that it calls."""
        if self._whole is None and self._stored:
            self._whole = llvm.parse_bitcode(self._stored)
        elif self._whole is None:
            found: dict[Any, Any] = {}
            self._collect(found)
            first, *others = found.values()
            self._whole = first.clone()
            for module in others:
                self._whole.link_in(module, preserve=True)
        return self._whole


def _entry(description: Any, environment: Any, library: Any) -> Any:
    """A stand-in for the Python function that numba expects to call the code; there is none."""
    return make_function(description.lookup_module(), description.qualname, "", 0, environment, (library,))


@register_pass(mutates_CFG=True, analysis_only=False)
class _NestedLowering(typed_passes.NativeLowering):
    _name = "nested_lowering"

    def run_pass(self, state: Any) -> bool:  # pyright: ignore[reportIncompatibleMethodOverride]
        state.library = NestedLibrary(state.targetctx.codegen(), state.func_id.func_qualname)
        state.flags.no_compile = True
        super().run_pass(state)
        entry = _entry(state.cr.fndesc, state.cr.env, state.library)
        state.targetctx.insert_user_function(entry, state.cr.fndesc, [state.library])
        state["cr"] = state.cr._replace(cfunc=entry)
        return True


class NestedCompiler(OuterCompiler):
    """numba's compiler for a kernel that other kernels call."""

    def define_pipelines(self) -> list[Any]:
        """Numba's passes with a last one that stops before machine code."""
        (passes,) = super().define_pipelines()
        passes.passes = [
            (_NestedLowering if one is typed_passes.NativeLowering else one, words) for one, words in passes.passes
        ]
        passes._finalized = False
        passes.finalize()
        return [passes]


class _CacheImpl(caching.CompileResultCacheImpl):
    def get_filename_base(self, fullname: str, abiflags: str) -> str:
        return "nested-" + super().get_filename_base(fullname, abiflags)

    def check_cachable(self, cres: Any) -> bool:
        return not cres.library.has_dynamic_globals

    def reduce(self, cres: Any) -> tuple[Any, ...]:
        description = cres.fndesc
        description.typemap = description.calltypes = None  # of which some cannot be written down
        bitcode = cres.library._get_module_for_linking().as_bitcode()
        return cres.library.name, bitcode, description, cres.environment, cres.signature

    def rebuild(self, target_context: Any, payload: tuple[Any, ...]) -> Any:
        name, bitcode, description, environment, signature = payload
        library = NestedLibrary(target_context.codegen(), name)
        library._stored, library._finalized = bitcode, True
        return compiler.compile_result(
            typing_context=target_context.typing_context,
            target_context=target_context,
            library=library,
            environment=environment,
            entry_point=_entry(description, environment, library),
            fndesc=description,
            type_annotation="",
            signature=signature,
            objectmode=False,
            lifted=(),
            reload_init=[],
            referenced_envs=[],
        )


class NestedCache(caching.FunctionCache):
    """numba's cache of a kernel that other kernels call, beside that of the same kernel as Python calls it."""

    _impl_class = _CacheImpl


def optimised(library: Any, name: str, machine: Any) -> Any:
    """The code of a kernel and of all that it calls, optimised as numba does it, with one function seen from outside.

    Args:
        library: Of the kernel, a `NestedLibrary`.
        name: The function's.
        machine: LLVM's, that it is optimised for.
    """
    module = library._get_module_for_linking().clone()
    for function in module.functions:
        if not function.is_declaration:
            function.linkage = llvm.Linkage.external if function.name == name else llvm.Linkage.internal
    vector = {"loop_vectorize": CONFIG.LOOP_VECTORIZE, "slp_vectorize": CONFIG.SLP_VECTORIZE}
    builder = llvm_bindings.create_pass_builder(machine, opt=CONFIG.OPT, **vector)
    builder.getModulePassManager().run(module, builder)
    passes = llvm.create_new_module_pass_manager()
    passes.add_global_dead_code_eliminate_pass()
    passes.add_strip_dead_prototype_pass()
    _run(passes, module, machine)
    return module


def _run(passes: Any, module: Any, machine: Any) -> None:
    passes.run(module, llvm.create_pass_builder(machine, llvm.PipelineTuningOptions()))


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
        with written(file, f".{os.urandom(6).hex()}") as part:  # workers that start together compile the same kernels
            part.write_bytes(sealed(json.dumps(head).encode() + b"\n" + code))
    except OSError:  # a full disk
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
