"""Names for a platform and for the state of the compiled sources, which references are recorded with."""

from __future__ import annotations

import json
from hashlib import blake2b
from pathlib import Path

from biped.base.platform import here

__all__ = ["here", "key", "sources"]


def key(of: dict[str, str]) -> str:
    """A short name of a platform."""
    return blake2b(json.dumps(of, sort_keys=True).encode(), digest_size=4).hexdigest()


def sources() -> str:
    """A short name of the present state of all compiled sources."""
    import biped
    from biped.base.kernels import digest

    return digest(Path(biped.__file__).parent)
