"""docs/atlas.md is what its data and its template say."""

from __future__ import annotations

import json

from biped.show import atlas, markdown


def result(folder, gait, value, froude):
    """Results of `biped standard` with one gait: its level walk and one push."""
    folder.mkdir()
    level = {"value": None, "reached": 9, "runs": 10, "numbers": {"speed": 0.7, "cost_of_transport": 0.2}}
    push = {"value": value, "reached": 8, "runs": 10, "numbers": {"push_froude": froude}}
    limit = {"holds_to": value, "sure_to": None, "fails_at": 2.0 * value, "surely_fails_at": 2.0 * value}
    standings = [
        {"test": "standard/space_level", "gait": gait, "tried": [level], "limit": None},
        {"test": "standard/space_push_forward", "gait": gait, "tried": [push], "limit": limit},
        {"test": "standard/space_push_backward", "gait": gait, "tried": [push], "limit": limit | {"holds_to": None}},
    ]
    (folder / "standard.json").write_text(json.dumps({"standings": standings}), encoding="utf-8")


def norm(file, value, fell=0):
    kinds = [{"disturbance": words, "size": 0.05, "walks": 24, "fell": fell, "norm": value}
             for words in (*atlas.PUSHES, *atlas.RISES)]  # fmt: skip
    file.write_text(json.dumps({"kinds": kinds}), encoding="utf-8")


def test_the_page_is_what_the_data_say():
    assert atlas.PAGE.read_text(encoding="utf-8") == atlas.page(atlas.stored()), "make docs"


def test_results_are_taken_in(tmp_path, monkeypatch):
    result(tmp_path / "one", "mine", 0.2, 0.1)
    norm(tmp_path / "calm.json", 3.0)
    norm(tmp_path / "sure.json", 3.0, fell=13)
    for name in ("DATA", "PAGE"):
        monkeypatch.setattr(atlas, name, tmp_path / name)
    atlas.main([str(tmp_path / "one"), f"calm={tmp_path / 'calm.json'}", f"sure={tmp_path / 'sure.json'}"])
    page = (tmp_path / "PAGE").read_text(encoding="utf-8")
    assert not any(mark in page for mark in atlas.MARKS.values())
    assert "| mine | 9 of 10 | 0.70 | 0.20 | 0.1 (– … 0.2) | 0 (– … 0.2) |" in page
    lines = [line.split(" | ") for line in page.splitlines() if line.startswith(("| calm | 3", "| sure | –"))]
    assert [line[1:3] for line in lines] == [["3.0", "3.0"], ["–", "–"]]
    assert [line[-1] for line in lines] == ["0 of 96 |", "52 of 96 |"]
    atlas.main([])
    assert (tmp_path / "PAGE").read_text(encoding="utf-8") == page


def test_small_norms_that_withstand_most_agree():
    rows = {str(i): {name: atlas.Largest(0.1 * i, None, None, False) for name in atlas._TESTS} for i in range(1, 8)}
    norms = {gait: [{"disturbance": words, "walks": 24, "fell": 0, "norm": 1.0 / int(gait)}
                    for words in (*atlas.PUSHES, *atlas.RISES)] for gait in rows}  # fmt: skip
    text = markdown.text(atlas.foretold(rows, norms))
    assert text.count("is 1.00") == 2
    assert text.count("7 gaits") == 2
