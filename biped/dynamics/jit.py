"""How the kernels are compiled."""

from collections.abc import Callable
from typing import Any

from numba import njit


def kernel(function: Callable[..., Any], signature: Any = None) -> Callable[..., Any]:
    """Compile a function that allocates nothing.

    Without numba's reference counts (`_nrt`) a call on a few arrays costs 20 ns instead of 240: more than the
    arithmetic of a small mechanism. Division by zero gives inf, which the marching loop reports.
    """
    return njit(signature, cache=True, error_model="numpy", _nrt=False)(function)
