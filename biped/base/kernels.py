"""Where compiled kernels are kept: a folder of their own for every version of their sources.

numba's cache looks only at the file of the function that it compiles: a cached tick would go on calling the springs
that it was compiled with after they have changed in another file, by an edit or an update. So the folder's name carries
a digest of every source that kernels are made of.
"""

from __future__ import annotations

import os
import shutil
import sys
from pathlib import Path

_MARKS = (b"njit", b"biped.base.jit", b"numba.extending")
_CONSTANTS = ("trajectory.py", "topology.py", "leg_states.py")
"""Files without kernels whose numbers kernels take in."""


def digest(package: Path) -> str:
    """A name for the present state of all sources of kernels below a package."""
    from hashlib import blake2b

    state = blake2b(digest_size=8)
    for path in sorted(package.rglob("*.py")):
        text = path.read_bytes()
        if any(mark in text for mark in _MARKS) or path.name in _CONSTANTS:
            state.update(str(path.relative_to(package)).encode() + b"\0" + text)
    return state.hexdigest()


def place_cache() -> None:
    """Points numba to this version's folder; versions that are no more are removed. NUMBA_CACHE_DIR wins."""
    if "NUMBA_CACHE_DIR" in os.environ:
        return
    package = Path(__file__).parents[1]
    root = package / "__pycache__"
    if not os.access(package, os.W_OK):
        root = Path.home() / ".cache" / "biped"
    folder = root / f"kernels-{digest(package)}"
    if not folder.is_dir():
        for old in root.glob("kernels-*"):
            shutil.rmtree(old, ignore_errors=True)
    os.environ["NUMBA_CACHE_DIR"] = str(folder)
    if "numba" in sys.modules:  # it has read its settings already
        from numba import config

        config.CACHE_DIR = str(folder)
