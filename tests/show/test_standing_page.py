"""Pages with tables of `biped standard` are what their data say."""

from __future__ import annotations

import json

import pytest

from biped.show import standing
from tests.studies.standard.test_study import FOUND


@pytest.mark.parametrize("name", standing.PAGES)
def test_a_page_is_what_its_data_say(name):
    assert standing.stored(name)
    assert (standing.DOCS / f"{name}.md").read_text(encoding="utf-8") == standing.page(name), "make docs"


def test_a_table_is_taken_in(tmp_path, monkeypatch):
    folder = tmp_path / "one"
    folder.mkdir()
    (folder / "standard.json").write_text(json.dumps(FOUND | {"asked_tests": ["upright/cells/"]}), encoding="utf-8")
    monkeypatch.setattr(standing, "DOCS", tmp_path)
    page = tmp_path / "robot.md"
    page.write_text("Before.\n\n<!-- tables -->\nwas here\n<!-- end of tables -->\n\nAfter.\n", encoding="utf-8")
    standing.main(["robot", f"The robot={folder}"])
    text = page.read_text(encoding="utf-8")
    assert "## The robot\n\n`biped standard a <b> --test upright/cells/ --set model=robot`" in text
    assert text.startswith("Before.")
    assert text.endswith("After.\n")
    assert "was here" not in text
    standing.main(["robot", f"The robot={folder}"])  # in the place of what was there
    assert page.read_text(encoding="utf-8") == text
