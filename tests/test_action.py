"""The action for foreign repositories does what it says where there is no repository of biped's around it."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

from biped.cli.main import parsed

ROOT = Path(__file__).parents[1]
SCENARIO = """extends = 'upright/own'
duration = 0.3
window = {{ start = 0.1, end = 0.3 }}
expect = {{ falls = {{ max = 0 }}, peak_torque = {{ {} }} }}
"""


@pytest.mark.parametrize(("bound", "code"), [("max = 1000.0", 0), ("max = 0.0", 1), ("mox = 1.0", 2)])
def test_the_check_writes_junit_and_a_summary_and_hands_its_exit_code_on(tmp_path, bound, code):
    (tmp_path / "mine.toml").write_text(SCENARIO.format(bound), encoding="utf-8")
    command = tmp_path / "biped"
    command.write_text(f'#!/bin/sh\nexec {sys.executable} -m biped "$@"\n', encoding="utf-8")
    command.chmod(0o755)
    environment = {
        "PATH": "/usr/bin:/bin", "PYTHONPATH": str(ROOT), "RUNNER_TEMP": str(tmp_path), "BIPED": str(command),
        "GITHUB_OUTPUT": str(tmp_path / "output"), "GITHUB_STEP_SUMMARY": str(tmp_path / "step.md"),
        "SCENARIOS": "*.toml", "ARGUMENTS": "--jobs 1",
    }  # fmt: skip
    done = subprocess.run(
        [str(ROOT / ".ci" / "check")], cwd=tmp_path, env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == code, done.stderr
    assert (tmp_path / "output").read_text(encoding="utf-8") == f"junit={tmp_path}/biped.xml\n"
    assert (tmp_path / "biped.xml").exists() == (code < 2)
    if code < 2:
        assert r"| mine | peak\_torque |" in (tmp_path / "step.md").read_text(encoding="utf-8")


def test_what_it_names_is_there():
    text = (ROOT / "action.yml").read_text(encoding="utf-8")
    for path in re.findall(r"\$GITHUB_ACTION_PATH/([\w./-]+)", text):
        assert (ROOT / path).exists(), path
    release = (ROOT / ".github" / "workflows" / "release.yml").read_text(encoding="utf-8")
    for line in re.findall(r"fresh/bin/biped (.+)$", release, re.MULTILINE):
        parsed(line.replace('"$GITHUB_STEP_SUMMARY"', "summary").split())


def test_no_page_names_a_package_index_that_does_not_have_biped():
    for page in [ROOT / "README.md", *(ROOT / "docs").rglob("*.md")]:
        for line in page.read_text(encoding="utf-8").splitlines():
            assert not re.search(r"pip install ['\"]?biped(\[|\b)(?!-)", line), f"{page.name}: {line}"
