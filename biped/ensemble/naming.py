"""Names of folders that nobody chose."""

from __future__ import annotations

import re
from collections.abc import Iterator
from itertools import count
from pathlib import Path

LONGEST = 100
"""[bytes] of a title in the name of a folder."""


def new_folder(root: Path, title: str) -> Path:
    """The first of root/title, root/title-2, … that does not exist."""
    return next(path for path in numbered(root, title) if not path.exists())


def numbered(root: Path, title: str) -> Iterator[Path]:
    """Yields root/title, root/title-2 and so on."""
    name = slug(title)
    yield root / name
    for number in count(2):
        yield root / f"{name}-{number}"


def slug(title: str) -> str:
    """A title as the name of one folder: no separators, no leading dots, not too long, never empty."""
    name = re.sub(r"[^\w.-]+", "-", title).strip("-.")
    return name.encode()[:LONGEST].decode(errors="ignore") or "scenario"
