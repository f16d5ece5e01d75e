"""What somebody sent is looked at without running their code; running it takes the user's word."""

from __future__ import annotations

import importlib.util
import json
import py_compile
import shutil
import tomllib
from pathlib import Path

import numpy as np
import pytest

from biped.base.errors import InputError
from biped.base.trust import configuration, grant, trusting
from biped.cli.main import main
from biped.control.law import load_law
from biped.scenario.laws import digest
from tests.cases import command, write

LAW = """from pathlib import Path
import numpy as np
import helper
Path({canary!r}).write_text("ran")

class Theirs:
    def __init__(self, setup):
        self.start = None

    def torques(self, sensed):
        return helper.stiffness * (0.1 - sensed.q[3:])
"""
SCENARIO = """law = "theirs.py:Theirs"
duration = 0.3
[start]
jitter = 0.02
[expect]
falls = { max = 9 }
[tune]
"""
CAMPAIGN = ["--set", "randomise.runs=3", "--set", "fall.tilt=9", "--set", "start.posture=single"]


@pytest.fixture(scope="module")
def pristine(tmp_path_factory):
    """A folder from somebody else: a scenario, its law, and results of it: a run and a campaign."""
    where = tmp_path_factory.mktemp("sent")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(where)
        Path("sent").mkdir()
        write("sent/theirs.py", LAW.format(canary=str(where / "canary")))
        write("sent/helper.py", "stiffness = 0.0\n")
        write("sent/s.toml", SCENARIO)
        assert main(["run", "sent/s.toml", "--trust", "--out", "sent/one"]) == 0
        assert main(["run", "sent/s.toml", "--trust", "--jobs", "1", "--out", "sent/many", *CAMPAIGN]) == 0
        assert Path("canary").read_text(encoding="utf-8") == "ran"
        shutil.copytree("sent", "kept")
    return where


@pytest.fixture
def sent(pristine, tmp_path, monkeypatch):
    """The folder as it was sent, in the working folder; yields the canary that the law leaves when it runs."""
    for path in pristine.iterdir():
        if path.name != "kept":
            shutil.rmtree(path) if path.is_dir() else path.unlink()
    shutil.copytree(pristine / "kept", pristine / "sent")
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    monkeypatch.chdir(pristine)
    return pristine / "canary"


def configure(text: str) -> None:
    configuration().parent.mkdir(parents=True, exist_ok=True)
    configuration().write_text(text, encoding="utf-8")


def said(capsys) -> str:
    return " ".join(capsys.readouterr().err.split())


@pytest.mark.parametrize("name", ["run", "check", "compare", "tune", "stability", "regress"])
@pytest.mark.parametrize("scenario", ["sent/s.toml", "sent/one/scenario.toml"])
def test_running_takes_the_users_word(sent, name, scenario, capsys):
    assert main([name, scenario]) == 2
    assert "sent/theirs.py is Python code from outside the package" in said(capsys)
    assert not sent.exists()
    assert not Path("runs").exists()


@pytest.mark.parametrize("folder", ["sent", "."])
def test_the_working_folder_is_no_word(sent, folder, monkeypatch, capsys):
    monkeypatch.chdir(folder)
    assert main(["run", "s.toml" if folder == "sent" else "sent/s.toml"]) == 2
    assert not sent.exists()


def test_looking_never_runs_it_trusted_or_not(sent, pristine, monkeypatch):
    import subprocess

    monkeypatch.setattr(subprocess, "call", lambda argv, **more: 0)
    # (A report draws what plot draws.)
    for text, look in (("", ["plot"]), (f'trust = ["{pristine}"]', ["report", "--out", "r.md"])):
        configure(text)
        for folder in ("sent/one", "sent/many"):
            assert main([*look, folder]) == 0
            Path(folder, "recording.rrd").unlink(missing_ok=True)
            assert main(["view", folder]) == 0
            assert not sent.exists(), folder
    # Nor is it needed: what was kept is shown where the law is not.
    Path("sent/theirs.py").unlink()
    Path("sent/one/recording.rrd").unlink()
    assert main(["view", "sent/one"]) == 0


def test_what_was_not_kept_is_refused_with_the_run_to_repeat(sent, capsys):
    main(["plot", "sent/many"])
    assert "no velocities.png" in capsys.readouterr().err
    assert not Path("sent/many/figures/velocities.png").exists()
    shutil.rmtree("sent/many/failures")
    Path("sent/one/trajectory.npz").unlink()
    for name, folder in (("view", "sent/many"), ("view", "sent/one"), ("plot", "sent/one"), ("report", "sent/one")):
        capsys.readouterr()
        assert main([name, folder]) == 2
        answer = said(capsys)
        assert "which is not run for a look" in answer
        again = answer.partition("biped run ")[2].split()
        assert again == [f"{folder}/scenario.toml", "--only", again[2], "--record", "--trust"]
    assert not sent.exists()
    assert main(["run", *again]) == 0  # and it is the command that does it
    assert sent.exists()


def test_a_file_named_on_the_command_line_is_the_users_word(sent):
    write("mine.py", "import numpy as np\nclass Mine:\n    def __init__(self, setup): pass\n"
          "    def torques(self, sensed): return np.zeros(6)\n")  # fmt: skip
    write("m.toml", "duration = 0.1")
    assert main(["run", "m.toml", "--set", "law=mine.py:Mine"]) == 0
    # Of that file and no other, in that command and no later one.
    assert main(["run", "sent/s.toml", "--set", "law=mine.py:Mine"]) == 0
    assert main(["run", "runs/m/scenario.toml"]) == 2
    assert not sent.exists()


