"""The small policy that comes with biped: its card from its file, its walk, its checks, its script."""

from __future__ import annotations

import sys
from importlib import import_module
from pathlib import Path

import mujoco
import numpy as np
import onnxruntime
import pytest
from msgspec import structs

import biped
from biped.base.files import folder, read_toml
from biped.cli.main import main
from biped.engines.plant import MujocoPlant
from biped.scenario.card import read_card
from biped.studies.bench.costs import policy_cost
from biped.studies.policy import check, likeness, mirror_of, reproduce, run_of
from biped.studies.policy.describe import describe
from biped.studies.policy.tape import record
from biped.studies.policy.trials import faults_of, inject
from tests.cases import command as case

HERE = folder("controllers") / "policy"
CARD = HERE / "h1.toml"


@pytest.fixture
def script(monkeypatch):
    """The script that makes it."""
    monkeypatch.syspath_prepend(str(HERE))
    yield import_module("h1")
    for name in ("h1", "learning"):
        sys.modules.pop(name, None)


def test_its_card_is_what_its_file_says():
    written, shipped = describe(HERE / "h1.onnx", "h1", None, 50.0, 2.0), read_toml(CARD)
    assert written.pop("source")["metadata"] == shipped.pop("source")["metadata"]
    assert {key: shipped[key] for key in written} == written
    assert shipped.keys() - written.keys() == {"description", "command"}


def test_a_card_and_the_model_below_it_can_be_moved_together(tmp_path):
    file, apart = tmp_path / "ours" / "robot" / "h1.xml", tmp_path / "elsewhere" / "h1.xml"
    network = tmp_path / "ours" / "walker.onnx"
    for model in (file, apart):
        model.parent.mkdir(parents=True)
        model.write_bytes((folder("models") / "h1.xml").read_bytes())
    network.write_bytes((HERE / "h1.onnx").read_bytes())
    assert describe(network, str(file), None, 50.0, 2.0)["scenario"] == {"model": "robot/h1.xml"}
    assert describe(network, str(apart), None, 50.0, 2.0)["scenario"] == {"model": str(apart.resolve())}


def test_it_walks_as_in_the_plain_loop_that_it_learned_in(script, tmp_path):
    """No code in common but MuJoCo and onnxruntime: servos, observation and clock are the script's own."""
    seconds, walk = 2.0, script.Walk()
    file = tmp_path / "s.toml"
    file.write_text(f'law = "policy/h1.toml"\nduration = {seconds}\ncommand = {{ forward = 0.5, yaw = 0.2 }}\n')
    ours = biped.run(file).trajectory
    session = onnxruntime.InferenceSession(HERE / "h1.onnx")
    m, d = walk.model, walk.data
    mujoco.mj_resetDataKeyframe(m, d, m.key("stand").id)
    d.qpos[:], d.ctrl[:] = ours.q[0], ours.q[0, 7:]
    action, command, gone = np.zeros(10), np.array([0.5, 0.0, 0.2]), []
    for k in range(round(seconds * script.RATE)):
        mujoco.mj_forward(m, d)
        turn, phase = d.body("pelvis").xmat.reshape(3, 3), 2.0 * np.pi * script.FREQUENCY * k / script.RATE
        seen = np.concatenate([
            turn.T @ d.qvel[:3], 0.25 * d.qvel[3:6], -turn[2], d.qpos[walk.places] - script.DEFAULT,
            0.05 * d.qvel[walk.columns], action, command, [np.sin(phase), np.cos(phase)],
        ])  # fmt: skip
        action = session.run(None, {"observation": seen[None].astype(np.float32)})[0][0]
        d.ctrl[walk.order] = script.DEFAULT + script.SCALE * action
        for _ in range(walk.calls):
            gone.append(d.qpos.copy())
            mujoco.mj_step(m, d)
    np.testing.assert_allclose(ours.q, np.array(gone), atol=1e-6)
    assert ours.base[-1, 0] - ours.base[0, 0] > 0.6


def test_it_passes_its_checks():
    assert [one.name for one in check(CARD) if not one.passed] == []


def test_faults_are_named_by_its_tape():
    """Those that any tape sees; a wrong gain takes short runs."""
    card = read_card(CARD)
    tape = record(run_of(CARD, card, (0.4, 0.0, 0.0)))
    assert all(one.passed for one in reproduce(CARD, tape))
    missed = [name for name, wrong in faults_of(card) if all(one.passed for one in reproduce(CARD, tape, wrong))]
    assert missed == ["stiffness halved"]


@pytest.mark.slow
def test_all_faults_are_found():
    assert [one.name for one in inject(CARD) if not one.found] == []


def test_it_is_made_by_its_script(script, monkeypatch, tmp_path):
    """One short round of what takes three minutes: a network of the same shape, with the same words."""
    for name, value in (("ROUNDS", 1), ("WALKS", 2), ("SECONDS", 6.0), ("EPOCHS", 1)):
        monkeypatch.setattr(script, name, value)
    script.main(tmp_path / "h1.onnx")
    again = describe(tmp_path / "h1.onnx", "h1", None, 50.0, 2.0)
    assert again == describe(HERE / "h1.onnx", "h1", None, 50.0, 2.0)


