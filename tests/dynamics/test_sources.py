"""Nothing that the library imports may be hidden from the repository by a pattern meant for build products."""

import subprocess
from pathlib import Path

import pytest

import biped


def test_no_source_is_ignored():
    package = Path(biped.__file__).parent
    command = ["git", "ls-files", "--others", "--ignored", "--exclude-standard", "--", "*.py"]
    try:
        found = subprocess.run(command, cwd=package, capture_output=True, text=True, check=True).stdout
    except (OSError, subprocess.CalledProcessError):
        pytest.skip("not a checkout")
    assert found.split() == []
