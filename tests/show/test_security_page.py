"""docs/security.md says what the code does."""

from __future__ import annotations

import re
from pathlib import Path

from biped.robot import safety

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "security.md").read_text(encoding="utf-8")


def test_every_test_that_holds_a_row_exists():
    named = set(re.findall(r"`(tests/[\w/]+\.py)`", PAGE))
    assert len(named) >= 6
    assert all((ROOT / name).is_file() for name in named)


def test_the_bounds_of_models_are_those_of_the_code():
    text = " ".join(PAGE.split())
    assert f"at most {safety.MOST_BYTES // 10**6} MB with all its includes" in text
    assert f"{safety.MOST_DEPTH} elements deep, 20 000 elements, at most {safety.MOST_FILES} files" in text
    assert safety.MOST_ELEMENTS == 20_000
    assert f"{round(safety.MOST_PIXELS**0.5)}² pixels and {safety.MOST_ASSET_BYTES // 10**6} MB of assets" in text
    assert f"at most {safety.LONGEST_NAME} bytes" in text
    assert all(f"`{element}`" in text for element in safety._ABSENT)
    assert f"{safety.MOST_SECONDS} s of processor time, {safety.MOST_WAIT:g} s by the clock" in text
    assert f"{safety.MOST_BESIDES >> 20} MB beyond" in text


def test_the_commands_that_take_trust_are_those_named():
    import argparse

    from biped.cli.common import commands_of
    from biped.cli.main import build

    parser = build()
    assert isinstance(parser, argparse.ArgumentParser)
    taking = {name for name, command in commands_of(parser).items() if "--trust" in command.format_help()}
    sentence = re.search(r"\*\*`--trust`\*\* \(to (.*?)\)", " ".join(PAGE.split()))
    assert taking == set(re.findall(r"`(\w+)`", sentence[1]))
