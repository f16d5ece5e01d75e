"""How kernels are compiled, and how a loop calls them.

Nothing here imports numba until something has to be compiled: importing it and loading from its cache cost more than
ten seconds of walking. Kernels that a run calls from Python are loaded as object code instead (`biped.base.objects`).
"""

import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import lru_cache, partial, update_wrapper
from hashlib import blake2b
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from threading import RLock
from typing import Any

from biped.base.kernels import cache_file_of, cache_folder

SETTINGS = any(name.startswith("NUMBA_") for name in os.environ) or Path(".numba_config.yaml").exists()
"""Whether numba has been told how to compile: then it compiles everything, and what it says is asked of it."""


@lru_cache(maxsize=1)
def numba() -> Any:
    """numba, which takes for granted that SciPy has a BLAS: it would import all of scipy.linalg only to see.

    No kernel needs one; a user's own, which asks for it by name, still gets it. Records are named after what is in
    them: numba numbers them as a process meets them, so that of code for two records which two processes had compiled,
    both third, either took itself for the other.
    """
    out: Any = import_module("numba")
    if "scipy.linalg" not in sys.modules and "numba.np.arraymath" not in sys.modules:
        sys.modules["scipy.linalg"] = None  # pyright: ignore[reportArgumentType]
        try:
            arraymath: Any = import_module("numba.np.arraymath")
        finally:
            del sys.modules["scipy.linalg"]
        arraymath._HAVE_BLAS = find_spec("scipy") is not None
    out.types.Record.mangling_args = property(lambda one: ("Record", (blake2b(one.name.encode()).hexdigest()[:24],)))
    return out


COMPILED = not ((SETTINGS or "numba" in sys.modules) and numba().config.DISABLE_JIT)
"""Whether kernels are compiled (NUMBA_DISABLE_JIT is not set)."""


@contextmanager
def cached() -> Iterator[None]:
    """Within, what numba is handed is cached in biped's own folder; NUMBA_CACHE_DIR wins.

    Elsewhere numba's settings stay as they are: a notebook's own functions do not land in biped's folder.
    """
    config: Any = import_module("numba.core.config")
    numba()
    before = config.CACHE_DIR
    if not before and not config.DISABLE_JIT:
        config.CACHE_DIR = str(cache_folder())
    try:
        yield
    finally:
        config.CACHE_DIR = before


_lock = RLock()


class Deferred:
    """Something that compiled code uses, made when it is first called or first compiled into something.

    Args:
        make: Makes it, once.
    """

    def __init__(self, make: Callable[[], Any]):
        self._make = make
        self._value: Any = None

    @property
    def value(self) -> Any:
        """The thing itself."""
        if self._value is None:
            with _lock:
                if self._value is None:
                    self._value = self._make()
        return self._value

    def __call__(self, *arguments: Any) -> Any:
        """Calls it."""
        return self.value(*arguments)

    @property
    def _numba_type_(self) -> Any:
        """Of which type it is, as numba asks of everything that compiled code names."""
        context = import_module("numba.core.registry").cpu_target.typing_context
        value = self.value
        context.refresh()  # knows what has been imported meanwhile
        return context.resolve_value_type(value)


def intrinsic(module: str, name: str) -> Callable[..., Any]:
    """A function that a module defines for numba and compiled code calls, imported when it is first called."""
    return Deferred(lambda: getattr(import_module(module), name))


