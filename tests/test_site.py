"""The documentation site: every page has a place in one of its four parts; its generator comes from a lock."""

from __future__ import annotations

import re
from pathlib import Path

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
    for package in ("mkdocs-material", "mkdocstrings-python"):
        assert re.search(rf"^{package}==\S+ \\\n +--hash=sha256:", lock, re.MULTILINE)
