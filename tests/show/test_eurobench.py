"""Files in EuroBench's formats, read back by a reader that is written from its documents alone."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from biped.cli.main import main
from biped.measure.stored import load
from tests.cases import ENSEMBLE, write

NAME = re.compile(r"(?:cond_(\d+)_)?(?:run_(\d+)_)?([A-Za-z][A-Za-z_]*)\.(csv|yaml)")
"""experiment_data.adoc: subject, cond and run only where it makes sense."""
GAIT_EVENTS = {"r_heel_strike", "l_heel_strike", "r_toe_off", "l_toe_off"}
GAIT_PARAMETERS = {
    f"{name}_{side}"
    for name in (
        "cadence",
        "walking_speed",
        "stride_time",
        "step_time",
        "stride_length",
        "step_length",
        "single_suport",
    )
    for side in ("left", "right")
} | {"double_support"}


def series(path: Path) -> dict[str, np.ndarray]:
    """data_format.adoc: comma-separated values with semicolons; the first row has the labels of all columns."""
    head, *lines = path.read_text(encoding="utf-8").splitlines()
    labels = [label.strip() for label in head.split(";")]
    assert labels[0] == "time"
    assert len(set(labels)) == len(labels)
    table = np.array([[float(cell) for cell in line.split(";")] for line in lines])
    assert table.shape == (len(lines), len(labels))
    assert np.isfinite(table).all()
    return dict(zip(labels, table.T, strict=True))


def mapping(path: Path) -> dict[str, Any]:
    """Lines `key: value` of YAML; a value is a number, a word, or a list of such."""
    out = {}
    for line in path.read_text(encoding="utf-8").splitlines():
        key, colon, value = line.partition(": ")
        assert colon
        assert re.fullmatch(r"\w+", key)
        out[key] = _value(value)
    return out


def _value(text: str) -> Any:
    if text.startswith("["):
        inner = text.removeprefix("[").removesuffix("]")
        return [_value(one) for one in inner.split(", ")] if inner else []
    try:
        return json.loads(text)
    except ValueError:
        return text.strip("'")


def indicator(path: Path) -> Any:
    """pi_spec.adoc: a type, a value, and perhaps as many labels as entries."""
    said = mapping(path)
    assert set(said) <= {"type", "label", "value"}
    if said["type"] == "scalar":
        assert isinstance(said["value"], int | float)
    else:
        assert said["type"] == "vector"
        assert all(isinstance(one, int | float) for one in said["value"])
        assert len(said.get("label", said["value"])) == len(said["value"])
    return said["value"]


@pytest.fixture(scope="module")
def walk(tmp_path_factory):
    """A run up a slope and another on the level, exported: (folder, trajectory) by name."""
    where, out = tmp_path_factory.mktemp("eb"), {}
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(where)
        for name, slope, seconds in (("level", 0.0, 6.0), ("up", 3.0, 2.0)):
            until = f"duration={seconds}", f"window.end={seconds}"
            changes = ["controller=robust", "window.start=1.0", *until, f"ground.slope={slope}"]
            main(["run", "level_normal", "--out", name, *(word for change in changes for word in ("--set", change))])
            assert main(["export", name, "--eurobench", f"{name}-eb"]) == 0
            out[name] = where / f"{name}-eb", load(where / name / "trajectory.npz")
    return out


@pytest.mark.parametrize("name", ["level", "up"])
def test_every_file_is_of_a_kind_that_the_documents_know(walk, name):
    folder, t = walk[name]
    known = {
        "jointStates",
        "jointTorques",
        "com",
        "grf",
        "grf_left",
        "grf_right",
        "gaitEvents",
        "gaitParameters",
        "condition",
    }
    assert {path.stem for path in folder.iterdir() if path.is_file()} == known
    for path in folder.glob("*.csv"):
        np.testing.assert_allclose(series(path)["time"], t.time, atol=1e-9)
    for path in (folder / "performance_indicators").iterdir():
        assert NAME.fullmatch(path.name)
        indicator(path)


def test_joints(walk):
    folder, t = walk["level"]
    states, torques = series(folder / "jointStates.csv"), series(folder / "jointTorques.csv")
    joints = [f"{side}_{joint}" for side in "rl" for joint in ("hip", "knee", "ankle")]
    assert list(states) == ["time", *(f"{joint}_{part}" for joint in joints for part in ("pos", "vel"))]
    assert list(torques) == ["time", *(f"{joint}_z" for joint in joints)]
    for i, joint in enumerate(joints):
        np.testing.assert_allclose(states[f"{joint}_pos"], t.q[:, 3 + i], rtol=1e-7, atol=1e-9)
        np.testing.assert_allclose(states[f"{joint}_vel"], t.v[:, 3 + i], rtol=1e-7, atol=1e-9)
        np.testing.assert_allclose(torques[f"{joint}_z"], t.u[:, i], rtol=1e-7, atol=1e-9)


@pytest.mark.parametrize("name", ["level", "up"])
def test_newtons_law_holds_in_the_vertical_frame(walk, name):
    """What the files say by themselves: forces less weight move the centre of mass, on the slope as well."""
    folder, t = walk[name]
    com, ground = series(folder / "com.csv"), series(folder / "grf.csv")
    mass = 75.0
    for axis, gravity in (("x", 0.0), ("y", -9.81)):
        gained = np.cumsum(ground[f"f_{axis}"][:-1] / mass + gravity) * 1e-3
        np.testing.assert_allclose(com[f"vel_{axis}"][1:], com[f"vel_{axis}"][0] + gained, atol=0.02)
    assert not com["z"].any()
    assert not ground["f_z"].any()
    c, s = np.cos(np.radians(t.slope)), np.sin(np.radians(t.slope))
    turned = t.com[:, [0, 2]] @ np.array([[c, -s], [s, c]]).T
    np.testing.assert_allclose(np.column_stack([com["x"], com["y"]]), turned, rtol=1e-7, atol=1e-8)


def test_forces_of_both_feet_are_the_grounds(walk):
    folder, t = walk["level"]
    both, right, left = (series(folder / f"{name}.csv") for name in ("grf", "grf_right", "grf_left"))
    for axis in ("f_x", "f_y"):
        np.testing.assert_allclose(right[axis] + left[axis], both[axis], atol=1e-4)
    np.testing.assert_allclose(both["f_y"], t.force[..., 2].sum(axis=1), rtol=1e-7, atol=1e-6)
    loaded = both["f_y"] > 100.0
    moment = right["p_x"] * right["f_y"] + left["p_x"] * left["f_y"]
    np.testing.assert_allclose(moment[loaded] / both["f_y"][loaded], both["p_x"][loaded], atol=1e-3)


def test_gait_events_and_parameters(walk):
    folder, t = walk["level"]
    events, parameters = mapping(folder / "gaitEvents.yaml"), mapping(folder / "gaitParameters.yaml")
    assert set(events) == GAIT_EVENTS
    assert set(parameters) <= GAIT_PARAMETERS
    for side, leg in (("r", 0), ("l", 1)):
        strikes, offs = np.array(events[f"{side}_heel_strike"]), np.array(events[f"{side}_toe_off"])
        assert len(strikes) >= 2
        for strike in strikes:
            row = round(strike * 1000)
            assert t.down[row, leg] > t.down[row - 1, leg]
            assert (offs < strike).any() or not t.down[:row, leg].any()
    stride = np.diff(events["r_heel_strike"]).mean()
    assert parameters["stride_time_right"] == pytest.approx(stride)
    assert parameters["cadence_right"] == pytest.approx(120.0 / stride)
    speed = parameters["stride_length_right"] / parameters["stride_time_right"]
    assert parameters["walking_speed_right"] == pytest.approx(speed)
    assert speed == pytest.approx(series(folder / "com.csv")["vel_x"][1000:].mean(), rel=0.15)


def test_condition(walk):
    said = mapping(walk["up"][0] / "condition.yaml")
    assert said["slope_angle"] == 3
    assert said["engine"] == "mujoco"
    assert all(key == key.lower() for key in said)


def test_runs_and_conditions_are_in_the_names(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    text = ENSEMBLE.replace("runs = 6", "runs = 2").replace("falls = { max = 6 }", "")
    push = "[[push]]\nat = 0.1\nduration = 0.1\nforce = [1.0, 0.0]\n"
    write("s.toml", f'{text}[sweep]\n"push.0.force.0" = [50.0, 90.0]\n{push}')
    main(["run", "s.toml", "--out", "x", "--jobs", "1"])
    capsys.readouterr()
    assert main(["export", "x", "--eurobench", "eb"]) == 0
    names = {path.name for path in Path("eb").glob("*.csv")}
    assert {f"cond_{c}_run_{r}_com.csv" for c in (1, 2) for r in (1, 2)} <= names
    assert mapping(Path("eb/condition_2.yaml"))["push_0_force_0"] == 90
    assert mapping(Path("eb/condition_1.yaml"))["push_1_force"] == [50, 0]
    share = indicator(Path("eb/performance_indicators/fall_percentage.yaml"))
    rows = json.loads(Path("x/result.json").read_text())["runs"]
    assert share == pytest.approx(100.0 * sum(row["fell"] for row in rows) / 4)
    assert not Path("eb/performance_indicators/Stability_margin.yaml").exists()  # two runs say nothing
    before = len(list(Path("eb").rglob("*")))
    assert main(["export", "x", "--eurobench", "eb"]) == 2
    assert "already holds something" in capsys.readouterr().err
    assert len(list(Path("eb").rglob("*"))) == before
    assert main(["export", "nothing", "--eurobench", "eb2"]) == 2
    assert not Path("eb2").exists()
