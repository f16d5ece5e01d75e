"""Bad calls of the regression guard and bad files of references."""

from __future__ import annotations

from tests.bad.kind import Bad

REGRESS = ("regress", "s.toml", "--file", "r.json")
LISTS = (
    '"since": "", "platform": "", "runs": [0, 1], "ends": "w", "digests": ["a"], '
    '"speed": [1.0], "cost_of_transport": [1.0], "double_support": [0.1]'
)

REFERENCES = (
    Bad("update without a reason", ("--update: --reason missing",), argv=(*REGRESS, "--update")),
    Bad("update with an empty reason", ("--update: --reason missing",), argv=(*REGRESS, "--update", "--reason", " ")),
    Bad("reason without an update", ("--reason: expected with --update",), argv=(*REGRESS, "--reason", "why")),
    Bad("costs without a reason", ("--update: --reason missing",), argv=("bench", "regress", "--update")),
    Bad("references below no folder", ("--file no/r.json: cannot be written", "folder that exists"),
        argv=("regress", "s.toml", "--file", "no/r.json", "--update", "--reason", "why")),
    Bad("references that are a folder", ("r.json: cannot be read",), files={"r.json/a.txt": "text"}, argv=REGRESS),
    Bad("references that are no JSON", ("r.json: not a file of references", "biped regress --update"),
        files={"r.json": "{"}, argv=REGRESS),
    Bad("references with an unknown key", ("r.json: not a file of references", "`speeds`"),
        files={"r.json": '{"speeds": {}}'}, argv=REGRESS),
    Bad("references of unequal lengths", ("r.json: scenarios.s: expected lists of one length",), argv=REGRESS,
        files={"r.json": '{"scenarios": {"s": {' + LISTS + "}}}"}),
    Bad("reference of a scenario that is not there", ("no scenario 'levl_normal'", "did you mean 'level_normal'?"),
        argv=("regress", "levl_normal")),
    Bad("the same scenario twice", ("a scenario 's' was named before",),
        argv=("regress", "s.toml", "./s.toml", "--file", "r.json")),
    Bad("regress without processes", ("--jobs 0: expected at least 1",), argv=(*REGRESS, "--jobs", "0")),
)  # fmt: skip
