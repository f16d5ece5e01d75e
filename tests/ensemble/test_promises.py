"""docs/reliability.md names tests that exist."""

from __future__ import annotations

import re
from pathlib import Path

ROOT = Path(__file__).parents[2]


def test_every_promise_is_held_by_a_test():
    page = (ROOT / "docs/reliability.md").read_text(encoding="utf-8")
    tests = "\n".join(path.read_text(encoding="utf-8") for path in (ROOT / "tests/ensemble").rglob("test_*.py"))
    page = page.partition("\n## No lie walks")[0]  # a table of another kind
    promises = [line for line in page.splitlines() if line.startswith("| ") and not line.startswith("| promise")]
    assert len(promises) > 15
    for line in promises:
        assert "test_" in line, line
        for name in re.findall(r"`(test_\w+)`", line):
            assert f"def {name}(" in tests, name
        for name in re.findall(r"`((?:\w+/)*test_\w+\.py)`", line):
            assert (ROOT / "tests/ensemble" / name).is_file() or (ROOT / name).is_file(), name
