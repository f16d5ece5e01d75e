"""Results folders that something happened to: one sentence that names file and remedy, wherever they are read."""

from __future__ import annotations

import json
from contextlib import chdir
from pathlib import Path

import numpy as np
import pytest

from biped.cli.main import main
from tests.cases import ENSEMBLE, SHORT, contents, write


@pytest.fixture(scope="module")
def stored(tmp_path_factory):
    """Files of a single run and of a campaign."""
    with chdir(tmp_path_factory.mktemp("stored")):
        write("s.toml", SHORT)
        write("e.toml", ENSEMBLE)
        assert main(["run", "s.toml", "--out", "one"]) == 0
        assert main(["run", "e.toml", "--jobs", "1", "--out", "many"]) == 0
        return {name: contents(name) for name in ("one", "many")}


@pytest.fixture(autouse=True)
def folder(stored, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for folder, files in stored.items():
        for name, data in files.items():
            path = Path(folder, name)
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(data)


def altered(change) -> bytes:
    result = json.loads(Path("many/result.json").read_bytes())
    change(result)
    return json.dumps(result).encode()


POINT = {"values": {"ground.slope": 1.0}, "runs": 1, "walked": 1, "falls": 0, "rate": 1.0, "interval": [0.2, 1.0]}
RESULTS = {
    "object": lambda: b"{}",
    "list": lambda: b"[]",
    "null": lambda: b"null",
    "number": lambda: b"7",
    "nothing": lambda: b"",
    "NUL": lambda: b"\0" * 100,
    "not UTF-8": lambda: Path("many/result.json").read_bytes().replace(b"mujoco", b"\xff\xfe"),
    "cut": lambda: Path("many/result.json").read_bytes()[:1000],
    "deep": lambda: b"[" * 100_000,
    "no runs": lambda: altered(lambda result: result.update(runs=[])),
    "no summary": lambda: altered(lambda result: result.pop("summary")),
    "a run that is a word": lambda: altered(lambda result: result["runs"].__setitem__(1, "two")),
    "a run without its number": lambda: altered(lambda result: result["runs"][1].pop("index")),
    "a negative number": lambda: altered(lambda result: result["runs"][1].update(index=-1)),
    "a number that is none": lambda: altered(lambda result: result["runs"][1].update(speed="fast")),
    "a summary that is none": lambda: altered(lambda result: result["summary"].update(speed=[1.0])),
    "no interval": lambda: altered(lambda result: result["summary"].update(walked_interval=None)),
    "a sweep without points": lambda: altered(lambda result: result.update(points=[], thresholds=[])),
    "a sweep of nothing": lambda: altered(lambda result: result.update(points=[POINT | {"values": {}}], thresholds=[])),
    "a sweep without thresholds": lambda: altered(lambda result: result.update(points=[POINT])),
    "checks that are none": lambda: altered(lambda result: result.update(checks=[{"name": "falls"}])),
}

READERS = {
    "plot": ["plot", "many"],
    "report": ["report", "one", "many", "--out", "r.md"],
    "view": ["view", "many"],
}


def one_sentence(capsys, *fragments: str) -> None:
    err = capsys.readouterr().err
    assert err.startswith("biped: ")
    assert err.count("\n") == 1
    assert len(err) < 700
    for fragment in fragments:
        assert fragment in err


@pytest.mark.parametrize("reader", READERS)
@pytest.mark.parametrize("kind", RESULTS)
def test_a_result_that_is_not_whole(kind, reader, capsys, monkeypatch):
    if reader == "report":  # drawing the good one is another matter
        from biped.show import replay

        monkeypatch.setattr(replay, "plot_results", lambda folder, out: [])
    Path("many/result.json").write_bytes(RESULTS[kind]())
    capsys.readouterr()
    assert main(READERS[reader]) == 2
    one_sentence(capsys, "many/result.json", "expected the whole result of a run", "biped run many/scenario.toml")
    assert not Path("many/figures").exists()
    assert not Path("r.md").exists()


def test_a_result_of_another_scenario(capsys):
    Path("many/scenario.toml").write_bytes(Path("one/scenario.toml").read_bytes())
    assert main(["plot", "many"]) == 2
    one_sentence(capsys, "many/result.json: has a run 5", "many/scenario.toml makes 1")


def test_a_result_without_its_scenario(capsys):
    Path("many/scenario.toml").unlink()
    assert main(["plot", "many"]) == 2
    one_sentence(capsys, "many: expected the scenario.toml")


def test_results_of_an_earlier_version_are_read(capsys):
    """Metrics that it did not know are missing, keys that this one does not know are there."""

    def earlier(result):
        for numbers in (result["summary"], *result["runs"]):
            del numbers["stood"], numbers["contact_loss"]
            numbers["unheard_of"] = 1.0
        result["written_by"] = "another"

    Path("many/result.json").write_bytes(altered(earlier))
    assert main(["plot", "many"]) == 0


def with_arrays(**changes) -> bytes:
    with np.load("one/trajectory.npz", allow_pickle=False) as file:
        arrays = {name: file[name] for name in file.files}
    for name, value in changes.items():
        arrays.pop(name)
        if value is not None:
            arrays[name] = value
    np.savez("changed.npz", **arrays)
    return Path("changed.npz").read_bytes()


def about(**changes) -> bytes:
    with np.load("one/trajectory.npz", allow_pickle=False) as file:
        rest = json.loads(str(file["about"]))
    for name, value in changes.items():
        rest.pop(name, None)
        if value is not None:
            rest[name] = value
    return with_arrays(about=np.array(json.dumps(rest)))


TRAJECTORIES = {
    "nothing": lambda: b"",
    "cut": lambda: Path("one/trajectory.npz").read_bytes()[:5000],
    "NUL": lambda: b"\0" * 5000,
    "bits": lambda: Path("one/trajectory.npz").read_bytes().replace(b"\x3f", b"\x3e"),
    "no velocities": lambda: with_arrays(v=None),
    "too few velocities": lambda: with_arrays(v=np.zeros((500, 8))),
    "words": lambda: with_arrays(v=np.full((500, 9), "fast")),
    "no rows": lambda: with_arrays(time=np.zeros(0)),
    "objects": lambda: with_arrays(v=np.full((500, 9), None)),
    "no robot": lambda: about(robot=None),
    "a robot of words": lambda: about(robot={"mass": "heavy"}),
    "a key too many": lambda: about(colour="red"),
    "no tick": lambda: about(tick=None),
    "a tick of zero": lambda: about(tick=0.0),
    "about nothing": lambda: with_arrays(about=np.array("[]")),
}


@pytest.mark.parametrize("kind", TRAJECTORIES)
@pytest.mark.parametrize("reader", ["plot", "view"])
def test_a_trajectory_that_is_not_whole(kind, reader, capsys):
    Path("one/trajectory.npz").write_bytes(TRAJECTORIES[kind]())
    assert main([reader, "one"]) == 2
    one_sentence(capsys, "one/trajectory.npz", "not a trajectory", "remove it")
    assert not Path("one/figures").exists()
    assert not Path("one/recording.rrd").exists()
