"""Packages that are slow to import stay in the rooms that need them."""

import re
from pathlib import Path

import pytest

import biped


@pytest.mark.parametrize(
    ("package", "rooms"),
    [
        ("rerun", {("show", "recording"), ("show", "viewer.py")}),  # the latter in a notebook alone
        ("matplotlib", {("show", "figures"), ("dynamics", "bench")}),  # chapter II draws its own figures
    ],
)
def test_nothing_else_imports_it(package, rooms):
    root = Path(biped.__file__).parent
    importing = {
        file.relative_to(root).parts[:2]
        for file in root.rglob("*.py")
        if re.search(rf"^\s*(import|from) {package}\b", file.read_text(encoding="utf-8"), re.M)
    }
    assert importing == rooms
