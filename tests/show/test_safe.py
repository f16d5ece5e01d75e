"""Words of somebody else on the terminal."""

from __future__ import annotations

import io

import pytest

from biped.cli.main import main
from biped.show.terminal import SafeConsole
from tests.cases import SHORT, write

WORDS = ("[/nope]", "[link=http://x]y[/link]", "\\", "[bold", ":smile:", "[[x]]", "\\[x]", "[0, 1]", "[@click=a()]b")


def printed(text: str) -> str:
    out = io.StringIO()
    SafeConsole(file=out, width=200, force_terminal=True, color_system=None).print(text)
    return out.getvalue()


@pytest.mark.parametrize("word", WORDS)
def test_words_are_printed_as_they_are(word):
    assert printed(f"[bold]title {word}[/bold] {word}\n").replace("\n", "") == f"title {word} {word}"


@pytest.mark.parametrize("word", ["[/green]", "[red]", "[/bold]"])
def test_our_own_styles_do_no_harm(word):
    assert "title" in printed(f"[bold]title[/bold]: {word}")


def test_escapes_are_written_out():
    assert printed("a\x1b[2J\x07\u202eb") == "a\\x1b[2J\\x07\\u202eb\n"


@pytest.mark.parametrize("text", ["[/nope]", "[/bold] x", "\\u001b]0;owned\\u0007"])
def test_a_description_prints_whatever_it_is(text, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    write("s.toml", f'description = "{text}"\n' + SHORT.partition("\n")[2] + "[expect]\nfalls = { max = 1 }\n")
    assert main(["run", "s.toml", "--out", "x"]) == 0
    assert main(["check", "s.toml"]) == 0
    out = capsys.readouterr().out
    assert "\x1b" not in out
    assert out.count(text.replace("\\u001b", "\\x1b").replace("\\u0007", "\\x07")) == 2