def test_a_phase_without_a_frequency_is_asked_for(tmp_path, capsys):
    (tmp_path / "net.onnx").write_bytes((HERE / "h1.onnx").read_bytes())
    assert main(["policy", str(tmp_path / "net.onnx"), "--model", "h1", "--rate", "50"]) == 2
    assert "expected --clock in Hz" in " ".join(capsys.readouterr().err.split())


def test_files_to_start_from_walk_alike_from_the_card_and_in_python(tmp_path, monkeypatch, capsys):
    """Written, checked, run: two readings of one policy that share no code but the engine's."""
    monkeypatch.chdir(tmp_path)
    assert main(["new", "policy", "mine.toml"]) == 0
    said = capsys.readouterr().out
    assert "biped policy mine.toml" in said
    rows = []
    for law in ("mine.toml", "mine.py:MyPolicy"):
        assert f"--set law={law}" in said
        words = [
            "--set",
            "randomise.runs=1",
            "--set",
            "duration=2",
            "--set",
            f"law={law}",
            "--out",
            law.partition(".")[2],
        ]
        rows.append(case(capsys, "run", "policy/h1", *words)[1]["runs"][0])
    card, python = rows
    assert card["distance"] > 0.6
    for name in ("distance", "speed", "cost_of_transport", "torso_lean", "command_error"):
        assert card[name] == pytest.approx(python[name], abs=1e-6), name
    tape = record(run_of(Path("mine.toml"), read_card(Path("mine.toml")), (0.3, 0.0, 0.0)))
    assert all(one.passed for one in reproduce(Path("mine.toml"), tape))
    assert main(["new", "policy", "mine.toml"]) == 2
    assert "is there already" in capsys.readouterr().err
    assert main(["new", "policy", "mine.py"]) == 2


def test_torchscript_is_refused_with_the_way_to_convert_it(tmp_path, capsys):
    assert main(["policy", str(Path(tmp_path, "motion.pt"))]) == 2
    assert "torch.onnx.export" in capsys.readouterr().err


def test_a_mirrored_state_gives_the_mirrored_action():
    """By the model's own symmetry; a network that holds one joint the wrong way round is none."""
    card = read_card(CARD)
    run = run_of(CARD, card, (0.4, 0.0, 0.0))
    tape = record(run)
    assert likeness(run, tape) > 0.95
    image = mirror_of(MujocoPlant(run).model, run.robot)
    assert image is not None
    np.testing.assert_allclose(image.state(image.state(tape.qpos)), tape.qpos, atol=1e-12)
    np.testing.assert_allclose(image.motion(image.motion(tape.qvel)), tape.qvel, atol=1e-12)
    m, d = MujocoPlant(run).model, mujoco.MjData(MujocoPlant(run).model)
    feet = []
    for q in (tape.qpos[70:71], image.state(tape.qpos[70:71])):
        d.qpos[:] = q[0]
        mujoco.mj_kinematics(m, d)
        feet.append([d.body(f"{side}_foot").xpos.copy() for side in ("left", "right")])
    np.testing.assert_allclose(feet[1], np.array(feet[0])[::-1] * [1.0, -1.0, 1.0], atol=1e-9)
    wrong = structs.replace(card, action=structs.replace(card.action, scale=(0.5,) * 8 + (-0.5, 0.5)))
    assert likeness(run_of(CARD, wrong, (0.4, 0.0, 0.0)), tape) < 0.8
    huge = structs.replace(card, action=structs.replace(card.action, scale=(1e300,) * 10))
    assert likeness(run_of(CARD, huge, (0.4, 0.0, 0.0)), tape) < 0.8  # and no warning of an overflow


def test_what_it_stands_is_searched_upward_to_the_first_fall(monkeypatch, capsys):
    """Half a second late it falls; a level beyond a fall is not tried."""
    for name, value in (
        ("SECONDS", 2.5), ("BEGIN", 1.0), ("MOMENTS", (1.0,)), ("IMPULSES", (0.02,)), ("SLOPES", (1.0,)),
        ("DELAYS", (0.0, 0.2, 0.01)),
    ):  # fmt: skip
        monkeypatch.setattr(f"biped.studies.policy.trials.{name}", value)
    code, row = case(capsys, "policy", str(CARD), "--measure")
    assert code == 0
    assert row["lasted"]
    assert row["speed"] == pytest.approx(0.45, abs=0.1)
    found = {one["name"]: (one["value"], one["most"]) for one in row["limits"]}
    assert found.pop("latency") == (0.0, False)
    assert set(found.values()) == {(0.02, True), (1.0, True)}


def test_what_its_loop_costs_is_held_against_bare_steps_and_calls():
    cost = policy_cost(CARD, quick=True, repeats=1, seconds=0.4)
    assert min(cost.steps, cost.network, cost.loop, cost.sparse) > 0.0
    assert cost.ratio(cost.loop) > 1.0
    assert (cost.one, cost.two) == (None, None)
