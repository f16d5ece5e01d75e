"""How the parts of a march that call the system's functions are compiled."""

from numba.extending import register_jitable

shared = register_jitable(error_model="numpy", _nrt=False)
"""Compiled where the functions are, plain Python where they are plain."""
