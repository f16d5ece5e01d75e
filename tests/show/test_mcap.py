"""A run as MCAP says what its trajectory says: curves, poses of bodies, forces."""

from __future__ import annotations

import json
import math
from pathlib import Path

import mujoco
import numpy as np
import pytest

from biped.cli.main import main
from biped.measure.stored import load
from biped.robot.ground import GRAVITY
from biped.show.results_folder import ResultsFolder

reader = pytest.importorskip("mcap.reader")

STANDS = """
model = "h1"
law = "stand"
duration = 1.2
window = { start = 0.2, end = 1.2 }
ground.slope = 4.0
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    where = tmp_path_factory.mktemp("mcap")
    (where / "s.toml").write_text(STANDS, encoding="utf-8")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(where)
        main(["run", "s.toml", "--out", "r", "--jobs", "1"])
        assert main(["export", "r", "--mcap", "r.mcap"]) == 0
    return where


@pytest.fixture(scope="module")
def messages(folder):
    found: dict[str, list] = {}
    with (folder / "r.mcap").open("rb") as file:
        for schema, channel, message in reader.make_reader(file).iter_messages():
            found.setdefault(channel.topic, []).append((schema.name, message.log_time, json.loads(message.data)))
    return found


@pytest.fixture(scope="module")
def run(folder):
    return load(folder / "r/trajectory.npz")


def test_curves_are_means_of_the_ticks_between(messages, run):
    (schema, _, _), *_ = messages["/force"]
    assert schema == "biped.force"
    ticks = round(0.005 / run.tick)
    for number in (0, 7, 100):
        _, at, data = messages["/force"][number]
        assert at == round(1e9 * run.time[number * ticks])
        span = slice(number * ticks, (number + 1) * ticks)
        for foot, leg in enumerate(run.robot.legs):
            name = "right" if "right" in leg else "left"
            value = next(v for k, v in data.items() if name in k)
            assert value == pytest.approx(run.foot_force[span, foot].mean(), rel=1e-9)


def test_bodies_are_where_kinematics_puts_them(messages, folder):
    results = ResultsFolder(folder / "r")
    run, model = results.trajectory(0), results.model(0)
    data = mujoco.MjData(model)
    for schema, at, said in messages["/tf"][::20]:
        assert schema == "foxglove.FrameTransforms"
        data.qpos[:] = run.qpos(model)[round(at / 1e9 / run.tick)]
        mujoco.mj_kinematics(model, data)
        ground, *bodies = said["transforms"]
        assert {body["parent_frame_id"] for body in bodies} == {"ground"}
        for body in bodies:
            place = [body["translation"][axis] for axis in "xyz"]
            np.testing.assert_allclose(place, data.body(body["child_frame_id"]).xpos, atol=1e-9)
        # The ground's frame is turned so that it rises by the slope in the world's.
        turned = np.zeros(3)
        mujoco.mju_rotVecQuat(turned, np.array([1.0, 0.0, 0.0]), np.array([ground["rotation"][a] for a in "wxyz"]))
        np.testing.assert_allclose(turned, [math.cos(math.radians(4)), 0.0, math.sin(math.radians(4))], atol=1e-9)
    shown = {entity["frame_id"] for entity in messages["/body"][0][2]["entities"]} - {"ground"}
    assert shown == {body["child_frame_id"] for body in bodies}


def test_arrows_carry_the_weight(messages, run):
    """Standing still the arrows add up to one body weight of 0.6 m against gravity."""
    _, at, said = messages["/ground_forces"][-2]
    total = np.zeros(3)
    for arrow in said["entities"][0]["arrows"]:
        way = np.zeros(3)
        quaternion = np.array([arrow["pose"]["orientation"][axis] for axis in "wxyz"])
        mujoco.mju_rotVecQuat(way, np.array([1.0, 0.0, 0.0]), quaternion)
        total += way * (arrow["shaft_length"] + arrow["head_length"])
    row = round(at / 1e9 / run.tick)
    np.testing.assert_allclose(total, 0.6 * run.force[row].sum(axis=0) / (run.mass * GRAVITY), atol=1e-6)
    assert np.linalg.norm(total) == pytest.approx(0.6, rel=0.05)


def test_what_is_there_is_not_overwritten(folder, monkeypatch, capsys):
    monkeypatch.chdir(folder)
    Path("notes.mcap").write_text("mine", encoding="utf-8")
    assert main(["export", "r", "--mcap", "notes.mcap"]) == 2
    assert "nothing is overwritten" in capsys.readouterr().err
    assert main(["export", "r", "--mcap", "r.txt"]) == 2
    assert "expected a file *.mcap" in capsys.readouterr().err
    assert main(["export", "r"]) == 2
    assert main(["export", "r", "--mcap", "r.mcap"]) == 0  # its own may be made anew
