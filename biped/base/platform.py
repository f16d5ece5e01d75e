"""The platform and the sources that the last digits of a run were measured to depend on.

How kernels are compiled does not matter: plain Python, no optimisation, a generic processor and any number of jobs give
the same bits. What matters is the library code that adds and multiplies: MuJoCo, Pinocchio, the BLAS behind NumPy (it
picks its loops by the processor) and the C library's sines (likewise). See docs/regression.md.
"""

import ctypes
import json
import platform
from contextlib import suppress
from functools import cache
from hashlib import blake2b
from importlib.metadata import version
from pathlib import Path

from biped.base.files import PACKAGE

LIBRARIES = ("mujoco", "pin", "numpy", "scipy")


@cache
def blas() -> str:
    """The name of the loops that NumPy's OpenBLAS picked for this processor, or was told to pick; empty of another."""
    import numpy as np

    for library in Path(np.__file__).parents[1].glob("numpy.libs/*openblas*"):
        with suppress(OSError, AttributeError):
            name = ctypes.CDLL(str(library)).scipy_openblas_get_corename64_
            name.restype = ctypes.c_char_p
            return name().decode()
    return ""


def here() -> dict[str, str]:
    """This platform: system, C library, the processor's vector instructions, BLAS loops and library versions."""
    import numpy as np

    simd = np.show_config(mode="dicts")["SIMD Extensions"]
    return {
        "system": f"{platform.system()} {platform.machine()}",
        "libc": " ".join(platform.libc_ver()).strip(),
        "instructions": " ".join(simd.get("found", [])),
        "blas": blas(),
        **{name: version(name) for name in LIBRARIES},
    }


def key(of: dict[str, str]) -> str:
    """A short name of a platform, by its instructions and not by the BLAS loops that these choose."""
    of = {name: value for name, value in of.items() if name != "blas"}
    return blake2b(json.dumps(of, sort_keys=True).encode(), digest_size=4).hexdigest()


def sources() -> str:
    """A short name of the present state of all compiled sources."""
    from biped.base.kernels import digest

    return digest(PACKAGE)
