"""docs/thesis-programme.md is what its data and its template say."""

import json

from biped.show import programme
from biped.show.document import Table
from biped.studies.run import plan_of, run_plan, save


def test_the_page_is_what_the_data_say():
    assert programme.PAGE.read_text(encoding="utf-8") == programme.page(programme.stored()), "make docs"


def test_pictures_of_the_page_exist():
    for one in programme.stored():
        folder = programme.FIGURES / one["scenario"].rpartition("/")[2]
        assert {file.name for file in folder.iterdir()} == set(programme.DRAWN)


def test_the_programme_is_complete():
    """Every scenario of `thesis/` is on the page, with as many runs as it has now."""
    found = {one["scenario"]: one["runs"] for one in programme.stored()}
    for file in sorted((programme.DOCS.parent / "scenarios" / "thesis").glob("*.toml")):
        name = f"thesis/{file.stem}"
        assert found[name] == len(plan_of(name, [])), name


def test_results_are_taken_in(tmp_path, monkeypatch):
    few = ["randomise.runs=1", "duration=0.4", "window={start=0.0,end=0.4}", "start.jitter=0.0"]
    for name, values in (("slope_down", "[3.0, 5.0]"), ("slope_up", "[1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]")):
        sweep = f'sweep={{"ground.slope"={values},"ground.angles"=["gravity","slope"]}}'
        save(run_plan(f"thesis/{name}", plan_of(f"thesis/{name}", [*few, sweep]), 1), tmp_path / name)
    for name in ("DATA", "PAGE", "FIGURES"):
        monkeypatch.setattr(programme, name, tmp_path / name)
    monkeypatch.setattr(programme, "DOCS", tmp_path)
    programme.main([str(tmp_path / "slope_down")])
    programme.main([str(tmp_path / "slope_up")])
    programme.main([str(tmp_path / "slope_down")])  # in place of what it was, beside the other
    text = (tmp_path / "PAGE").read_text(encoding="utf-8")
    assert programme.MARK not in text
    few_kept, many_kept = json.loads((tmp_path / "DATA").read_bytes())
    assert (few_kept["runs"], len(few_kept["points"])) == (4, 4)
    assert (many_kept["runs"], len(many_kept["points"])) == (14, 14)
    tables = [block for block in programme.document_of([few_kept, many_kept]) if isinstance(block, Table)]
    assert [len(table.rows) for table in tables] == [2, 4, 2], "all scenarios, a row a point, a row an angle"
    assert len(tables[2].head) == 1 + 7
    programme.main([])
    assert (tmp_path / "PAGE").read_text(encoding="utf-8") == text
