"""The documentation site: every page has a place in one of its four parts; its generator comes from a lock."""

from __future__ import annotations

import re
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path

import pytest

from biped.base import VERSION

ROOT = Path(__file__).parents[1]
TEXT = (ROOT / "mkdocs.yml").read_text(encoding="utf-8")


def test_every_page_has_a_place_and_every_place_a_page():
    placed = re.findall(r"^ +- (?:.+: )?([\w-]+\.md)$", TEXT, re.MULTILINE)
    pages = {page.name for page in (ROOT / "docs").glob("*.md") if not page.name.endswith(".in.md")}
    assert len(placed) == len(set(placed)), "a page stands twice"
    assert set(placed) == pages


def test_it_has_four_parts():
    parts = re.findall(r"^  - (.+):$", TEXT.partition("\nnav:")[2], re.MULTILINE)
    assert parts == ["Tutorials", "How-to", "Reference", "Explanation and results"]


def test_its_generator_comes_from_a_lock_with_hashes():
    lock = (ROOT / "requirements-site.lock").read_text(encoding="utf-8")
    for package in ("mkdocs-material", "mkdocstrings-python", "mike"):
        assert re.search(rf"^{package}==\S+ \\\n +--hash=sha256:", lock, re.MULTILINE)


@pytest.mark.parametrize("published", [False, True])
def test_its_header_says_the_version(monkeypatch, published):
    """A published site has a list of versions, which a site that is opened from a folder could not load."""
    spec = spec_from_file_location("site_links", ROOT / ".ci" / "site_links.py")
    assert spec is not None
    assert spec.loader is not None
    hooks = module_from_spec(spec)
    spec.loader.exec_module(hooks)
    monkeypatch.delenv("MIKE_DOCS_VERSION", raising=False)
    if published:
        monkeypatch.setenv("MIKE_DOCS_VERSION", "0.1.0")  # as mike sets it
    config = hooks.on_config({"site_name": "biped", "extra": {}})
    assert config["site_name"] == ("biped" if published else f"biped {VERSION}")
    assert ("version" in config["extra"]) == published


def test_a_release_publishes_its_site_beside_the_others():
    release = (ROOT / ".github/workflows/release.yml").read_text(encoding="utf-8")
    assert "make versions" in release
    assert "git push origin gh-pages" in release
    recipe = (ROOT / "Makefile").read_text(encoding="utf-8").partition("\nversions:")[2]
    assert "mike deploy --update-aliases --alias-type=copy $(VERSION) latest" in recipe
