"""Scenario files for tests of the command line: short, in the current folder."""

from __future__ import annotations

import json
from pathlib import Path

from biped.cli.main import main

SHORT = """description = "Half a second"
duration = 0.5
controller = "normal"
[start]
posture = "heel_toe"
"""

ENSEMBLE = """description = "Six short runs, most of which fall"
duration = 0.4
seed = 7
start = { posture = "single", jitter = 0.02 }
fall.tilt = 15.7
[randomise]
runs = 6
controller_constraints = 0.05
[randomise.draw]
"ground.friction" = { uniform = [0.5, 2.0] }
[window]
start = 0.3
[expect]
falls = { max = 6 }
"""


def write(name: str, text: str) -> str:
    Path(name).write_text(text, encoding="utf-8")
    return name


def contents(folder: str) -> dict[str, bytes]:
    """Every file of a results folder."""
    root = Path(folder)
    return {str(p.relative_to(root)): p.read_bytes() for p in root.rglob("*") if p.is_file()}


def command(capsys, *argv: str) -> tuple[int, dict]:
    """Runs a command with --json; returns its exit code and the one object on stdout."""
    capsys.readouterr()
    code = main([*argv, "--json"])
    return code, json.loads(capsys.readouterr().out)
