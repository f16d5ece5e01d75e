"""Kernels as object code: loaded and called by address, without numba.

What numba makes of a kernel for given types of arguments is kept (`biped.base.compiler`) as a relocatable object file
with one entry, `int32 f(result, error, *numbers)`: scalars as they are, of an array what numba's arrays consist of, of
a tuple its members in turn. LLVM, which comes with numba, links it to the few functions of the C library that it calls.
A file is made for one processor, one numba and one llvmlite, and lies in the folder that carries the digest of the
kernels' sources. One that is damaged, or calls what is not there, is not used.
"""

import ctypes
import hashlib
import json
import os
import struct
from collections.abc import Callable, Hashable
from functools import lru_cache
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from biped.base.kernels import cache_folder, digest, say_damaged, unsealed

_C_ORDER, _FORTRAN_ORDER, _ALIGNED, _WRITEABLE = 0x1, 0x2, 0x100, 0x400
"""Flags of arrays."""
_SCALARS = {bool: "?", int: "q", float: "d", np.float64: "d"}
_C = {"?": ctypes.c_uint8, "q": ctypes.c_int64, "d": ctypes.c_double}
PORTABLE = os.environ.get("BIPED_PORTABLE_KERNELS", "") not in ("", "0")
"""Whether kernels are compiled for `BASELINE`, into the package, to be shipped."""
BASELINE = "x86-64-v3"
"""The family of processors that shipped kernels are made for, as LLVM calls it."""
_BASELINE_FEATURES = ("avx2", "bmi", "bmi2", "f16c", "fma", "lzcnt", "movbe")
_RESULT = 256
"""[bytes] of the largest result."""


def kinds(value: Any) -> Hashable:
    """The kind of a value or of several: arguments of one kind are called with the same code."""
    if isinstance(value, np.ndarray):
        flags = value.flags.num & (_C_ORDER | _FORTRAN_ORDER | _ALIGNED | _WRITEABLE)
        return value.dtype, value.ndim, flags & ~_FORTRAN_ORDER if flags & _C_ORDER else flags
    if isinstance(value, tuple):
        return type(value), *map(kinds, value)
    return type(value)


def _spelt(kind: Hashable) -> str:
    """A kind for a file's name."""
    if isinstance(kind, tuple):
        return f"({', '.join(map(_spelt, kind))})"
    if isinstance(kind, np.dtype):
        return str(kind.descr) + str(kind.itemsize) if kind.names else kind.str
    return f"{kind.__module__}.{kind.__qualname__}" if isinstance(kind, type) else str(kind)


def letters_of(value: Any) -> str:
    """The numbers that a value is handed over as; see `_C`.

    Raises:
        TypeError: It cannot be.
    """
    if isinstance(value, np.ndarray):
        return "q" * (5 + 2 * value.ndim)
    if isinstance(value, tuple):
        return "".join(map(letters_of, value))
    if type(value) not in _SCALARS:
        raise TypeError(f"{type(value).__name__} is not handed over")
    return _SCALARS[type(value)]


def _numbers(value: Any, out: list[Any]) -> None:
    """Appends the numbers that a value is handed over as."""
    if isinstance(value, np.ndarray):
        out += (0, 0, value.size, value.itemsize, value.ctypes.data, *value.shape, *value.strides)
    elif isinstance(value, tuple):
        for part in value:
            _numbers(part, out)
    else:
        out.append(value)


def _handed(arguments: tuple[Any, ...]) -> list[Any]:
    """The numbers that arguments are handed over as."""
    out: list[Any] = []
    _numbers(arguments, out)
    return out


@lru_cache(maxsize=1)
def _machine() -> str:
    """Processor and compiler, which object code is made for and by.

    Raises:
        OSError: The compiler is nowhere.
    """
    llvm = import_module("llvmlite.binding")
    compiler = find_spec("numba")
    if compiler is None or compiler.origin is None:
        raise OSError("there is no numba")
    changed = Path(compiler.origin).with_name("_version.py").stat()
    try:
        features = llvm.get_host_cpu_features().flatten()
    except RuntimeError:  # not known of every processor
        features = ""
    made_by = import_module("llvmlite").__version__, str(changed.st_size), str(changed.st_mtime_ns)
    return " ".join((*made_by, llvm.get_process_triple(), llvm.get_host_cpu_name(), features))


