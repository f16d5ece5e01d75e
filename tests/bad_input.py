"""Kinds of bad input: what a user wrote, and what the answer must say about it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import NamedTuple

HUMAN = (Path(__file__).parent.parent / "models" / "human.xml").read_text(encoding="utf-8")


class Bad(NamedTuple):
    """One kind of bad input.

    Attributes:
        name: What is wrong.
        says: Fragments that the message must contain: file, key, expectation, nearest valid name.
        scenario: Text of s.toml.
        argv: Command line; default: run s.toml.
        files: More files, by path.
    """

    name: str
    says: tuple[str, ...]
    scenario: str = ""
    argv: tuple[str, ...] = ("run", "s.toml")
    files: Mapping[str, str | bytes] = {}


def model(edit: Callable[[str], str]) -> dict[str, str]:
    """A model file m.xml that differs from the human one."""
    text = edit(HUMAN)
    assert text != HUMAN
    return {"m.xml": text}


def swap(old: str, new: str, count: int = -1) -> dict[str, str]:
    return model(lambda text: text.replace(old, new, count))


def drop(start: str, end: str) -> dict[str, str]:
    """The human model without the text from `start` to `end` (both included)."""

    def edit(text: str) -> str:
        before, _, rest = text.partition(start)
        return before + rest.partition(end)[2]

    return model(edit)


def law(body: str, init: str = "pass") -> dict[str, str]:
    """A user's control law l.py."""
    return {
        "l.py": "import math\nimport numpy as np\n\n\nclass Mine:\n"
        f"    def __init__(self, setup):\n        {init}\n\n"
        f"    def torques(self, sensed):\n        {body}\n"
    }


def set_(*changes: str) -> tuple[str, ...]:
    return ("run", "s.toml", *(word for change in changes for word in ("--set", change)))


SCENARIO_FILES = (
    Bad("unknown key", ("s.toml: duraton: unknown key", "'duration'"), "duraton = 3.0"),
    Bad("unknown nested key", ("s.toml: ground.slop: unknown key", "'slope'"), "[ground]\nslop = 3.0"),
    Bad("unknown key of a push", ("s.toml: push[0].bdy: unknown key", "'body'"),
        "[[push]]\nat = 0.1\nduration = 0.1\nforce = [1.0, 0.0]\nbdy = 'torso'"),
    Bad("unknown key of an expectation", ("s.toml: expect.speed.mni: unknown key", "'min'"),
        "expect.speed = { mni = 0.7 }"),
    Bad("number for a string", ("s.toml: description: expected a string, got a whole number",), "description = 3"),
    Bad("string for a number", ("s.toml: duration: expected a number, got a string",), 'duration = "long"'),
    Bad("true for a number", ("s.toml: ground.friction: expected a number, got true or false",),
        "ground.friction = true"),
    Bad("fraction for a count", ("s.toml: randomise.runs: expected a whole number, got a number",),
        "randomise.runs = 2.5"),
    Bad("number for a table", ("s.toml: ground: expected a table, got a number",), "ground = 3.0"),
    Bad("table for a list", ("s.toml: push: expected a list of tables", "[[push]]"),
        "[push]\nat = 0.1\nduration = 0.1\nforce = [1.0, 0.0]"),
    Bad("missing key of a push", ("s.toml: push[0]: ", "`force`"), "[[push]]\nat = 0.1\nduration = 0.1"),
    Bad("not TOML", ("s.toml: not a TOML file", "line 2"), "duration = 1.0\nslope 3"),
    Bad("not text", ("s.toml: cannot be read", "utf-8"), files={"s.toml": b"\xff\xfe\x00"}),
    Bad("missing scenario", ("no scenario 'level_norma'", "'level_normal'"), argv=("run", "level_norma")),
    Bad("missing scenario path", ("no scenario 'scenarios/level_norma.toml'", "'level_normal'"),
        argv=("run", "scenarios/level_norma.toml")),
    Bad("missing model", ("s.toml: model: no model 'humn'", ".xml", "'human'"), 'model = "humn"'),
    Bad("missing controller", ("s.toml: controller: no controller 'norml'", ".toml", "'normal'"),
        'controller = "norml"'),
    Bad("missing extends", ("s.toml: extends: no scenario 'level_norml'", "'level_normal'"),
        'extends = "level_norml"'),
    Bad("extends of the wrong type", ("s.toml: extends: expected a name or path, got 3",), "extends = 3"),
    Bad("extends in a circle", ("s.toml: extends: ", "circle", "s.toml -> t.toml -> s.toml"), 'extends = "t"',
        files={"t.toml": 'extends = "s.toml"'}),
    Bad("fault in the extended file", ("t.toml: ground.friction: expected", ">= 0"), 'extends = "t"',
        files={"t.toml": "ground.friction = -1.0"}),
    Bad("fault in the push of the extended file", ("t.toml: push[0].duration: expected", "> 0"), 'extends = "t"',
        files={"t.toml": "push = [{at = 0.1, duration = 0.0, force = [1.0, 0.0]}]"}),
    Bad("nan", ("s.toml: ground.friction: expected a finite number, got nan",), "ground.friction = nan"),
    Bad("infinity", ("s.toml: duration: expected a finite number, got inf",), "duration = inf"),
    Bad("nan in a list", ("s.toml: push[0].force[1]: expected a finite number, got nan",),
        "push = [{at = 0.1, duration = 0.1, force = [1.0, nan]}]"),
    Bad("negative duration", ("s.toml: duration: expected", "> 0"), "duration = -1.0"),
    Bad("duration beyond memory", ("s.toml: duration: expected at most",), "duration = 1e9"),
    Bad("negative seed", ("s.toml: seed: expected", ">= 0"), "seed = -1"),
    Bad("slope of a wall", ("s.toml: ground.slope: expected", "< 45"), "ground.slope = 60.0"),
    Bad("unknown engine", ("s.toml: engine: expected one of mujoco", "'mujuco'", "did you mean 'mujoco'?"),
        'engine = "mujuco"'),
    Bad("unknown integrator", ("s.toml: simulation.integrator: expected one of Euler", "did you mean 'Euler'?"),
        'simulation.integrator = "euler"'),
    Bad("control rate that does not divide", ("s.toml: simulation.control_rate: expected", "whole number", "0.001"),
        "simulation.control_rate = 700.0"),
    Bad("too few torque limits", ("s.toml: actuation.torque_limit: expected",), "actuation.torque_limit = [1.0, 2.0]"),
    Bad("null torque without joint torques", ("s.toml: actuation.null_torque: expected mode = 'joint'",),
        'actuation.mode = "generalized"\nactuation.null_torque = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0]'),
)  # fmt: skip

