"""Standard output and error as they are found, and the last handler."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from biped.cli.commands import inputs as listing
from biped.cli.main import main
from tests.cases import SHORT, write

ROOT = Path(__file__).parents[2]
BIPED = f"{sys.executable} -m biped.cli.main"


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def shell(script: str, **environment: str) -> tuple[int, str, str]:
    done = subprocess.run(
        ["bash", "-c", script], env=os.environ | {"PYTHONPATH": str(ROOT)} | environment,
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    return done.returncode, done.stdout, done.stderr


def test_a_reader_that_leaves_does_not_change_the_exit_code():
    code, out, err = shell(f"set -o pipefail; {BIPED} list | head -n 1")
    assert (code, err) == (0, "")
    assert out.count("\n") == 1


def test_a_reader_that_leaves_does_not_make_a_failed_check_pass():
    write("s.toml", SHORT + "[expect]\nspeed = { min = 5.0 }\n")
    code, out, err = shell(f"{BIPED} check s.toml | true; echo ${{PIPESTATUS[0]}}")
    assert (code, out, err) == (0, "1\n", "")


@pytest.mark.parametrize("closed", [">&-", ">&- 2>&-", "<&- >&- 2>&-"])
def test_closed_streams(closed):
    write("s.toml", SHORT)
    code, out, err = shell(f"{BIPED} run s.toml --out x {closed}")
    assert (code, out, err) == (0, "", "")
    assert json.loads(Path("x/result.json").read_text(encoding="utf-8"))["passed"] is None, "nothing was expected"
    for file in Path("x").rglob("*"):  # nothing that was printed went into a file of the results
        assert b"stayed up;" not in file.read_bytes()


def test_a_full_disk_below_standard_output():
    code, _, err = shell(f"{BIPED} list > /dev/full")
    assert code == 1
    assert err.startswith("biped: ")
    assert "no space left" in err
    assert err.count("\n") == 1


def test_a_locale_without_our_letters():
    write("s.toml", 'description = "Grün … ü"\n' + SHORT.partition("\n")[2])
    ascii_only = {"PYTHONIOENCODING": "ascii", "PYTHONUTF8": "0"}
    code, out, err = shell(f"{BIPED} run s.toml", **ascii_only)
    assert (code, err) == (0, "")
    assert "Gr\\u00fcn \\u2026" in out
    code, out, _ = shell(f"{BIPED} run ü.toml --json", **ascii_only)
    assert code == 2
    Path("s.toml").rename("ü.toml")
    code, out, err = shell(f"{BIPED} run ü.toml --json", **ascii_only)
    assert (code, err) == (0, "")
    assert json.loads(out)["scenario"] == "ü"


def raising(error: BaseException):
    def command(_args):
        raise error

    return command


@pytest.mark.parametrize(
    ("error", "says"),
    [
        (OSError(28, "No space left on device", "x/result.json"), "x/result.json: no space left on device"),
        (MemoryError(), "out of memory"),
        (RecursionError("maximum recursion depth exceeded"), "defect"),
        (ValueError("x" * 5000), "defect"),
        (KeyError("a\x1b[31mb\nc"), "defect"),
    ],
)
def test_whatever_goes_wrong_is_one_paragraph(error, says, monkeypatch, capsys):
    monkeypatch.setattr(listing, "list_command", raising(error))
    assert main(["list"]) == 1
    out, err = capsys.readouterr()
    assert out == ""
    assert says in err
    assert err.count("\n") == 1
    assert len(err) < 1300
    assert "\x1b" not in err
    assert "Traceback" not in err
    assert main(["list", "--debug"]) == 1
    assert "Traceback" in capsys.readouterr().err


def test_debug_shows_where_bad_input_was_found(capsys):
    assert main(["--debug", "run", "level_norma"]) == 2
    assert "Traceback" in capsys.readouterr().err


def test_arguments_that_are_no_text(capsys):
    assert main(["run", "\udcff.toml"]) == 2
    assert "\\udcff.toml: expected arguments in UTF-8" in capsys.readouterr().err
