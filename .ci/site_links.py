"""Hooks of the site's generator: its version, links to the repository's other files, and nothing from the network.

Links that leave the folder of the documentation lead to the repository's address (BIPED_REPOSITORY), or else are words.
"""

from __future__ import annotations

import os
import re
import shutil
from pathlib import Path
from typing import Any

_LINK = re.compile(r"\[([^\]]*)\]\(\.\./([^)]*)\)")
_WORKER = Path(__file__).with_name("iframe-worker.js")
"""Search in pages that are opened from a folder; the generator would load it from the network."""
_REMOTE = "https://unpkg.com/iframe-worker/shim"
_VERSION = re.compile(r'^VERSION = "(.+)"$', re.MULTILINE)
_SOURCE = Path(__file__).parents[1] / "biped" / "base" / "__init__.py"


def on_config(config: Any) -> Any:
    """The header says the version: in the site's name, or by the list of published versions (`make versions`)."""
    if "MIKE_DOCS_VERSION" in os.environ:
        config["extra"]["version"] = {"provider": "mike", "alias": True}
    else:
        found = _VERSION.search(_SOURCE.read_text(encoding="utf-8"))
        assert found is not None
        config["site_name"] = f"biped {found[1]}"
    return config


def on_page_markdown(markdown: str, **_: Any) -> str:
    """A page whose links leave the folder of the documentation."""
    address = os.environ.get("BIPED_REPOSITORY", "").rstrip("/")
    return _LINK.sub(rf"[\1]({address}/blob/main/\2)" if address else r"\1", markdown)


def on_post_page(output: str, page: Any, **_: Any) -> str:
    """A page that loads nothing from the network."""
    return output.replace(_REMOTE, "../" * page.url.count("/") + f"assets/{_WORKER.name}")


def on_post_build(config: Any, **_: Any) -> None:
    """Puts what pages load instead beside them."""
    assets = Path(config["site_dir"]) / "assets"
    shutil.copyfile(_WORKER, assets / _WORKER.name)
    for page in Path(config["site_dir"]).glob("404.html"):
        page.write_text(page.read_text(encoding="utf-8").replace(_REMOTE, f"assets/{_WORKER.name}"), encoding="utf-8")
