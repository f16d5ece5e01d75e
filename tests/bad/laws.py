"""Bad control laws of a user's own."""

from __future__ import annotations

from tests.bad.kind import Bad


def law(body: str, init: str = "pass") -> dict[str, str]:
    """A user's control law l.py."""
    return {
        "l.py": "import math\nimport numpy as np\n\n\nclass Mine:\n"
        f"    def __init__(self, setup):\n        {init}\n\n"
        f"    def torques(self, sensed):\n        {body}\n"
    }


LAWS = (
    Bad("law that is not trusted", ("s.toml: law: l.py", "outside the package", "--trust", 'trust = ["', "config.toml"),
        'law = "l.py:Mine"', files=law("return np.zeros(6)")),
    Bad("law that is not what it was", ("s.toml: law: ", "l.py has changed since", "SHA-256 0123", "--set law="),
        f'law = "l.py:Mine"\nlaw_sha256 = "{"0123" * 16}"', ("run", "s.toml", "--trust"), law("return np.zeros(6)")),
    *(Bad(name, (says[0], *says[1:]), 'law = "l.py:Mine"' if scenario is None else scenario,
          ("run", "s.toml", "--trust"), files)
      for name, says, files, scenario in (
        ("law without a class", ("s.toml: law: expected 'path.py:Class', a", "got 'l.py'"), {}, 'law = "l.py"'),
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
        ("law that raises", ("s.toml: law: ", "torques() at t = 0 s", "KeyError", "l.py, line 10"),
         law("return {}['x'] if sensed.time < 0.1 else np.zeros(6)"), None),
        ("law that returns nan", ("s.toml: law: ", "torques() at t = 0 s", "finite", "right_hip"),
         law("return np.full(6, math.nan if sensed.time < 0.05 else 0.0)"), None),
        ("law that returns the wrong shape", ("s.toml: law: ", "torques() at t = 0 s", "6 numbers", "(9,)"),
         law("return np.zeros(9)"), None),
        ("law that returns nothing", ("s.toml: law: ", "torques() at t = 0 s", "6 numbers"),
         law("return None"), None),
        ("law that returns words", ("s.toml: law: ", "torques() at t = 0 s", "6 numbers"),
         law("return ['a'] * 6"), None),
        ("law that changes what it measures", ("s.toml: law: ", "torques() at t = 0 s", "read-only"),
         law("sensed.q[0] = 1.0; return np.zeros(6)"), None),
        ("law with generalized forces", ("s.toml: actuation.mode: expected 'joint'", "law"), law("return np.zeros(6)"),
         'law = "l.py:Mine"\nactuation.mode = "generalized"'),
        ("law that raises in one run of many", ("s.toml: law: ", "ValueError: seed"),
         law("return np.zeros(6)", "if setup.scenario.randomise.runs > 1: raise ValueError('seed')"),
         'law = "l.py:Mine"\nrandomise.runs = 3'),
    )),
)  # fmt: skip