STARTS_AND_TIMES = (
    Bad("unknown posture", ("s.toml: start.posture: ", "human.xml", "'flat'"), 'start.posture = "flatt"'),
    Bad("start with too few coordinates", ("s.toml: start.q: expected", "9", "got 3"), "start.q = [0.0, 1.2, 1.5]"),
    Bad("unknown contact point", ("s.toml: start.contacts: ", "'right_toes'", "'right_toe'"),
        'start.contacts = ["right_toes"]'),
    Bad("contacts out of reach", ("s.toml: start.contacts: ", "right_toe", "left_heel", "start.settle"),
        "start.contacts = ['right_toe', 'right_heel', 'left_toe', 'left_heel']\n"
        "start.q = [0.0, 1.2, 1.57, 3.2, 3.2, 1.6, 1.57, 1.57, 0.0]"),
    Bad("push before the start", ("s.toml: push[0].at: expected", ">= 0"),
        "push = [{at = -0.1, duration = 0.1, force = [1.0, 0.0]}]"),
    Bad("push after the end", ("s.toml: push[0].at: expected", "duration 1", "got 2"),
        "duration = 1.0\npush = [{at = 2.0, duration = 0.1, force = [1.0, 0.0]}]"),
    Bad("push of an unknown body", ("s.toml: push[0].body: ", "'torsoo'", "'torso'"),
        "push = [{at = 0.1, duration = 0.1, force = [1.0, 0.0], body = 'torsoo'}]"),
    Bad("window outside the run", ("s.toml: window.end: expected", "duration 1", "got 2"),
        "duration = 1.0\nwindow = { start = 0.5, end = 2.0 }"),
    Bad("window reversed", ("s.toml: window: expected start < end, got [0.8, 0.2]",),
        "duration = 1.0\nwindow = { start = 0.8, end = 0.2 }"),
    Bad("expectation of an unknown metric", ("s.toml: expect.sped: unknown metric", "'speed'"),
        "expect.sped = { min = 0.7 }"),
    Bad("expectation of nothing", ("s.toml: expect.speed: expected min, max or both",), "expect.speed = {}"),
    Bad("expectation reversed", ("s.toml: expect.speed: expected min <= max, got 2.0 > 1.0",),
        "expect.speed = { min = 2.0, max = 1.0 }"),
    Bad("thesis value of an unknown metric", ("s.toml: thesis.sped: unknown metric", "'speed'"), "thesis.sped = 0.8"),
    Bad("thesis value that is no number", ("s.toml: thesis.speed: expected a number",), 'thesis.speed = "fast"'),
    Bad("thesis value that is nan", ("s.toml: thesis.speed: expected a finite number",), "thesis.speed = nan"),
    Bad("thesis table that is no table", ("s.toml: thesis: expected a table",), "thesis = 0.8"),
)  # fmt: skip

