"""Everything that can change a number is in the origin of a campaign: every key, every file that a run reads."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import msgspec
import pytest

import biped
from biped.base.errors import InputError
from biped.ensemble.journal import Journal, files_read_by, origin_of
from biped.scenario.engines import ENGINES
from biped.scenario.keys import Scenario
from biped.scenario.laws import digest
from biped.scenario.reading import read_scenario, to_toml
from biped.studies.run import plan_of

ROOT = Path(biped.__file__).parents[1]

LAW = """from pathlib import Path
import numpy as np
import helper

HERE = Path(__file__).parent
WEIGHTS = np.loadtxt(HERE / "tables" / "weights.csv")


class Law:
    def __init__(self, setup):
        self.gain = float(json_of("gains.json"))

    def torques(self, sensed):
        return helper.torques(sensed) + 0.0 * (self.gain + WEIGHTS)


def json_of(name):
    import json
    return json.loads((HERE / name).read_text())["gain"]
"""
HELPER = "import numpy as np\nfrom deeper import ZERO\n\ndef torques(sensed):\n    return np.full(6, ZERO)\n"

OPENED = """
import json, os, sys
opened = set()

def heard(event, arguments):
    if event == "open" and isinstance(arguments[0], str):
        opened.add(os.path.realpath(arguments[0]))

sys.addaudithook(heard)
import biped.ensemble.campaign as campaign
from biped.studies.run import plan_of
from biped.base.trust import trusting
with trusting(True):
    plan = plan_of(sys.argv[1], [])
    opened.clear()  # the scenario itself is written out, with its defaults and all that it extends
    for index in range(len(plan)):
        campaign.run_one(plan, index)
print(json.dumps(sorted(opened)))
"""


@pytest.fixture
def own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A scenario with model, gaits and law of its own, each of which needs other files."""
    monkeypatch.chdir(tmp_path)
    human = (ROOT / "models" / "human.xml").read_text(encoding="utf-8")
    text = human.replace("<worldbody>", '<include file="parts/more.xml"/>\n<worldbody>', 1)
    asset = '<mujocoinclude><asset><mesh name="stone" file="parts/stone.stl"/></asset></mujocoinclude>'
    stone = b"\0" * 80 + (4).to_bytes(4, "little") + _tetrahedron()
    gait = 'extends = "base.toml"\n'
    for name, data in {
        "m.xml": text, "parts/more.xml": asset, "parts/stone.stl": stone,
        "m.toml": (ROOT / "models" / "human.toml").read_text(encoding="utf-8"),
        "base.toml": (ROOT / "controllers" / "normal.toml").read_text(encoding="utf-8"),
        "a.toml": gait, "b.toml": gait, "law.py": LAW, "helper.py": HELPER, "deeper.py": "ZERO = 0.0\n",
        "gains.json": '{"gain": 1.0}', "tables/weights.csv": "1.0\n2.0\n3.0\n4.0\n5.0\n6.0\n",
        "s.toml": 'model = "m.xml"\ncontroller = "a.toml"\nlaw = "law.py:Law"\nduration = 0.02\n'
                  f'sweep.controller = ["{tmp_path}/a.toml", "{tmp_path}/b.toml"]\n',
    }.items():  # fmt: skip
        path = tmp_path / name
        path.parent.mkdir(exist_ok=True)
        path.write_bytes(data if isinstance(data, bytes) else data.encode())
    monkeypatch.setenv("BIPED_TRUST", "*")
    return tmp_path


def _tetrahedron() -> bytes:
    import numpy as np

    corners = np.eye(4, 3, dtype="<f4")
    faces = ((0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2))
    return b"".join(np.zeros(3, "<f4").tobytes() + corners[list(face)].tobytes() + b"\0\0" for face in faces)


