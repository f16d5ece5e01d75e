"""docs/standard.md is what its data and its template say."""

from __future__ import annotations

import json

from biped.show import standing
from tests.studies.standard.test_study import FOUND


def test_the_page_is_what_the_data_say():
    assert standing.stored()
    assert standing.PAGE.read_text(encoding="utf-8") == standing.page(standing.stored()), "make docs"


def test_a_table_is_taken_in(tmp_path, monkeypatch):
    (tmp_path / "standard.json").write_text(json.dumps(FOUND), encoding="utf-8")
    monkeypatch.setattr(standing, "DATA", tmp_path / "data.json")
    monkeypatch.setattr(standing, "PAGE", tmp_path / "page.md")
    standing.main([f"The robot={tmp_path}"])
    page = (tmp_path / "page.md").read_text(encoding="utf-8")
    assert "## The robot\n\n`biped standard a <b> --set model=robot`" in page
    assert "<!-- tables -->" not in page
    standing.main([])
    assert (tmp_path / "page.md").read_text(encoding="utf-8") == page
