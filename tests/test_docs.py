"""What the documentation says of files, commands and rooms is so; what is generated equals its generator."""

from __future__ import annotations

import re
import shlex
import shutil
import textwrap
import tomllib
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path

import pytest

from biped.base.errors import InputError
from biped.base.files import locate
from biped.base.trust import trusted
from biped.cli import gallery, reference
from biped.cli.main import parsed
from biped.ensemble.cluster import file
from biped.robot.report import look
from biped.scenario.card import read_card
from biped.scenario.gait import speeds_of
from biped.scenario.reading import read_scenario
from biped.scenario.transitions import transitions_of
from biped.show import references
from biped.studies.regress.references import read, shipped
from tests import documented

ROOT = Path(__file__).parents[1]
PAGES = sorted([*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")])
NOTES = ROOT / "docs" / "notes"


COMMANDS = [(page.name, command) for page in documented.PAGES for command in documented.commands(page)]


@pytest.mark.parametrize(("page", "command"), COMMANDS)
def test_every_command_can_be_typed(page, command):
    args = parsed(shlex.split(command))
    names = getattr(args, "scenario", None) or []
    for name in [names] if isinstance(names, str) else names:
        known = re.search(r"[A-Z*]|^my|^first\.toml", name) is None
        if known and not Path(name).is_absolute():
            locate("scenarios", name, page)


def test_the_commands_were_found():
    assert len(COMMANDS) > 200


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_lead_somewhere(page):
    text = page.read_text(encoding="utf-8")
    for target in re.findall(r"\]\(([^)#]+)(?:#[^)]*)?\)", text):
        if "://" not in target:
            assert (page.parent / target).exists(), f"{page.name}: {target}"


@pytest.mark.parametrize("page", [page for page in PAGES if NOTES not in page.parents], ids=lambda page: page.name)
def test_modules_and_files_that_are_named_exist(page):
    text = page.read_text(encoding="utf-8")
    for module in set(re.findall(r"`(?:python -m )?(biped\.[a-z_.]+[a-z])`", text)):
        assert find_spec(module.rpartition(".")[0]), f"{page.name}: {module}"  # or a name within a module
    files = r"(?<![\w/.])((?:biped|tests|scenarios|controllers|models)/[\w/]+\.(?:py|toml|xml|json))"
    for path in set(re.findall(files, text)):
        assert (ROOT / path).exists(), f"{page.name}: {path}"


def test_the_house_is_the_one_that_lint_enforces():
    text = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
    rooms = re.findall(r"^\| `(\w+)/` \|", text, re.MULTILINE)
    contracts = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["importlinter"][
        "contracts"
    ]
    (layers,) = (contract["layers"] for contract in contracts if contract["type"] == "layers")
    assert [room for layer in reversed(layers) for room in layer.split(" | ")] == rooms
    package = ROOT / "biped"
    there = {path.name for path in package.iterdir() if path.is_dir() and path.name not in ("__pycache__", "data")}
    assert set(rooms) == there | {"api"}
    for path in re.findall(rf"`((?:{'|'.join(rooms)})/[\w/]+\.py)`", text):
        assert (package / path).is_file(), path


README = ROOT / "README.md"


def test_the_readme_is_short_and_begins_with_two_commands():
    text = README.read_text(encoding="utf-8")
    bare = re.sub(r"<!--.*?-->", "", re.sub(r"!?\[([^\]]*)\]\([^)]*\)", r"\1", text))
    assert len(re.findall(r"[^\s|]*\w[^\s|]*", bare)) <= 400
    block = re.search(r"```sh\n(.*?)```", text, re.DOTALL)
    assert [line.split("#")[0].strip() for line in block[1].splitlines()] == ["make run", "make test"]
    lines = text.splitlines()
    assert text.index("**Does") < text.index("make run") < text.index("walk.gif")
    people = [line for line in lines if line.startswith("- **I ")]
    assert len(people) == 3
    assert all(re.search(r"\]\(docs/[\w-]+\.md\)", line) for line in people)


@pytest.mark.parametrize("page", [page for page in PAGES if NOTES not in page.parents], ids=lambda page: page.name)
def test_scenarios_in_pages_are_valid(page, tmp_path):
    """Blocks of TOML that are whole scenarios: those that say what they extend, or which model walks."""
    for i, block in enumerate(re.findall(r"```toml\n(.*?)```", page.read_text(encoding="utf-8"), re.DOTALL)):
        found = tomllib.loads(block)
        bare = re.sub(r"#.*", "", block)
        if not {"extends", "model"} & set(found) or "my_" in bare or page.name == "tuning.md":  # those are gaits
            continue
        file = tmp_path / f"page{i}.toml"
        file.write_text(block, encoding="utf-8")
        read_scenario(str(file))


def test_other_tables_in_pages_are_read(tmp_path, monkeypatch):
    """Each by whoever reads such a file; parts of a scenario are laid over one that walks."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    shutil.copy(ROOT / "models/h1.xml", "robot.xml")
    shutil.copy(ROOT / "controllers/policy/h1.onnx", "walker.onnx")
    (tmp_path / "biped").mkdir()
    readers: dict[str, tuple[str, Callable[[str], object]]] = {
        "wait": ("cluster.toml", file.read), "trust": ("biped/config.toml", lambda name: trusted(Path(name))),
        "network": ("card.toml", lambda name: read_card(Path(name))),
        "kind": ("robot.toml", lambda _: look("robot.xml")),
        "speeds": ("gait.toml", lambda name: speeds_of(Path(name))),
        "transitions": ("gait.toml", transitions_of),
    }  # fmt: skip
    count = 0
    for page in documented.PAGES:
        for block in re.findall(r"^ *```toml\n(.*?)```", page.read_text(encoding="utf-8"), re.DOTALL | re.MULTILINE):
            text = textwrap.dedent(block)
            found = tomllib.loads(text)
            kind = next((key for key in readers if key in found), None)
            if kind is None and {"extends", "model", "law"} & set(found):
                continue  # a whole scenario
            name, reader = readers[kind] if kind else ("scenario.toml", read_scenario)
            Path(name).write_text(text if kind else f'extends = "level_normal"\n{text}', encoding="utf-8")
            assert reader(name) is not None
            count += 1
    assert count > 14


def test_the_tutorial_scenario_says_what_it_says(tmp_path):
    (block,) = re.findall(r"```toml\n(.*?)```", (ROOT / "docs/first-run.md").read_text(encoding="utf-8"), re.DOTALL)
    (tmp_path / "my.toml").write_text(block, encoding="utf-8")
    assert read_scenario(str(tmp_path / "my.toml")).ground.slope == 2.0
    (tmp_path / "bad.toml").write_text(block.replace("slope =", "slop ="), encoding="utf-8")
    with pytest.raises(InputError):
        read_scenario(str(tmp_path / "bad.toml"))


def test_the_page_of_commands_is_what_the_parsers_say():
    assert reference.PAGE.read_text(encoding="utf-8") == reference.page(), "python -m biped.cli.reference"


@pytest.mark.parametrize("template", sorted((ROOT / "docs").glob("*.in.md")), ids=lambda path: path.name)
def test_a_page_that_is_made_of_a_template_has_its_words(template):
    """An edit of the page instead of its template would be lost when the page is made again."""
    words = template.read_text(encoding="utf-8").splitlines()
    page = template.with_name(template.name.replace(".in.md", ".md")).read_text(encoding="utf-8").splitlines()
    assert f"docs/{template.name}" in "\n".join(words), "the template names itself, for whoever opens the page"
    lost = [line for line in words if line not in page and not re.fullmatch("<!-- [a-z ]+ -->", line)]
    assert not lost


def test_every_page_is_listed():
    """Whoever opens the documentation finds every page from its first one."""
    index = (ROOT / "docs" / "index.md").read_text(encoding="utf-8")
    for page in (ROOT / "docs").glob("*.md"):
        if page.name != "index.md" and not page.name.endswith(".in.md"):
            assert f"]({page.name})" in index, f"docs/index.md: {page.name}"


def test_recorded_numbers_are_what_their_page_says():
    told = references.PAGE.read_text(encoding="utf-8")
    assert told == references.page(read(shipped())), "python -m biped.show.references"
    assert references.README.read_text(encoding="utf-8") == references.readme(read(shipped()))


def test_the_gallery_shows_recorded_numbers_and_a_clip_of_each():
    assert gallery.PAGE.read_text(encoding="utf-8") == gallery.page(read(shipped())), "make docs"
    clips = {path.name for path in gallery.CLIPS.iterdir()}
    assert clips == {entry.clip for entry in gallery.ENTRIES}
    assert sum(path.stat().st_size for path in gallery.CLIPS.iterdir()) < 2_500_000
