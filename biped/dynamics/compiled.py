"""How the parts of a march that call the system's functions are compiled, and how each of them can end."""

from numba.extending import register_jitable

shared = register_jitable(error_model="numpy", _nrt=False)
"""Compiled where the functions are, plain Python where they are plain."""

OK, INDEFINITE, NOT_FINITE, NOT_PROJECTED, TOO_MANY_RETRIES, UNSETTLED, SPILLED, EVENT, NOT_LEAPT = range(9)
"""How a stage, a step or a march can end."""
