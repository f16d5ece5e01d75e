"""Hostile input: an answer, or one paragraph that names what is wrong; never a traceback, a hang or a stray file."""

from __future__ import annotations

import subprocess
import sys
import time
import weakref
from pathlib import Path

import pytest

from tests.fuzz.cases import case
from tests.fuzz.harness import SECONDS, fault
from tests.fuzz.words import quoted

SEED = 2011
DEFAULT, GROUP = 300, 100


def wrong(first: int, count: int) -> str:
    """What the fuzzer says of these cases, in processes of their own, where memory is theirs; empty if all is well."""
    command = [sys.executable, "-m", "tests.fuzz", "--seed", SEED, "--from", first, "--cases", count, "--jobs", 1]
    root = Path(__file__).parents[1]
    done = subprocess.run([str(word) for word in command], cwd=root, capture_output=True, text=True, check=False)
    return "" if done.returncode == 0 else done.stdout + done.stderr


@pytest.mark.parametrize("first", range(0, DEFAULT, GROUP))
def test_hostile_input(first):
    assert wrong(first, GROUP) == ""


@pytest.mark.slow
@pytest.mark.parametrize("first", range(DEFAULT, 3000, 300))
def test_more_hostile_input(first):
    assert wrong(first, 300) == ""


def test_the_fuzzer_tries_what_it_says():
    """Of every kind some cases get through and some are refused, or the fuzzer looks at the door alone."""
    kinds = {case(SEED, number)[0] for number in range(DEFAULT)}
    assert kinds == {"scenario", "shipped", "change", "gait", "model", "results", "journal",
                     "card", "commanded", "engine", "certify", "typed"}  # fmt: skip
    assert case(SEED, 7) == case(SEED, 7)
    assert case(SEED, 7) != case(SEED + 1, 7)
    assert quoted('a"\x1b') == '"a\\U00000022\\U0000001b"'


def test_the_harness_notices(monkeypatch):
    """A fault of every sort that the harness looks for is found."""
    from pathlib import Path

    from biped.cli.commands import inputs as listing
    from tests.fuzz.cases import Case

    def tried(command, seconds: float = SECONDS) -> str:
        monkeypatch.setattr(listing, "list_command", command)
        return fault(Case(("list",), {"a": b""}), seconds)[1] or ""

    def hang(_):
        while True:
            pass

    def hang_in_a_callback(_):
        """The first signal comes where Python drops what it raises."""

        class Kept:
            pass

        kept = Kept()
        began = time.process_time()

        def busy(_):
            while time.process_time() < began + 0.7:
                pass

        watch = weakref.ref(kept, busy)
        del kept
        assert watch() is None
        hang(None)

    def prints(text, code=0):
        return lambda _: print(text) or code

    assert tried(lambda _: 0) == ""
    assert "ZeroDivisionError" in tried(lambda _: 1 / 0)
    assert "no answer" in tried(hang, seconds=0.5)
    assert "no answer" in tried(hang_in_a_callback, seconds=0.5)
    assert "control character" in tried(prints("\x1b[2J"))
    assert "exit code 3" in tried(prints("", 3))
    assert "paragraph" in tried(prints("", 2))
    assert "outside" in tried(lambda _: (Path("stray").write_text("") and 0) or 0)
    assert "outside" in tried(lambda _: (Path("../stray").write_text("") and 0) or 0)
    assert "outside" in tried(lambda _: Path("a").unlink() or 0)
    assert "in JSON" in tried(lambda _: Path("runs").mkdir() or (Path("runs/result.json").write_text("[NaN]") and 0))
