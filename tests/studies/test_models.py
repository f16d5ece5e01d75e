"""Model files side by side: recognised, refused by one sentence, and standing in the physics they ask for."""

from __future__ import annotations

from biped.cli.main import main
from tests.cases import command, write
from tests.robot.test_recognise import model


def test_what_stands_and_what_falls_and_what_is_no_robot(capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write("r.xml", model())
    code, found = command(capsys, "model", "walker2d", "h1", "r.xml", "nowhere.xml", "--stand")
    assert code == 1
    walker, h1, lame, nobody = found["models"]
    assert (walker["stood"], walker["feet"], walker["refused"]) == (True, [2, 2], "")
    assert (h1["stood"], h1["actuators"], h1["end"]) == (True, 19, "")
    assert (lame["stood"], lame["mass"]) == (None, None)
    assert lame["refused"].startswith("actuators: none; write <actuator>")
    assert "nowhere" in nobody["refused"]


def test_the_table(capsys):
    assert main(["model", "walker2d", "human3d"]) == 0
    shown = " ".join(capsys.readouterr().out.split())
    assert "walker2d 23.68 kg 6 2 + 2" in shown
    assert shown.endswith("2 of 2 recognised")


def test_one_that_falls_is_said_to(capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    motors = "".join(f'<motor name="{side}_{joint}_motor" joint="{side}_{joint}" ctrlrange="-0.1 0.1"/>'
                     for side in ("left", "right") for joint in ("hip", "ankle"))  # fmt: skip
    write("weak.xml", model(actuators=motors, world='<geom name="floor" type="plane" size="1 1 1"/>'))
    code, found = command(capsys, "model", "weak.xml", "--stand")
    assert (code, found["models"][0]["stood"]) == (1, False)
    assert found["models"][0]["end"]
