"""The catalogue of models, controllers, readings and scenarios, with a line each. Imports nothing that simulates."""

from __future__ import annotations

from biped.base.files import SUFFIX, locate, names, read_toml
from biped.base.text import plain


def listing() -> list[tuple[str, str, str]]:
    """Every model, controller, reading and scenario that has a name: (kind, name, one line)."""
    return [(kind, name, _one_line(kind, name)) for kind in SUFFIX for name in names(kind)]


def _one_line(kind: str, name: str) -> str:
    path = locate(kind, name, "list")
    if kind == "models":
        comment = path.read_text(encoding="utf-8").partition("<!--")[2].partition("-->")[0].strip()
        return plain(comment.partition(";")[0].partition("\n")[0].strip())
    return plain(read_toml(path).get("description", ""))
