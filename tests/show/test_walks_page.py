"""docs/any-biped.md is what its data and its template say."""

from __future__ import annotations

import json

from biped.show import walks


def result(folder, reached):
    """Results of `biped standard` with one gait, and of the search that found it."""
    numbers = {"speed": 0.634, "cost_of_transport_absolute": 0.751, "saturation": 0.0123, "straight": 3}
    numbers["torque_rate"] = 1.625
    tests = [{"name": "any/cells/level", "title": "10 s"}, {"name": "any/cells/long", "title": "60 s"}]
    standings = [{"tried": [{"value": None, "reached": one, "runs": 20, "numbers": numbers}]} for one in reached]
    folder.mkdir()
    told = {"gaits": ["any/mine"], "tests": tests, "standings": standings}
    (folder / "standard.json").write_text(json.dumps(told), encoding="utf-8")
    (folder / "result.json").write_text(json.dumps({"runs": 1317, "cpu_seconds": 224.4}), encoding="utf-8")


def test_the_page_is_what_the_data_say():
    assert walks.PAGE.read_text(encoding="utf-8") == walks.page(walks.stored()), "make docs"


def test_results_are_taken_in(tmp_path, monkeypatch):
    result(tmp_path / "one", (19, 20))
    result(tmp_path / "two", (7, 0))
    for name in ("DATA", "PAGE"):
        monkeypatch.setattr(walks, name, tmp_path / name)
    (tmp_path / "DATA").write_text("[]", encoding="utf-8")
    walks.main([f"First={tmp_path / 'two'}", f"Second={tmp_path / 'two'}"])
    walks.main([f"First={tmp_path / 'one'},{tmp_path / 'one'}"])  # in the place of what was there; the other stays
    page = (tmp_path / "PAGE").read_text(encoding="utf-8")
    assert "<!-- tables -->" not in page
    assert "| test | First | Second |" in page
    assert "| 10 s | 19 of 20 (76 – 99 %) | 7 of 20 (18 – 57 %) |" in page
    assert "| 60 s | 20 of 20 (84 – 100 %) | 0 of 20 (0 – 16 %) |" in page
    assert "| First | 0.63 | 0.75 | 1.2% | 3 of 20 | 1.62 | – | any/mine | 1,317 | 224 |" in page
    assert "| Second | 0.63 | 0.75 | 1.2% | 3 of 20 | 1.62 | – | any/mine | – | – |" in page
    walks.main([])
    assert (tmp_path / "PAGE").read_text(encoding="utf-8") == page


def test_a_policy_stands_beside_the_law(tmp_path, monkeypatch):
    result(tmp_path / "law", (19, 20))
    result(tmp_path / "policy", (4, 20))
    told = json.loads((tmp_path / "policy/standard.json").read_bytes())
    told["standings"][0]["tried"][0]["falls"] = 1
    told["tests"].append({"name": "any/cells/stop", "title": "stops"})
    told["standings"].append({"tried": []})  # a test that is not for a policy
    (tmp_path / "policy/standard.json").write_text(json.dumps(told), encoding="utf-8")
    (tmp_path / "DATA").write_text("[]", encoding="utf-8")
    (tmp_path / "TEMPLATE").write_text("<!-- tables -->\n<!-- policies -->\n", encoding="utf-8")
    for name in ("DATA", "PAGE", "TEMPLATE"):
        monkeypatch.setattr(walks, name, tmp_path / name)
    walks.main([f"First={tmp_path / 'law'}", f"policy:First={tmp_path / 'policy'}"])
    page = (tmp_path / "PAGE").read_text(encoding="utf-8")
    assert "| test | First |" in page
    assert "| test: law, policy | First |" in page
    assert "| 10 s | 19 of 20, 4 of 20 (1 fell) |" in page
    assert "| 60 s | 20 of 20, 20 of 20 |" in page
    assert "stops" not in page


def test_new_results_replace_those_of_the_same_tests_and_keep_the_others_of_a_gait():
    def results(gait, search, **tests):
        rows = [{"name": name, "reached": count} for name, count in tests.items()]
        return {"robot": "X", "gait": gait, "tests": rows, "search": search}

    old = results("any/x", {"runs": 3}, level=1, rest=2)
    assert walks.joined(old, results("any/x", None, rest=5, stop=4)) == results(
        "any/x", {"runs": 3}, level=1, rest=5, stop=4
    )
    other = results("any/y", None, rest=5)
    assert walks.joined(old, other) == walks.joined(None, other) == other
