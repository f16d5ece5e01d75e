"""Whose code may run: nobody's unless the user said so."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from biped.base.errors import InputError
from biped.base.files import folder
from biped.base.trust import configuration, grant, refusal, trusted, trusting


@pytest.fixture(autouse=True)
def home(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("BIPED_TRUST", raising=False)
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "xdg"))
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    for name in ("mine/deep/l.py", "theirs/l.py"):
        Path(name).parent.mkdir(parents=True)
        Path(name).write_text("", encoding="utf-8")


def configure(text: str) -> None:
    configuration().parent.mkdir(parents=True, exist_ok=True)
    configuration().write_text(text, encoding="utf-8")


def test_nothing_outside_the_package_is_trusted():
    assert not trusted(Path("mine/deep/l.py"))
    assert trusted(folder("scenarios") / "l.py")


def test_a_folder_of_the_configuration_is_trusted_with_all_below_it(tmp_path):
    configure(f'trust = ["{tmp_path}/mine"]')
    assert trusted(Path("mine/deep/l.py"))
    assert not trusted(Path("theirs/l.py"))
    assert not trusted(Path("mine/../theirs/l.py"))
    Path("mine/link.py").symlink_to(tmp_path / "theirs/l.py")
    assert not trusted(Path("mine/link.py")), "what a link leads to counts"


def test_home_is_understood(tmp_path):
    configure('trust = ["~/laws"]')
    assert trusted(tmp_path / "home/laws/l.py")
    assert not trusted(tmp_path / "home/l.py")


def test_where_the_configuration_is(tmp_path, monkeypatch):
    assert configuration() == tmp_path / "xdg/biped/config.toml"
    for value in ("", "relative"):  # a relative one would be whoever's made the working folder
        monkeypatch.setenv("XDG_CONFIG_HOME", value)
        assert configuration() == tmp_path / "home/.config/biped/config.toml"


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("trust = [", "cannot be read as TOML"),
        ("trsut = []", "'trust'"),
        ("trust = '/'", "list of folders"),
        ("trust = [1]", "list of folders"),
        ("trust = ['.']", "whole paths"),
        ("trust = ['laws']", "whole paths"),
    ],
)
def test_a_bad_configuration_is_said_and_grants_nothing(text, says):
    configure(text)
    with pytest.raises(InputError, match=says) as error:
        trusted(Path("theirs/l.py"))
    assert str(configuration()) in str(error.value)


def test_grants_end_with_their_block():
    with trusting(everything=True):
        assert trusted(Path("theirs/l.py"))
    assert not trusted(Path("theirs/l.py"))
    with trusting():
        grant(Path("theirs/l.py"))
        assert trusted(Path("theirs/l.py"))
        assert not trusted(Path("mine/deep/l.py"))
    assert "BIPED_TRUST" not in os.environ


def test_a_refusal_says_what_to_do(tmp_path):
    text = refusal(Path("theirs/l.py"))
    assert "--trust" in text
    assert f'trust = ["{tmp_path}/theirs"]' in text
    assert str(configuration()) in text
