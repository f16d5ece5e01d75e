"""How kernels are compiled, and how a loop calls them."""

from collections.abc import Callable
from functools import partial
from typing import Any

from numba import config, njit, typeof

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
