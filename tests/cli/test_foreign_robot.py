"""A robot that nobody here wrote goes through every command that seven links do, or is refused with a reason."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from biped.cli.main import main
from tests.cases import write

LEG = """
<body name="drumstick_{side}" pos="0 {y} 0">
  <joint name="splay_{side}" axis="-1 0 0" range="-40 40"/><joint name="swing_{side}" axis="0 -1 0" range="-100 60"/>
  <geom type="capsule" fromto="0 0 0 0 0 -0.3" size="0.04" mass="2"/>
  <body name="stilt_{side}" pos="0 0 -0.33">
    <joint name="bend_{side}" axis="0 1 0" range="-5 120"/>
    <geom type="capsule" fromto="0 0 0 0 0 -0.3" size="0.03" mass="1.2"/>
    <body name="paw_{side}" pos="0 0 -0.33">
      <joint name="tip_{side}" axis="0 -1 0" range="-50 50"/><joint name="roll_{side}" axis="1 0 0" range="-30 30"/>
      <geom type="box" size="0.1 0.05 0.015" pos="0.03 0 -0.025" mass="0.7"/>
    </body>
  </body>
</body>"""
OSTRICH = f"""
<mujoco model="ostrich">
  <option timestep="0.001"/>
  <worldbody>
    <geom type="plane" size="0 0 1"/>
    <body name="belly" pos="0 0 0.70">
      <freejoint/>
      <geom type="box" size="0.1 0.12 0.12" pos="0 0 0.12" mass="9"/>
      <body name="neck" pos="0.08 0 0.24">
        <joint name="nod" axis="0 1 0" range="-30 30"/>
        <geom type="capsule" fromto="0 0 0 0.1 0 0.2" size="0.02" mass="0.6"/>
      </body>
      {LEG.format(side="port", y=0.1)}{LEG.format(side="starboard", y=-0.1)}
    </body>
  </worldbody>
  <actuator>{
    "".join(
        f'<motor joint="{joint}_{side}" ctrlrange="-80 80"/>'
        for side in ("starboard", "port")
        for joint in ("tip", "roll", "bend", "swing", "splay")
    )
}
    <motor joint="nod" ctrlrange="-10 10"/>
  </actuator>
</mujoco>"""
STANDING = """
description = "An ostrich stands"
model = "ostrich.xml"
law = "stand"
duration = 1.3
window.start = 0.2
randomise = { runs = 2, draw = { "start.jitter" = { uniform = [0.0, 0.01] } } }
expect.stood = { min = "10 %" }
"""
LAZY = "class Law:\n    def __init__(self, setup): ...\n    def torques(self, sensed):\n        return [0.0] * 11\n"
COMMANDS = (
    ("model ostrich.xml", 0, "belly.*paw_port"),
    ("run s.toml --out ran --record", 0, "stood"),
    ("check s.toml --junit checks.xml", 0, "passed"),
    ("diff r one --out d", 0, "torso_lean"),
    ("diff stand lazy.py:Law --scenario s.toml --trust", 0, "lazy"),
    ("report r one --html r.html", 0, "r.html"),
    ("report r --out r.md", 0, "r.md"),
    ("report d --html d.html", 0, "d.html"),
    ("plot r", 0, "figures"),
    ("video r --out r.gif --to 0.05", 0, "2 frames|1 frame"),
    ("video r one --out both.gif --to 0.05", 0, "frame"),
    ("export r --eurobench files", 0, "files in"),
    ("regress s.toml", 1, "no reference"),
    ("compare s.toml", 2, "'home' has seven links"),
    ("tune s.toml --out t", 2, r"\[tune\] table"),
)
"""Arguments, exit code, and a pattern of what is printed: where the code is 2, the reason."""


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the robot, a scenario, a campaign `r` and a run `one`."""
    where = tmp_path_factory.mktemp("foreign")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(where)
        write("ostrich.xml", OSTRICH)
        write("s.toml", STANDING)
        write("lazy.py", LAZY)
        assert main(["run", "s.toml", "--out", "r", "--jobs", "1"]) == 0
        assert main(["run", "s.toml", "--out", "one", "--set", "randomise.runs=1"]) in (0, 3)
    return where


@pytest.mark.parametrize(("command", "code", "pattern"), COMMANDS, ids=[command for command, _, _ in COMMANDS])
def test_foreign_robot_goes_through_every_command(results, monkeypatch, capsys, command, code, pattern):
    monkeypatch.chdir(results)
    assert main(command.split()) == code
    out, err = capsys.readouterr()
    assert re.search(pattern, err if code == 2 else out, re.DOTALL)
    assert "Traceback" not in err
    if code == 2:
        assert len(err.strip().splitlines()) == 1