VARIATIONS = (
    Bad("sweep of an unknown key", ('s.toml: sweep."ground.slop": ', "'slope'"), 'sweep."ground.slop" = [1.0, 2.0]'),
    Bad("sweep of an unquoted key", ("s.toml: sweep.ground: expected", "quotes"), "sweep.ground.slope = [1.0, 2.0]"),
    Bad("sweep of one value", ('s.toml: sweep."ground.slope": expected a list',), 'sweep."ground.slope" = 1.0'),
    Bad("sweep of three keys", ("s.toml: sweep: expected one or two keys, got 3",),
        'sweep = {"ground.slope" = [1.0], "ground.friction" = [1.0], "start.jitter" = [0.0]}'),
    Bad("sweep to an impossible value", ("s.toml: sweep: ", "ground.slope = 60.0", "< 45"),
        'sweep."ground.slope" = [1.0, 60.0]'),
    Bad("sweep to a push after the end", ("s.toml: sweep: ", "push.0.at = 20.0", "within the run"),
        'sweep."push.0.at" = [1.0, 20.0]\npush = [{at = 0.1, duration = 0.1, force = [1.0, 0.0]}]'),
    Bad("sweep of a push that is not there", ('s.toml: sweep."push.0.at": ',), 'sweep."push.0.at" = [1.0]'),
    Bad("sweep of the seed", ('s.toml: sweep."seed": no key',), "sweep.seed = [1, 2]"),
    Bad("draw of an unknown key", ('s.toml: randomise.draw."ground.slop": ', "'slope'"),
        'randomise.draw."ground.slop" = { uniform = [0.0, 1.0] }'),
    Bad("draw from an unknown distribution", ('s.toml: randomise.draw."ground.slope".unifrm: ', "'uniform'"),
        'randomise.draw."ground.slope" = { unifrm = [0.0, 1.0] }'),
    Bad("draw from nothing", ('s.toml: randomise.draw."ground.slope": expected exactly one',),
        'randomise.draw."ground.slope" = {}'),
    Bad("draw of an unquoted key", ("s.toml: randomise.draw.ground: expected", "quotes"),
        "randomise.draw.ground.slope = { uniform = [0.0, 1.0] }"),
    Bad("draw of negative spread", ('s.toml: randomise.draw."ground.slope".normal', ">= 0"),
        'randomise.draw."ground.slope" = { normal = [0.0, -1.0] }'),
    Bad("draw from reversed bounds", ('s.toml: randomise.draw."ground.slope".uniform: expected', "<="),
        'randomise.draw."ground.slope" = { uniform = [1.0, 0.0] }'),
    Bad("draw of a word", ('s.toml: randomise.draw: ', "start.posture", "expected a string"),
        'randomise.draw."start.posture" = { uniform = [0.0, 1.0] }'),
    Bad("too few factors of the true masses", ("s.toml: truth.mass: expected",), "truth.mass = [1.0, 2.0]"),
    Bad("negative true mass", ("s.toml: truth.mass[1]: expected", "> 0"),
        "truth.mass = [1.0, -1.0, 1.0, 1.0, 1.0, 1.0, 1.0]"),
    Bad("sensors of negative noise", ("s.toml: sensors.angle_noise: expected", ">= 0"), "sensors.angle_noise = -0.1"),
)  # fmt: skip