def test_every_file_of_ones_own_is_in_the_origin(own):
    plan = plan_of("s.toml", [])
    first = origin_of(plan)["scenario"]
    names = {str(path.relative_to(own)) for path in own.rglob("*") if path.is_file()} - {"s.toml"}
    assert names == {str(path.relative_to(own)) for path in files_read_by(plan)}
    for name in sorted(names):
        path = own / name
        before = path.read_bytes()
        path.write_bytes(before + b" ")
        assert origin_of(plan)["scenario"] != first, name
        path.write_bytes(before)
    assert origin_of(plan)["scenario"] == first


def test_runs_open_nothing_that_is_not_in_the_origin(own):
    done = subprocess.run([sys.executable, "-c", OPENED, "s.toml"], cwd=own, capture_output=True, text=True, check=True,
                          env=os.environ | {"PYTHONPATH": str(ROOT)})  # fmt: skip
    opened = {Path(name) for name in json.loads(done.stdout)}
    mine = {path for path in opened if path.is_relative_to(own) or path.is_relative_to(ROOT)}
    # Kernels are in the origin by their digest, packages by their versions.
    elsewhere = ROOT / "biped", Path(sys.prefix)
    numbers = {path for path in mine if not any(map(path.is_relative_to, elsewhere))}
    numbers = {path for path in numbers if "__pycache__" not in path.parts}
    assert own / "gains.json" in numbers
    assert numbers <= set(files_read_by(plan_of("s.toml", [])))


def leaves(value: Any, at: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """Places of all values of a scenario that are no tables."""
    if isinstance(value, msgspec.Struct):
        return [place for name in value.__struct_fields__ for place in leaves(getattr(value, name), (*at, name))]
    return [at]


def other(value: Any) -> Any:
    """Another value."""
    if isinstance(value, bool):
        return not value
    if isinstance(value, int | float):
        return value + 1
    if isinstance(value, str):
        return f"{value}x"
    if isinstance(value, dict):
        return {**value, "new": 1.0}
    if isinstance(value, list | tuple):
        return (*value, *(value[:1] or (1.0,)))
    return 1.0


def changed(value: Any, place: tuple[Any, ...]) -> Any:
    """The scenario with another value in a place."""
    if not place:
        return other(value)
    return msgspec.structs.replace(value, **{place[0]: changed(getattr(value, place[0]), place[1:])})


@pytest.mark.parametrize("name", ["level_normal", "robot/sensors", "any/h1"])
def test_every_key_is_in_the_origin(name):
    scenario: Scenario = plan_of(name, []).scenario
    places, text = leaves(scenario), to_toml(scenario)
    assert len(places) > 60
    for place in places:
        assert to_toml(changed(scenario, place)) != text, ".".join(place)


def network(location: str) -> bytes:
    """As much of an ONNX file as says where weights are: a tensor's external_data."""
    value = location.encode()
    size = bytes([len(value)]) if len(value) < 128 else bytes([len(value) & 0x7F | 0x80, len(value) >> 7])
    return b"\x08\x07:\x10\x0a\x08location\x12" + size + value + b"\x12\x04rest"


@pytest.mark.parametrize("name", ["w.bin", "deep/" + "w" * 150 + ".data"])
def test_weights_beside_a_network_are_part_of_a_law(tmp_path, name):
    (tmp_path / "law.py").write_text('class Law:\n    network = "walker.onnx"\n', encoding="utf-8")
    (tmp_path / "walker.onnx").write_bytes(network(name))
    weights = tmp_path / name
    weights.parent.mkdir(exist_ok=True)
    law, found = f"{tmp_path}/law.py:Law", []
    for text in (b"one", b"two"):
        weights.write_bytes(text)
        found.append(digest(law))
    assert found[0] != found[1]


def test_what_a_law_logs_is_no_part_of_it(tmp_path):
    text = 'open("a.txt", "w")\nopen("b.txt", mode="ab")\nnp.savetxt("c.txt", [1])\nopen("in.txt")\n'
    (tmp_path / "law.py").write_text(text, encoding="utf-8")
    law, found = f"{tmp_path}/law.py:Law", [digest(f"{tmp_path}/law.py:Law")]
    for name in ("a.txt", "b.txt", "c.txt", "in.txt"):
        (tmp_path / name).write_text("1", encoding="utf-8")
        found.append(digest(law))
    assert found[0] == found[1] == found[2] == found[3] != found[4]


def test_the_loops_of_the_blas_are_in_the_origin(tmp_path):
    """Told to take others, it says so: they change last digits."""
    code = "from biped.ensemble.journal import here; print(here()['blas'])"
    found = [
        subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True,
                       env=os.environ | {"PYTHONPATH": str(ROOT), "OPENBLAS_CORETYPE": core}).stdout.strip()
        for core in ("Haswell", "Sandybridge")
    ]  # fmt: skip
    assert found == ["Haswell", "Sandybridge"] or found == ["", ""]  # not every NumPy has OpenBLAS


