"""The one list of metrics: what is measured, expected, shown and documented is the same."""

from __future__ import annotations

import math
import subprocess
import sys
from itertools import pairwise
from pathlib import Path

import pytest

from biped.scenario.metrics import HEAD, METRICS, as_markdown, metrics_of_table
from biped.studies.regress import references


def test_docs_have_the_list_as_it_is():
    text = Path("docs/results.md").read_text(encoding="utf-8")
    assert text.endswith(as_markdown() + "\n"), (
        "docs/results.md: its last table is biped.scenario.metrics.as_markdown()"
    )


def test_the_list_needs_no_numpy():
    code = "import sys, biped.scenario.metrics; sys.exit('numpy' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_every_table_is_part_of_the_next():
    names = [[metric.name for metric in metrics_of_table(table)] for table in ("head", "run", "engines", "file")]
    assert names[0] == list(HEAD) == ["speed", "cost_of_transport", "double_support"]
    for smaller, larger in pairwise(names):
        assert set(smaller) < set(larger)
    assert names[-1] == list(METRICS)
    assert references.METRICS == HEAD
    assert set(HEAD) <= set(references.RecordedScenario.__struct_fields__)


@pytest.mark.parametrize(
    ("name", "value", "text"),
    [
        ("speed", 0.70612, "0.706"), ("double_support", 0.1561, "15.6 %"), ("energy_residual", 0.000434, "0.0434 %"),
        ("walked", 12, "12"), ("steps", 4.5, "4.5"), ("cost_of_transport", math.nan, "–"), ("slip", None, "–"),
    ],
)  # fmt: skip
def test_a_number_is_shown_one_way(name, value, text):
    assert METRICS[name].text(value) == text
