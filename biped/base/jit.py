"""How kernels are compiled, and how a loop calls them."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from importlib.util import find_spec
from typing import Any

import numba
import numba.core.config
from numba import typeof

from biped.base.kernels import cache_folder

# numba's types know neither its settings nor what its decorators take.
config: Any = numba.core.config
njit: Any = numba.njit


@contextmanager
def cached() -> Iterator[None]:
    """Within, what numba is handed is cached in biped's own folder; NUMBA_CACHE_DIR wins.

    Elsewhere numba's settings stay as they are: a notebook's own functions do not land in biped's folder.
    """
    before = config.CACHE_DIR
    if not before and not config.DISABLE_JIT:
        config.CACHE_DIR = str(cache_folder())
    try:
        yield
    finally:
        config.CACHE_DIR = before


def _postpone_blas() -> None:
    """Lets numba take for granted that SciPy has a BLAS, which it would import, all of scipy.linalg, only to see.

    No kernel needs one; a user's own, which asks for it by name, still gets it.
    """
    if "scipy.linalg" in sys.modules or "numba.np.arraymath" in sys.modules:
        return
    sys.modules["scipy.linalg"] = None  # pyright: ignore[reportArgumentType]
    try:
        from numba.np import arraymath
    finally:
        del sys.modules["scipy.linalg"]
    arraymath._HAVE_BLAS = find_spec("scipy") is not None


_postpone_blas()

COMPILED = not config.DISABLE_JIT
"""Whether kernels are compiled (NUMBA_DISABLE_JIT is not set)."""


def kernel(function: Callable[..., Any], signature: Any = None, alone: bool = False) -> Callable[..., Any]:
    """Compile a function that allocates nothing.

    Without numba's reference counts (`_nrt`) a call on a few arrays costs 20 ns instead of 240: more than the
    arithmetic of a small mechanism. Division by zero gives inf, which whoever steps the kernel reports.

    Args:
        function: The function.
        signature: Its types, if it is to be compiled at once.
        alone: Whether Python's other threads go on while it runs (it holds no interpreter lock); for long calls.
    """
    with cached():
        return njit(signature, cache=True, error_model="numpy", _nrt=False, nogil=alone)(function)


long_kernel = partial(kernel, alone=True)
"""A kernel that runs for milliseconds: threads run such side by side."""


def bound(function: Callable[..., Any], *arguments: Any) -> Callable[..., Any]:
    """A kernel as compiled for arguments of these types: calling it skips the search for the types, 0.25 µs.

    Args:
        function: A kernel.
        arguments: Examples; every later argument must be of the same type, arrays in dtype, layout and rank.
    """
    compile_for = getattr(function, "compile", None)  # plain Python under NUMBA_DISABLE_JIT
    return function if compile_for is None else compile_for(tuple(typeof(argument) for argument in arguments))
