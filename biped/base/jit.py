"""How kernels are compiled, and how a loop calls them."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
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


def kernel(function: Callable[..., Any], signature: Any = None) -> Callable[..., Any]:
    """Compile a function that allocates nothing.

    Without numba's reference counts (`_nrt`) a call on a few arrays costs 20 ns instead of 240: more than the
    arithmetic of a small mechanism. Division by zero gives inf, which whoever steps the kernel reports.
    """
    with cached():
        return njit(signature, cache=True, error_model="numpy", _nrt=False)(function)


def bound(function: Callable[..., Any], *arguments: Any) -> Callable[..., Any]:
    """A kernel as compiled for arguments of these types: calling it skips the search for the types, 0.25 µs.

    Args:
        function: A kernel.
        arguments: Examples; every later argument must be of the same type, arrays in dtype, layout and rank.
    """
    compile_for = getattr(function, "compile", None)  # plain Python under NUMBA_DISABLE_JIT
    return function if compile_for is None else compile_for(tuple(typeof(argument) for argument in arguments))
