"""Whatever a law raises or returns: its runs end `raised`, and the campaign goes on."""

from __future__ import annotations

import json

import pytest

from biped.cli.main import main
from tests.cases import write

LAW = """class Mute(Exception):
    def __str__(self):
        raise ValueError("no words")


class MuteBase(BaseException):
    def __str__(self):
        raise MuteBase

    __repr__ = __str__


class Own(BaseException):
    pass


class Odd:
    def __array__(self, *_, **__):
        raise Own("no array")

    def __repr__(self):
        raise Own("no words")


class Law:
    def __init__(self, setup):
        self.signals = {"effort": 0.0}
        self.ticks = 0

    def torques(self, sensed):
        self.ticks += 1
        if self.ticks > 20:
            FAULT
        return [0.0] * 6
"""

FAULTS = {
    "words": "raise Mute",
    "words of its own": "raise MuteBase",
    "generator": "raise GeneratorExit",
    "own": "raise Own('mine')",
    "interrupt": "raise KeyboardInterrupt",
    "exit": "raise SystemExit(0)",
    "array": "return Odd()",
    "nothing": "return None",
    "signals": "self.signals = {'effort': Odd()}",
    "cancelled": "import asyncio; raise asyncio.CancelledError",
}
ROBOTS = {
    "planar": 'controller = "normal"\nstart = { posture = "heel_toe", jitter = 0.001 }\n',
    "any": 'model = "walker2d"\nstart.jitter = 0.001\n',
}


@pytest.mark.parametrize("fault", FAULTS)
@pytest.mark.parametrize("robot", ROBOTS)
def test_every_run_ends_raised(robot, fault, tmp_path, monkeypatch, capsys):
    """A KeyboardInterrupt too: with two processes it can only be the law's, since workers do not hear Ctrl-C."""
    monkeypatch.chdir(tmp_path)
    write("law.py", LAW.replace("FAULT", FAULTS[fault]))
    write("s.toml", f'{ROBOTS[robot]}law = "law.py:Law"\nduration = 0.1\nrandomise.runs = 2\n')
    assert main(["run", "s.toml", "--trust", "--jobs", "2", "--json", "--out", "r"]) == 1
    answer = capsys.readouterr()
    assert [run["end"] for run in json.loads(answer.out)["runs"]] == ["raised", "raised"]
    assert "Traceback" not in answer.err
    assert "defect" not in answer.err