def test_a_folder_of_the_configuration_is_the_users_word(sent, pristine):
    configure(f'trust = ["{pristine}/sent"]')
    assert main(["check", "sent/s.toml"]) == 0
    assert sent.exists()


def test_a_law_is_found_beside_the_scenario_first(sent, capsys):
    write("theirs.py", "raise RuntimeError('of the working folder')\n")
    assert main(["run", "sent/s.toml", "--trust"]) == 0
    # What the user types is of the working folder alone: a file beside the scenario cannot take its place.
    Path("sent/mine.py").write_text(Path("sent/theirs.py").read_text(encoding="utf-8"), encoding="utf-8")
    capsys.readouterr()
    assert main(["run", "sent/s.toml", "--set", "law=mine.py:Theirs"]) == 2
    assert "no file 'mine.py'" in said(capsys)


@pytest.mark.parametrize("changed", ["theirs.py", "helper.py"])
def test_a_law_that_changed_is_noticed(sent, changed, capsys):
    with open(f"sent/{changed}", "a", encoding="utf-8") as file:
        file.write("# edited\n")
    for argv in (["one/scenario.toml"], ["many/scenario.toml", "--only", "1"]):
        capsys.readouterr()
        assert main(["run", f"sent/{argv[0]}", *argv[1:], "--trust"]) == 2
        assert "has changed since these results were made" in said(capsys)
    # Continuing a campaign with it would mix two laws.
    assert main(["run", "sent/s.toml", "--trust", "--out", "sent/many", *CAMPAIGN]) == 2
    assert not sent.exists()
    # The scenario itself runs the law as it is, and so do the results if one asks for it.
    assert main(["run", "sent/s.toml", "--trust"]) == 0
    assert main(["run", "sent/one/scenario.toml", "--set", "law=sent/theirs.py:Theirs"]) == 0


def test_a_law_that_changes_during_a_campaign_ends_it(sent, capsys):
    """Half a campaign of each of two laws would be of neither."""
    write(
        "sent/theirs.py",
        LAW.format(canary="canary") + "with open(__file__, 'a') as file:\n    file.write('# edited')\n",
    )
    argv = ["run", "sent/s.toml", "--trust", "--set", "randomise.runs=3", "--jobs", "1", "--out", "new"]
    assert main(argv) == 2
    assert "has changed since" in said(capsys)


def test_the_same_law_gives_the_same_digest_and_the_results_hold_it(sent, capsys):
    there = tomllib.loads(Path("sent/one/scenario.toml").read_text(encoding="utf-8"))
    assert there["law_sha256"] == digest("sent/theirs.py:Theirs")
    shutil.copytree("sent", "moved")
    assert digest("moved/theirs.py:Theirs") == there["law_sha256"]
    Path("moved/beside.py").write_text("not imported", encoding="utf-8")
    assert digest("moved/theirs.py:Theirs") == there["law_sha256"]
    _, again = command(capsys, "run", "sent/one/scenario.toml", "--trust")
    assert again["passed"]


def test_compiled_code_beside_a_law_is_not_what_runs(sent):
    """A .pyc that claims to be of this file would run instead of what the user has read."""
    write("read.py", "class Law: pass\n")
    write("evil.py", "Law = type('Evil', (), {})\n")
    file = Path("read.py").resolve()
    py_compile.compile("evil.py", importlib.util.cache_from_source(str(file)), dfile="read.py",
                       invalidation_mode=py_compile.PycInvalidationMode.UNCHECKED_HASH)  # fmt: skip
    with trusting():
        grant(file)
        assert load_law(f"{file}:Law").__name__ == "Law"


def test_load_law_is_the_last_door(sent, pristine):
    with pytest.raises(InputError, match="outside the package"):
        load_law(f"{pristine}/sent/theirs.py:Theirs")
    assert not sent.exists()


@pytest.mark.parametrize("kind", ["compressed", "claims", "other names", "words", "pickle", "empty", "cut"])
def test_a_trajectory_that_means_harm_is_refused(kind, sent, capsys):
    path = Path("sent/one/trajectory.npz")
    with np.load(path) as file:
        arrays = dict(file)
    n = len(arrays["time"])
    if kind == "compressed":  # 10 MB may be 10 GB
        np.savez_compressed(path, **arrays)
    elif kind == "cut":
        path.write_bytes(path.read_bytes()[:5000])
    else:
        about = json.loads(str(arrays["about"]))
        robot = about["robot"] | {"seven_links": {"x": 1}}
        changes = {
            "claims": {"about": np.array(json.dumps(about | {"tick": 0.0}))},
            "other names": {"about": np.array(json.dumps(about | {"robot": robot}))},
            "words": {"q": np.full((n, 9), "words")},
            "pickle": {"q": np.array([Path("x")] * n, dtype=object)},
            "empty": {name: array[:0] for name, array in arrays.items() if name != "about"},
        }
        np.savez(path, **(arrays | changes[kind]))
    for name in ("plot", "view"):
        assert main([name, "sent/one"]) == 2
        assert "trajectory.npz: not a trajectory" in said(capsys)