@lru_cache(maxsize=1)
def shipped_folder() -> Path:
    """The folder of the kernels that come with the package; it need not exist."""
    package = Path(__file__).parents[1]
    return package / "compiled" / digest(package)


@lru_cache(maxsize=1)
def _is_of_baseline() -> bool:
    """Whether this processor is one of `BASELINE`."""
    llvm = import_module("llvmlite.binding")
    try:
        features = llvm.get_host_cpu_features()
    except RuntimeError:
        return False
    return all(features.get(feature) for feature in _BASELINE_FEATURES)


def _shipped(name: str, spelt: str) -> Path:
    """The file of a kernel's code that comes with the package."""
    triple = import_module("llvmlite.binding").get_process_triple()
    types = hashlib.blake2b(f"{spelt}\n{triple} {BASELINE}".encode(), digest_size=8)
    return shipped_folder() / f"{name}-{types.hexdigest()}.o"


def file_of(name: str, arguments: tuple[Any, ...]) -> Path:
    """The file that a kernel's code for arguments of these kinds is written to."""
    spelt = _spelt(kinds(arguments))
    if PORTABLE:
        return _shipped(name, spelt)
    types = hashlib.blake2b(f"{spelt}\n{_machine()}".encode(), digest_size=8)
    return cache_folder() / "objects" / f"{name}-{types.hexdigest()}.o"


def _file_that_is_there(name: str, arguments: tuple[Any, ...]) -> Path:
    """The file that a kernel's code is read from: made on this machine, else shipped."""
    file = file_of(name, arguments)
    if not file.exists() and shipped_folder().is_dir() and _is_of_baseline():
        return _shipped(name, _spelt(kinds(arguments)))
    return file


def load(name: str, arguments: tuple[Any, ...], alone: bool) -> Callable[..., Any] | None:
    """Loads a kernel's code for arguments of these kinds; None if there is none that can be used.

    Args:
        name: Of the kernel, with its module.
        arguments: Of the call.
        alone: Whether Python's other threads go on while it runs.
    """
    try:
        file = _file_that_is_there(name, arguments)
        data = file.read_bytes()
        letters = letters_of(arguments)
    except (OSError, TypeError):
        return None
    whole = unsealed(data)
    if whole is None:
        say_damaged(file.parents[1])
        return None
    head, _, code = whole.partition(b"\n")
    said = json.loads(head)
    llvm = import_module("llvmlite.binding")
    if not there(said["calls"]):
        return None
    engine = _engine()
    engine.add_object_file(llvm.ObjectFileRef.from_data(code))
    engine.finalize_object()
    return _call(engine.get_function_address(said["name"]), letters, said["result"], name, alone)


def there(calls: list[str]) -> bool:
    """Whether this process has all of the functions; LLVM would end it at the first that is missing."""
    llvm = import_module("llvmlite.binding")
    _engine()  # which looks functions up in the whole process from now on
    return all(llvm.address_of_symbol(name) for name in calls)


@lru_cache(maxsize=1)
def _engine() -> Any:
    """The linker that holds object code, of the same model of memory as numba's."""
    llvm = import_module("llvmlite.binding")
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    machine = llvm.Target.from_default_triple().create_target_machine(codemodel="jitdefault", jit=True)
    return llvm.create_mcjit_compiler(llvm.parse_assembly(""), machine)


def _call(address: int, letters: str, result: str, name: str, alone: bool) -> Callable[..., Any]:
    """A Python function that calls the code at an address; its `after(*first)` is one that calls it with scalars alone.

    Whoever calls that keeps the first arguments alive.
    """
    kind = ctypes.CFUNCTYPE if alone else ctypes.PYFUNCTYPE
    function = kind(ctypes.c_int32, ctypes.c_void_p, ctypes.c_void_p, *(_C[letter] for letter in letters))(address)

    def finish(numbers: list[Any]) -> Any:
        out, error = ctypes.create_string_buffer(_RESULT), ctypes.c_void_p()
        status = function(ctypes.addressof(out), ctypes.addressof(error), *numbers)
        if status not in (0, -2):  # -2: None
            raise RuntimeError(f"{name}: compiled code ended with status {status}")
        found = struct.unpack_from(result.strip("()"), out)
        return found if result.startswith("(") else found[0] if found else None

    def call(*arguments: Any) -> Any:
        return finish(_handed(arguments))

    def after(*first: Any) -> Callable[..., Any]:
        numbers = _handed(first)
        return lambda *scalars: finish([*numbers, *scalars])

    call.after = after
    return call