GAITS = (
    Bad("unknown key of a gait", ("g.toml: k_d22: unknown key", "'k_d2'"), 'controller = "g.toml"',
        files={"g.toml": 'extends = "normal"\nk_d22 = 1.0'}),
    Bad("gait that lacks a gain", ("g.toml: k_d2: missing", "theta_a"), 'controller = "g.toml"',
        files={"g.toml": "k_d1 = 1.0"}),
    Bad("gain of too few states", ("g.toml: k_d2: expected", "4", "got 2"), 'controller = "g.toml"',
        files={"g.toml": 'extends = "normal"\nk_d2 = [1.0, 2.0]'}),
    Bad("negative gain", ("s.toml: gains.k_d1: expected", ">= 0"), "gains.k_d1 = -400.0"),
    Bad("gait that is a model", ("s.toml: controller: no controller 'm.xml'",), 'controller = "m.xml"',
        files={"m.xml": HUMAN}),
)  # fmt: skip

MODELS = tuple(
    Bad(name, ("m.xml: ", *says), 'model = "m.xml"', files=files)
    for name, says, files in (
        ("model that is not XML", ("not a model MuJoCo can compile", "XML"), {"m.xml": "duration = 3"}),
        ("model of negative mass", ("not a model MuJoCo can compile", "mass"),
         swap('mass="7.5"', 'mass="-7.5"', 1)),
        ("model whose mass is nan", ("mass",), swap('mass="7.5"', 'mass="nan"', 1)),
        ("model without a joint", ("joint 'left_knee': missing",),
         model(lambda text: text.replace('<joint name="left_knee" class="knee"/>', "")
               .replace('<motor name="left_knee" joint="left_knee"/>', ""))),
        ("model with a misspelt site", ("site 'left_heel': missing", "'left_hel'"),
         swap('<site name="left_heel"', '<site name="left_hel"')),
        ("model without a contact pair", ("contact pair 'left_toe': missing",),
         swap('<pair name="left_toe" geom1="ground" geom2="left_toe"/>', "")),
        ("model with an unnamed body", ("body", "has no name", "right_shank"),
         swap('<body name="right_shank"', "<body")),
        ("model with an unnamed extra body", ("body", "has no name"),
         swap('<body name="left_foot" pos="0 0 -0.4428">',
              '<body name="left_foot" pos="0 0 -0.4428"><body><inertial pos="0 0 0" mass="1" '
              'diaginertia="0.1 0.1 0.1"/></body>')),
        ("model with an extra body", ("bodies: expected exactly torso", "backpack"),
         swap('<body name="right_thigh"', '<body name="backpack"><inertial pos="0 0 0" mass="1" '
              'diaginertia="0.1 0.1 0.1"/></body><body name="right_thigh"')),
        ("model with joints in another order", ("joints: expected exactly root_x, root_z", "in this order"),
         model(lambda text: text.replace('"root_x"', '"tmp"').replace('"root_z"', '"root_x"')
               .replace('"tmp"', '"root_z"'))),
        ("model with a joint on the wrong body", ("joint 'right_knee'", "body 'right_shank'"),
         model(lambda text: text.replace('<joint name="right_hip"/>',
                                         '<joint name="right_hip"/><joint name="right_knee" class="knee"/>', 1)
               .replace('<body name="right_shank" pos="0 0 -0.441">\n          '
                        '<joint name="right_knee" class="knee"/>',
                        '<body name="right_shank" pos="0 0 -0.441">'))),
        ("model with a joint about another axis", ("joint 'left_hip': expected axis 0 -1 0",),
         swap('<joint name="left_hip"/>', '<joint name="left_hip" axis="0 1 0"/>')),
        ("model with a geared motor", ("actuator 'left_hip'", "joint 'left_hip'", "gear 1"),
         swap('<motor name="left_hip" joint="left_hip"/>', '<motor name="left_hip" joint="left_hip" gear="50"/>')),
        ("model with crossed motors", ("actuator 'left_hip'", "joint 'left_hip'"),
         swap('<motor name="left_hip" joint="left_hip"/>', '<motor name="left_hip" joint="left_knee"/>')),
        ("model with round feet", ("geom 'left_toe'", "1e-06"),
         swap('<geom name="left_toe" class="sole"', '<geom name="left_toe" class="sole" size="0.02"')),
        ("model whose toe is beside its site", ("geom 'left_toe'", "site"),
         swap('<geom name="left_toe" class="sole" pos="0.2052', '<geom name="left_toe" class="sole" pos="0.3')),
        ("model with raised ground", ("geom 'ground'", "z = 0"),
         swap('<geom name="ground"', '<geom name="ground" pos="0 0 0.1"')),
        ("model with a turned body", ("body 'left_shank'", "parallel"),
         swap('<body name="left_shank"', '<body name="left_shank" euler="0 0.1 0"')),
        ("posture that touches with an unknown point", ("text 'flat'", "'right_to'", "'right_toe'"),
         swap('name="flat" data="right_toe', 'name="flat" data="right_to')),
    )
)  # fmt: skip

