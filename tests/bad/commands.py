"""Bad command lines."""

from __future__ import annotations

from tests.bad.kind import Bad


def set_(*changes: str) -> tuple[str, ...]:
    return ("run", "s.toml", *(word for change in changes for word in ("--set", change)))


COMMAND_LINES = (
    Bad("unknown command", ("'rnu'", "did you mean 'run'?"), argv=("rnu", "s.toml")),
    Bad("no command", ("COMMAND",), argv=()),
    Bad("run of nothing", ("scenario",), argv=("run",)),
    Bad("unknown option", ("--jbos", "did you mean '--jobs'?"), argv=("run", "s.toml", "--jbos", "2")),
    Bad("malformed change", ("--set ground.slope: expected KEY=VALUE",), argv=set_("ground.slope")),
    Bad("change without a value", ("--set controller=: expected a value after =",), argv=set_("controller=")),
    Bad("change to no value", ("--set ground.slope=[1,: ", "TOML"), argv=set_("ground.slope=[1,")),
    Bad("change of an unknown key", ("--set: ground.slop: unknown key", "'slope'"), argv=set_("ground.slop=1")),
    Bad("change to an impossible value", ("--set: ground.friction: expected", ">= 0"), argv=set_("ground.friction=-1")),
    Bad("change of a push", ("--set: push[0].at: expected", "duration"),
        argv=set_("push=[{at=20.0,duration=0.2,force=[200.0,0.0]}]")),
    Bad("change of a table to a number", ("--set: ground: expected a table",), argv=set_("ground=1")),
    Bad("unknown engine option", ("--set: engine: expected one of mujoco", "'mujoco'"),
        argv=("run", "s.toml", "--engine", "mojoco")),
    Bad("no processes", ("--jobs 0: expected at least 1",), argv=("run", "s.toml", "--jobs", "0")),
    Bad("processes that are no number", ("--jobs", "'two'"), argv=("run", "s.toml", "--jobs", "two")),
    Bad("run that is not in the ensemble", ("--only 1: expected", "0"), argv=("run", "s.toml", "--only", "1")),
    Bad("folder below a file", ("--out a.txt/here: cannot be written", "another folder"), files={"a.txt": "text"},
        argv=("run", "s.toml", "--out", "a.txt/here")),
    Bad("folder that is a file", ("--out a.txt: already holds something else", "new folder"), files={"a.txt": "text"},
        argv=("run", "s.toml", "--out", "a.txt")),
    Bad("folder that holds something else", ("--out mine: already holds something else", "new folder"),
        files={"mine/notes.txt": "text"}, argv=("run", "s.toml", "--out", "mine")),
    Bad("folder of another scenario", ("--out mine: already holds something else",),
        files={"mine/scenario.toml": "duration = 3.0"}, argv=("run", "s.toml", "--out", "mine")),
    Bad("one folder for two scenarios", ("--out", "one scenario"),
        argv=("run", "s.toml", "level_normal", "--out", "x")),
    Bad("fault in the second of two scenarios", ("t.toml: duration: expected",), files={"t.toml": "duration = 0.0"},
        argv=("run", "s.toml", "t.toml")),
    Bad("check without expectations", ("s.toml: expect: missing", "falls = { max = 0 }"), argv=("check", "s.toml")),
    Bad("report below a file", ("--junit a.txt/r.xml: cannot be written",), "expect.falls = { max = 1 }",
        files={"a.txt": "text"}, argv=("check", "s.toml", "--junit", "a.txt/r.xml")),
    Bad("plot of what is no result", ("mine", "expected a results folder", "result.json"),
        files={"mine/notes.txt": "text"}, argv=("plot", "mine")),
    Bad("plot of nothing", ("nowhere", "expected a results folder"), argv=("plot", "nowhere")),
    Bad("plot of a broken result", ("mine/result.json", "expected"), argv=("plot", "mine"),
        files={"mine/result.json": "{", "mine/scenario.toml": ""}),
    Bad("view of what is no result", ("mine", "expected a results folder"), files={"mine/notes.txt": "text"},
        argv=("view", "mine")),
    Bad("view of a missing recording", ("walk.rrd", "expected"), argv=("view", "walk.rrd")),
    Bad("view without a recording", ("runs/", "biped run level_normal --record"), argv=("view",)),
)  # fmt: skip
