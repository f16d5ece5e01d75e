"""Every command of the documentation is carried out, page by page, with fewer runs; what is not has a reason."""

from __future__ import annotations

import re
import shlex
import shutil
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

from biped.cli.main import main, parsed
from biped.scenario.card import read_card
from biped.studies.policy import run_of
from biped.studies.policy.tape import record
from tests.cases import write
from tests.control.test_card import FLOOR, SERVOS, network
from tests.documented import (
    FEWER,
    HISTORY,
    MINUTES,
    PAGES,
    PLACEHOLDERS,
    ROOT,
    SHORTER,
    SKIPPED,
    commands,
    shell,
    short,
    skipped,
)
from tests.robot.test_recognise import model
from tests.studies.test_policy import DEPLOY, DESCRIPTORS, mjlab
from tests.test_tutorials import steps

FOUND = [command for page in PAGES for command in commands(page)]
LINES = sorted({line.partition(" #")[0] for page in PAGES for line in shell(page) if "biped " not in line})
SCENARIOS = {
    "my.toml": 'extends = "demo/push"\n',
    "my_scenario.toml": 'extends = "demo/push"\n',
    "my_failure.toml": 'extends = "demo/push"\nexpect = { falls = { max = 0 } }\n',
    "my_walk.toml": 'extends = "any/h1_walk"\n',
    "my_gait.toml": 'extends = "whole"\n',
    "first.toml": 'law = "walker.toml"\ncommand = { forward = 0.5 }\n',
}
"""Files of a reader's own that pages name without their text."""
MODELS = ("my_robot.xml", "scene.xml", "other.xml", "g1.xml", "g1/scene_29dof.xml", "mine/r1/scene.xml", "R1_C++.xml")
CARDS = ("walker.toml", "card.toml", "h1.toml", "g1.toml", "g1_policy.toml", "t1.toml")
FOUND_BY_SEARCHES = ("gait.toml", "walk.toml")
"""Gaits of searches that take minutes, in folders."""
LAWS = ("my_law.py", "law.py", "stand.py")
TOOLS = {"pip": "downloads packages", "dask": "waits for workers", "python -m venv": "is Python's own",
         "python -c \"import torch": "needs PyTorch"}  # fmt: skip
"""Lines of shell that are not carried out, by how they begin, and why."""


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    """Results of two short runs, recorded."""
    folder = tmp_path_factory.mktemp("made") / "results"
    command = ["run", "demo/push", "--set", "randomise.runs=2", "--record", "--jobs", "1", "--out", str(folder)]
    assert main(command) in (0, 1)
    return folder


def law(name: str) -> str:
    """The text of a law that pages name: `Stand` is for seven links, the law of the tutorial of a robot for any."""
    page, begins = ("python.md", "# stand.py") if name == "stand.py" else ("your-robot.md", "class Law")
    (text,) = [text for language, text, _ in steps(page) if language == "python" and text.startswith(begins)]
    return text


def network_of(words: list[str]) -> None:
    """A trainer's network and what it leaves beside it, for a card that is about to be written."""
    file = Path(words[1])
    file.with_suffix(".toml").unlink(missing_ok=True)  # the page has one line for each trainer
    Path("net.onnx").unlink(missing_ok=True)
    robot = Path(words[words.index("--model") + 1])
    robot.parent.mkdir(parents=True, exist_ok=True)
    write(str(robot), model(actuators=SERVOS, world=FLOOR))
    write("deploy.yaml", DEPLOY)
    write("io.yaml", DESCRIPTORS)
    if "--deploy" not in words:
        mjlab()
    else:
        network(15 + 4 if "deploy.yaml" in words else 15 + 4 + 2 + 3, 4)
    Path("net.onnx").rename(file)