class Kernel(Deferred):
    """A function that is compiled when it is first called.

    Args:
        function: The function.
        options: Of numba.njit.
        entry: Whether it is called as object code where there is some.

    Attributes:
        py_func: The function.
        loaded: Whether it is called as object code where there is some.
        nested: numba's dispatcher of the function for calls from other kernels.
    """

    def __init__(self, function: Callable[..., Any], options: dict[str, Any], entry: bool):
        super().__init__(self._dispatcher)
        update_wrapper(self, function)
        self.py_func, self._options = function, options
        self.loaded = entry and not SETTINGS
        self.nested = Deferred(self._nested_dispatcher)
        self._codes: dict[Any, Callable[..., Any]] = {}

    def _dispatcher(self) -> Any:
        with cached():
            from biped.base.compiler import OuterCompiler

            return _apart(numba().njit(pipeline_class=OuterCompiler, **self._options)(self.py_func))

    def _nested_dispatcher(self) -> Any:
        with cached():
            from biped.base.compiler import NestedCache, NestedCompiler

            options = self._options | {"cache": False, "no_cpython_wrapper": True, "no_cfunc_wrapper": True}
            made = numba().njit(pipeline_class=NestedCompiler, **options)(self.py_func)
            made._cache = NestedCache(self.py_func)
            return _apart(made)

    @property
    def _numba_type_(self) -> Any:
        """Of which type it is, as numba asks of everything that compiled code names."""
        return self.nested._numba_type_

    def __call__(self, *arguments: Any) -> Any:
        """Calls it."""
        return self.code(arguments)(*arguments) if self.loaded else self.value(*arguments)

    def code(self, arguments: tuple[Any, ...]) -> Callable[..., Any]:
        """The code that is called for arguments of these kinds."""
        from biped.base import objects  # which takes numpy

        kinds = objects.kinds(arguments)
        code = self._codes.get(kinds)
        if code is None:
            with _lock:
                name, alone = f"{self.__module__}.{self.__qualname__}", self._options["nogil"]
                code = objects.load(name, arguments, alone)
                if code is None and self._write(name, arguments):
                    code = objects.load(name, arguments, alone)
                code = self._codes[kinds] = code or self.value
        return code

    def _write(self, name: str, arguments: tuple[Any, ...]) -> bool:
        from biped.base.compiler import write  # which takes numba

        return write(name, self.nested.value, arguments)

    @property
    def signatures(self) -> list[Any]:
        """Types of arguments for which there is code in this process."""
        return [*self._codes, *(self._value.signatures if self._value is not None else ())]

    def __getattr__(self, name: str) -> Any:
        """The other attributes of numba's dispatchers: `stats`, `overloads`, `compile`."""
        if name.startswith("_"):
            raise AttributeError(name)
        return getattr(self.value, name)

    def __reduce__(self) -> str:
        """Processes hand a kernel to each other by name."""
        return self.py_func.__qualname__


def _apart(dispatcher: Any) -> Any:
    """A dispatcher whose code is kept in files of its process's own, with checksums.

    numba numbers the files of a function: two processes that compile it for different types at the same moment both
    write number 1, and the index, whoever of them writes it last, may give one's types the other's code.
    """
    kept = dispatcher._cache._cache_file = cache_file_of(dispatcher._cache._cache_file)
    kept._data_name_pattern = kept._data_name_pattern.replace("{number", f"{os.urandom(6).hex()}.{{number")
    return dispatcher


def kernel(
    function: Callable[..., Any],
    signature: Any = None,
    alone: bool = False,
    entry: bool = False,
    within: bool = False,
) -> Callable[..., Any]:
    """Compile a function that allocates nothing.

    Without numba's reference counts (`_nrt`) a call on a few arrays costs 20 ns instead of 240: more than the
    arithmetic of a small mechanism. Division by zero gives inf, which whoever steps the kernel reports.

    Args:
        function: The function.
        signature: Its types, if it is to be compiled at once.
        alone: Whether Python's other threads go on while it runs (it holds no interpreter lock); for long calls.
        entry: Whether Python calls it a few times a run: then it is kept as object code, which is loaded in a tenth of
            the time that numba takes; but a call takes 20 µs.
        within: Whether its code always becomes part of the kernel that calls it: an array is handed over as seven
            numbers or more, a tuple of them as hundreds, one by one; for what a loop calls at one place.
    """
    if not COMPILED:
        return function
    options = {"cache": True, "error_model": "numpy", "_nrt": False, "nogil": alone, "forceinline": within}
    if signature is None:
        return Kernel(function, options, entry)
    with cached():
        made = _apart(numba().njit(**options)(function))
        made.compile(signature)
        made.disable_compile()
        return made


entry_kernel = partial(kernel, entry=True)
"""A kernel that Python calls a few times a run."""

inner_kernel = partial(kernel, within=True)
"""A kernel that becomes part of whatever kernel calls it."""

long_kernel = partial(kernel, alone=True, entry=True)
"""A kernel that runs for milliseconds: threads run such side by side."""


def begun(function: Callable[..., Any], *first: Any) -> Callable[..., Any]:
    """A kernel whose first arguments are handed over once, where a run calls it often: 2 µs a call instead of 100.

    Args:
        function: A kernel.
        first: Its first arguments; all later ones are scalars, of the same types in every call.
    """
    if not (isinstance(function, Kernel) and function.loaded):
        return partial(function, *first)
    codes: list[Callable[..., Any]] = []

    def call(*scalars: Any) -> Any:
        if not codes:
            made = function.code((*first, *scalars))
            codes.append(made.after(*first) if hasattr(made, "after") else partial(made, *first))
        return codes[0](*scalars)

    return call


def bound(function: Callable[..., Any], *arguments: Any) -> Callable[..., Any]:
    """A kernel as compiled for arguments of these types: calling it skips the search for the types, 0.25 µs.

    Args:
        function: A kernel.
        arguments: Examples; every later argument must be of the same type, arrays in dtype, layout and rank.
    """
    if not isinstance(function, Kernel):  # plain Python under NUMBA_DISABLE_JIT
        return function
    return function.value.compile(tuple(numba().typeof(argument) for argument in arguments))