LAWS = tuple(
    Bad(name, (says[0], *says[1:]), 'law = "l.py:Mine"' if scenario is None else scenario, files=files)
    for name, says, files, scenario in (
        ("law without a class", ("s.toml: law: expected 'path.py:Class', got 'l.py'",), {}, 'law = "l.py"'),
        ("law whose file is missing", ("s.toml: law: no file 'm.py'", "'l.py'"), law("pass"), 'law = "m.py:Mine"'),
        ("law whose class is missing", ("s.toml: law: ", "l.py has no class 'Mine'", "'Mime'"),
         {"l.py": "class Mime:\n    pass\n"}, None),
        ("law that does not import", ("s.toml: law: ", "l.py", "ModuleNotFoundError", "nowhere"),
         {"l.py": "import nowhere\n"}, None),
        ("law that is not Python", ("s.toml: law: ", "l.py", "SyntaxError", "line 1"), {"l.py": "class Mine\n"}, None),
        ("law that leaves the interpreter", ("s.toml: law: ", "l.py", "SystemExit"),
         {"l.py": "import sys\nsys.exit(0)\n"}, None),
        ("law whose constructor raises", ("s.toml: law: ", "Mine(setup)", "ZeroDivisionError"),
         law("return np.zeros(6)", "1 / 0"), None),
        ("law without torques", ("s.toml: law: ", "torques(sensed)"),
         {"l.py": "class Mine:\n    def __init__(self, setup):\n        pass\n"}, None),
        ("law that raises", ("s.toml: law: ", "torques() at t = 0.1 s", "KeyError", "l.py, line 10"),
         law("return {}['x'] if sensed.time >= 0.1 else np.zeros(6)"), None),
        ("law that returns nan", ("s.toml: law: ", "torques() at t = 0.05 s", "finite", "right_hip"),
         law("return np.full(6, math.nan if sensed.time >= 0.05 else 0.0)"), None),
        ("law that returns the wrong shape", ("s.toml: law: ", "torques() at t = 0 s", "six numbers", "(9,)"),
         law("return np.zeros(9)"), None),
        ("law that returns nothing", ("s.toml: law: ", "torques() at t = 0 s", "six numbers"), law("return None"), None),
        ("law that returns words", ("s.toml: law: ", "torques() at t = 0 s", "six numbers"),
         law("return ['a'] * 6"), None),
        ("law that changes what it measures", ("s.toml: law: ", "torques() at t = 0 s", "read-only"),
         law("sensed.q[0] = 1.0; return np.zeros(6)"), None),
        ("law with generalized forces", ("s.toml: actuation.mode: expected 'joint'", "law"), law("return np.zeros(6)"),
         'law = "l.py:Mine"\nactuation.mode = "generalized"'),
        ("law that raises in one run of many", ("s.toml: law: ", "ValueError: seed"),
         law("return np.zeros(6)", "if setup.scenario.randomise.runs > 1: raise ValueError('seed')"),
         'law = "l.py:Mine"\nrandomise.runs = 3'),
    )
)  # fmt: skip

COMMAND_LINES = (
    Bad("unknown command", ("'rnu'", "did you mean 'run'?"), argv=("rnu", "s.toml")),
    Bad("no command", ("COMMAND",), argv=()),
    Bad("run of nothing", ("scenario",), argv=("run",)),
    Bad("unknown option", ("--jbos", "did you mean '--jobs'?"), argv=("run", "s.toml", "--jbos", "2")),
    Bad("malformed change", ("--set ground.slope: expected KEY=VALUE",), argv=set_("ground.slope")),
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
    Bad("plot of a broken result", ("mine/result.json", "expected"), files={"mine/result.json": "{"},
        argv=("plot", "mine")),
    Bad("view of what is no result", ("mine", "expected a results folder"), files={"mine/notes.txt": "text"},
        argv=("view", "mine")),
    Bad("view of a missing recording", ("walk.rrd", "expected"), argv=("view", "walk.rrd")),
    Bad("view without a recording", ("runs/", "biped run level_normal --record"), argv=("view",)),
)  # fmt: skip

KINDS = (*SCENARIO_FILES, *STARTS_AND_TIMES, *VARIATIONS, *GAITS, *MODELS, *LAWS, *COMMAND_LINES)