def furnish(words: list[str], results: Path) -> None:
    """Puts there what a command takes for granted: files of the reader's own, and results of earlier runs."""
    args = parsed(words)
    if words[0] == "policy" and words[1].endswith(".onnx"):
        network_of(words)
    named = {word.partition(":")[0].rpartition("=")[2].strip('"') for word in words}
    for name in named:
        if Path(name).exists():
            continue
        if name in SCENARIOS:
            write(name, SCENARIOS[name])
        elif Path(name).name in FOUND_BY_SEARCHES:
            Path(name).parent.mkdir(parents=True, exist_ok=True)
            write(name, 'extends = "any/h1"\n')
        elif name in LAWS and words[0] != "new":
            write(name, law(name))
        elif name in MODELS:
            Path(name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(ROOT / "models/h1.xml", name)
        elif name in CARDS:
            assert main(["new", "policy", name]) == 0
    if "tape.npz" in words:
        run = run_of(Path("walker.toml"), read_card(Path("walker.toml")), (0.3, 0.0, 0.0))
        np.savez("tape.npz", **record(run)._asdict())
    if "mine.json" in words and "--update" not in words:
        assert main(["regress", "my.toml", "--file", "mine.json", "--update", "--reason", "new"]) == 0
    if words[0] in ("plot", "report", "video", "export") or (words[0] == "diff" and args.scenario is None):
        folders = [args.first, args.second] if words[0] == "diff" else args.run
        for name in folders if isinstance(folders, list) else [folders]:
            if not Path(name).exists():
                shutil.copytree(results, name)


def promised(args) -> list[Path]:
    """The files and folders that a command is asked to write."""
    asked = (getattr(args, name, None) for name in ("out", "html", "junit", "summary", "mcap", "eurobench"))
    return [Path(path) for path in asked if path is not None]


@pytest.mark.slow
@pytest.mark.parametrize(
    "page",
    [page for page in PAGES if commands(page) and page not in HISTORY],
    ids=lambda page: str(page.relative_to(ROOT)),
)
def test_the_commands_of_a_page_can_be_typed_in_their_order(page, results, tmp_path, monkeypatch, capsys):
    """Exit code 2 is bad input, so a reader cannot type the command. 1 and 3 are verdicts on runs; a test has few."""
    monkeypatch.chdir(tmp_path)
    for name in ("models", "scenarios", "controllers"):
        shutil.copytree(ROOT / name, name)  # as a clone has them
    for language, text, name in steps(str(page)):
        if name and language in ("toml", "python"):
            Path(name).parent.mkdir(parents=True, exist_ok=True)
            write(name, text)
    for command in commands(page):
        need = SKIPPED[part][0] if (part := skipped(command)) else ""
        if command in MINUTES or (part and find_spec(need) is None):
            continue
        for words in short(command, lambda words: furnish(words, results)):
            assert main(words) in (0, 1, 3), f"biped {shlex.join(words)}: {capsys.readouterr().err}"
            for path in promised(parsed(words)):
                assert path.exists(), f"biped {shlex.join(words)}: {path}"


def test_every_exception_is_still_needed():
    text = " ".join([*FOUND, *PLACEHOLDERS.values(), *SHORTER.values()])
    for part in SKIPPED:
        assert any(skipped(command) == part for command in FOUND), part
    for command in MINUTES:
        assert command in FOUND, command
        assert skipped(command) is None, command
    for pattern in SHORTER:
        assert any(re.search(pattern, command) for command in FOUND), pattern
    for name in FEWER:
        assert any(command.startswith(name) for command in FOUND), name
    for name in [*SCENARIOS, *MODELS, *CARDS, *FOUND_BY_SEARCHES, *LAWS, *PLACEHOLDERS]:
        assert name in text, name


def test_tools_are_named():
    assert all(any(line.removeprefix(".venv/bin/").startswith(tool) for line in LINES) for tool in TOOLS)


def test_most_commands_are_carried_out():
    left = [command for command in set(FOUND) if skipped(command) or command in MINUTES]
    assert len(left) < 0.15 * len(set(FOUND))


@pytest.mark.parametrize("line", LINES)
def test_other_lines_of_shell_name_what_there_is(line):
    words = shlex.split(line.removeprefix(".venv/bin/"))
    if any(line.removeprefix(".venv/bin/").startswith(tool) for tool in TOOLS):
        return
    if words[0] == "make":
        assert re.search(rf"^{words[1]}:", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE)
    elif words[:3] == ["python", "-m", "pytest"]:
        paths = [word for word in words[3:] if word.startswith("tests/")]
        assert paths
        assert all((ROOT / path).exists() for path in paths)
    else:
        assert words[:2] == ["python", "-m"]
        assert find_spec(words[2])