VERSIONS = {"drake": "9.1", "onnxruntime": "9.2"}


@pytest.mark.parametrize("engine", ENGINES)
def test_versions_of_libraries_that_runs_use_are_in_the_origin_and_no_others(engine, tmp_path, monkeypatch):
    monkeypatch.setattr("biped.ensemble.journal.installed", VERSIONS.get)
    found = origin_of(plan_of("level_normal", [f"engine={engine}"]))
    assert {name: found[name] for name in VERSIONS if name in found} == ({"drake": "9.1"} if engine == "drake" else {})
    monkeypatch.chdir(tmp_path)
    (tmp_path / "law.py").write_text('class Law:\n    network = "walker.onnx"\n', encoding="utf-8")
    (tmp_path / "walker.onnx").write_bytes(b"weights")
    found = origin_of(plan_of("level_normal", [f"engine={engine}", "law=law.py:Law"]))
    assert found["onnxruntime"] == "9.2"


def test_a_journal_of_another_version_of_drake_is_refused(tmp_path, monkeypatch):
    plan, path = plan_of("level_normal", ["engine=drake"]), tmp_path / "runs.jsonl"
    origins = []
    for version in ("1.50.0", "1.51.1"):
        monkeypatch.setattr("biped.ensemble.journal.installed", {"drake": version}.get)
        origins.append(origin_of(plan))
    Journal(path, origins[0]).note({"index": 0, "seed": 1})
    assert len(Journal(path, origins[0]).read()[0]) == 1
    with pytest.raises(InputError, match=r"drake.*1\.5[01]\.[01].*1\.5[01]\.[01]"):
        Journal(path, origins[1]).read()


@pytest.mark.parametrize("change", ["sweep={}", "randomise={runs=3, draw={}}", "randomise.draw={}", "expect={}"])
def test_an_empty_table_takes_away_what_files_say(change, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    text = 'sweep."ground.slope" = [0.0, 1.0]\nexpect.falls.max = 1\nrandomise.draw."ground.friction".choice = [1.0]\n'
    Path("s.toml").write_text(text, encoding="utf-8")
    Path("t.toml").write_text('extends = "s.toml"\nsweep = {}\n[expect]\n[randomise.draw]\n', encoding="utf-8")
    whole, empty = read_scenario("s.toml"), read_scenario("t.toml")
    assert (len(whole.sweep), len(whole.expect), len(whole.randomise.draw)) == (1, 1, 1)
    assert not any((empty.sweep, empty.expect, empty.randomise.draw))
    less = read_scenario("s.toml", [change])
    assert len(less.sweep) + len(less.expect) + len(less.randomise.draw) == 2
    assert read_scenario("s.toml", ["ground.slope=3", "ground={}"]).ground == whole.ground


@pytest.mark.parametrize("key", ['sweep."ground.slope"', "sweep.'ground.slope'", ' sweep . "ground.slope" '])
def test_a_key_in_quotes_is_one_part(key):
    assert read_scenario("level_normal", [f"{key}=[1.0, 2.0]"]).sweep == {"ground.slope": (1.0, 2.0)}
