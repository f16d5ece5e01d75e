"""What is slow to import stays in the one room that needs it."""

import re
from pathlib import Path

import pytest

import biped


@pytest.mark.parametrize(("package", "room"), [("rerun", "recording"), ("matplotlib", "figures")])
def test_nothing_else_imports_it(package, room):
    root = Path(biped.__file__).parent
    importing = {
        file.relative_to(root).parts[:2]
        for file in root.rglob("*.py")
        if re.search(rf"^\s*(import|from) {package}\b", file.read_text(encoding="utf-8"), re.M)
    }
    assert importing == {("show", room)}
