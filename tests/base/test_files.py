"""Reading files of strangers."""

from __future__ import annotations

from pathlib import Path

import pytest

from biped.base.errors import ECHO, PARAGRAPH, InputError, echo, paragraph, plain, safe
from biped.base.files import DEEPEST, locate, parse_toml

HOSTILE = {
    "dotted key": "a." * 400_000 + "a = 1",
    "quoted key": '"a b".' * 100_000 + "a = 1",
    "lists": "a = " + "[" * 300_000,
    "tables": "a = " + "{b = " * 100_000,
    "digits": "a = " + "9" * 500_000,
    "brackets": "[" * 900_000,
    "header": "[" + ".".join("a" * 1000) + "]",
}


@pytest.mark.parametrize("name", HOSTILE)
def test_hostile_toml_is_a_value_error(name):
    with pytest.raises(ValueError):  # noqa: PT011
        parse_toml(HOSTILE[name])


def test_what_people_write_is_read():
    assert len(parse_toml('a = "' + "b.c. " * 10 + '"')["a"]) == 50
    for text in ("a = " + "[" * (DEEPEST - 1) + "]" * (DEEPEST - 1), ".".join("a" * (DEEPEST - 1)) + " = 1"):
        parse_toml(text)


def test_nothing_that_a_terminal_would_obey_is_left():
    nasty = "".join(map(chr, [*range(32), *range(127, 160), 0x2028, 0x202E, 0x2066, 0xFEFF, 0xD800, 0xE0041]))
    out = plain(f"a{nasty}b")
    assert out.isprintable()
    assert out.startswith("a\\x00")
    assert out.endswith("\\U000e0041b")
    assert plain("Grüße, θ, 日本, …") == "Grüße, θ, 日本, …"


def test_echoes_are_short():
    assert len(safe("x" * 10_000)) == ECHO
    assert safe("x" * ECHO) == "x" * ECHO
    assert len(paragraph("x y\n" * 10_000)) == PARAGRAPH
    assert echo(10**5000) == "a whole number of 16610 bits"
    assert echo([10**5000]) == "a list"
    assert echo([1] * 5000) == "a list of 5000"
    assert echo("a\x1bb") == "'a\\x1bb'"


@pytest.mark.parametrize(("kind", "written", "meant"), [
    ("scenarios", "any/cels/level", "any/cells/level"), ("scenarios", "elsewhere/tune/robst.toml", "tune/robust"),
    ("controllers", "any/g2", "any/g1"), ("controllers", "/nowhere/robst.toml", "robust"),
])  # fmt: skip
def test_a_path_is_like_a_name_as_a_whole_or_in_its_last_part(kind, written, meant):
    with pytest.raises(InputError, match=f"did you mean '{meant}'"):
        locate(kind, written, "")


def test_a_model_where_a_scenario_is_asked_for(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InputError, match=r"no scenario 'r.urdf'; expected the path of a file \*.toml or a name: valid"):
        locate("scenarios", "r.urdf", "")
    Path("r.urdf").write_text("", encoding="utf-8")
    with pytest.raises(InputError, match=r"'r.urdf' is a model: biped model says what it is"):
        locate("scenarios", "r.urdf", "")
    with pytest.raises(InputError, match=r"the path of a file \*.xml or \*.urdf"):
        locate("models", "nosuch", "model")
