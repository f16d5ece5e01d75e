"""docs/atlas.md is what its data and its template say."""

from __future__ import annotations

import json

import pytest

from biped.base.statistics import wilson
from biped.show import atlas
from biped.show.document import markdown


def standing(test, gait, value, limit=True, **numbers):
    """A test in which a gait withstands a value, of which nothing is sure."""
    level = {"value": value, "reached": 9, "runs": 10, "numbers": numbers, "interval": [0.6, 0.98]}
    found = (
        {"holds_to": value, "sure_to": None, "fails_at": 2.0 * value, "surely_fails_at": 2.0 * value} if limit else None
    )
    return {"test": f"standard/{test}", "gait": gait, "tried": [level], "limit": found}


def norm(value, fell=0):
    return [{"disturbance": words, "size": 0.05, "walks": 24, "fell": fell, "norm": value}
            for words in (*atlas.PUSHES, *atlas.RISES)]  # fmt: skip


def results(folder, standings, norms=(), growth=()):
    folder.mkdir()
    found = {"standings": standings, "norms": dict(norms), "growth": dict(growth)}
    (folder / "standard.json").write_text(json.dumps(found), encoding="utf-8")
    return str(folder)


def test_the_page_is_what_the_data_say():
    assert atlas.PAGE.read_text(encoding="utf-8") == atlas.page(atlas.stored()), "make docs"


@pytest.fixture
def empty(tmp_path, monkeypatch):
    for name in ("DATA", "PAGE"):
        monkeypatch.setattr(atlas, name, tmp_path / name)
    return tmp_path


def test_results_are_taken_in(empty):
    plane = [
        standing(*one, limit=limit, **numbers)
        for one, limit, numbers in (
            (("level", "mine", 0.0), False, {"speed": 0.7, "cost_of_transport": 0.2}),
            (("push_forward", "mine", 0.2), True, {"push_froude": 0.1, "push_share": 0.62}),
            (("delay", "mine", 0.003), True, {}),
            (("random_push", "mine", 0.0), False, {"steps": 12.0}),
            (("level", "calm", 0.0), False, {"speed": 0.6}),
            (("level", "sure", 0.0), False, {"speed": 0.5}),
        )
    ]
    grown = [
        {"size": 1e-3, "factor": 1.5, "low": 1.1, "high": 2.0},
        {"size": 1e-2, "factor": 9.0, "low": 9.0, "high": 9.0},
    ]
    norms = {"calm": norm(3.0), "sure": norm(3.0, fell=13), "elsewhere": norm(1.0)}
    atlas.main([results(empty / "one", plane, norms, {"mine": grown})])
    page = (empty / "PAGE").read_text(encoding="utf-8")
    assert not any(f"<!-- {name} -->" in page for name in ("plane", "other", "space", "space other", "norm"))
    assert "| mine | 9 of 10 | 0.70 | 0.20 | 0.1 (– … 0.2), 62 % |" in page
    # 12 / -ln(0.9) steps, and the ends of Wilson's interval of 9 of 10 likewise.
    assert "| mine | 3 (– … 6) | 1.5 (1.1 … 2) | – | 114 (23.2 … 665) | – |" in page
    lines = [line.split(" | ") for line in page.splitlines() if line.startswith(("| calm | 3", "| sure | –"))]
    assert [line[1:3] for line in lines] == [["3.0", "3.0"], ["–", "–"]]
    assert [line[-1] for line in lines] == ["0 of 96 |", "52 of 96 |"]
    assert "elsewhere" not in page, "a walk in space is not in the table of the plane"
    atlas.main([])
    assert (empty / "PAGE").read_text(encoding="utf-8") == page


def test_new_results_replace_those_of_the_same_gait_alone(empty):
    both = [standing("delay", gait, 0.003) for gait in ("mine", "yours")]
    atlas.main([results(empty / "one", both, {"mine": norm(1.0)}, {})])
    again = results(
        empty / "two", [standing("delay", "mine", 0.005), standing("delay", "theirs", 0.001)], {"mine": norm(2.0)}, {}
    )
    atlas.main([again])
    found = atlas.withstood(atlas.stored()["tables"], space=False)
    assert {gait: row["delay"].value for gait, row in found.items()} == {"mine": 5.0, "yours": 3.0, "theirs": 1.0}
    assert atlas.stored()["norms"]["mine"][0]["norm"] == 2.0


def test_steps_to_a_fall_are_of_walks_whose_falls_are_as_likely_at_every_step():
    """Of walks of 12 steps that fall with one chance in fifty at every step, as many stand as can be expected."""
    stood = round(4000 * 0.98**12)
    one = {"numbers": {"steps": 12.0}, "reached": stood, "runs": 4000, "interval": wilson(stood, 4000)}
    value, low, high = atlas.steps_to_fall(one)
    assert low < value < high
    assert value == pytest.approx(50.0, rel=0.02)
    astray = one | {"reached": 10, "numbers": {"steps": 12.0, "falls": 4000.0 - stood}}
    assert atlas.steps_to_fall(astray) == (value, low, high), "who strays has not fallen"
    never = {"numbers": {"steps": 12.0}, "reached": 100, "runs": 100, "interval": wilson(100, 100)}
    assert atlas._steps_text(never) == "> 318"
    assert atlas.steps_to_fall({"numbers": {"steps": None}, "reached": 0, "runs": 10, "interval": (0.0, 0.3)})[0] == 0.0


def test_small_norms_that_withstand_most_agree():
    rows = {str(i): {name: atlas.Largest(0.1 * i, None, None, False) for name in atlas._TESTS} for i in range(1, 8)}
    norms = {gait: [{"disturbance": words, "walks": 24, "fell": 0, "norm": 1.0 / int(gait)}
                    for words in (*atlas.PUSHES, *atlas.RISES)] for gait in rows}  # fmt: skip
    for gait, row in rows.items():
        row[atlas._RANDOM] = {"numbers": {"steps": 12.0}, "reached": int(gait), "runs": 8, "interval": (0.0, 1.0)}
    text = markdown(atlas.foretold(rows, norms))
    assert text.count("is 1.00") == 3
    assert text.count("7 gaits") == 3
    for one in norms["7"]:
        one["norm"] = 0.0
    unresolved = markdown(atlas.foretold(rows, norms))
    assert unresolved.count("within scatter") == 2
    assert unresolved.count("6 gaits") == 3, "a norm that is lost in the scatter has no rank"
