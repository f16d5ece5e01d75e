"""Workflows: commands can be typed; of the one that users copy the scenario is there and metrics are metrics."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

from biped.base.files import locate
from biped.cli.main import parsed
from biped.scenario.metrics import METRICS

FOLDER = Path(__file__).parents[1] / ".github" / "workflows"
TEXT = (FOLDER / "biped.yml").read_text(encoding="utf-8")
SET = dict(re.findall(r"^  ([A-Z]+): (.+)$", TEXT, re.MULTILINE))


def test_what_it_names_is_there():
    locate("scenarios", SET["SCENARIO"], "workflow")
    assert set(SET["METRICS"].split(",")) <= set(METRICS)


def test_its_commands_can_be_typed():
    lines = re.findall(r"\.venv/bin/biped (.+?)(?: \|\| .*)?$", TEXT, re.MULTILINE)
    assert len(lines) >= 5
    for line in lines:
        words = shlex.split(re.sub(r'"?\$(\w+)"?', lambda found: SET.get(found[1], "0"), line))
        parsed(words)
    assert {line.split()[0] for line in lines} >= {"check", "run", "diff"}


def test_commands_of_the_job_with_drake_can_be_typed():
    lines = re.findall(r"\.venv/bin/biped (.+)$", (FOLDER / "drake.yml").read_text(encoding="utf-8"), re.MULTILINE)
    assert {line.split()[0] for line in lines} == {"check", "regress"}
    for line in lines:
        parsed(shlex.split(line.replace("$GITHUB_STEP_SUMMARY", "0")))
