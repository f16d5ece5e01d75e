"""A million rows: they are finished, reported and drawn in little memory."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest

from biped.ensemble.campaign import run_one
from biped.ensemble.chunks import Chunks
from biped.ensemble.parts import FOLDER, Chunk, FinishedChunk, commit_to, encoded
from biped.ensemble.rows import schema_of, table
from biped.scenario.reading import to_toml
from biped.studies.run import plan_of
from tests.cases import ENSEMBLE, write

RUNS, PER_FILE, DIFFERENT = 1_000_000, 4_000, 100
MOST = 450
"""[MB] of memory."""


def synthetic(folder: Path) -> None:
    """A campaign of a thousand points whose rows are those of a hundred runs, with numbers drawn anew."""
    slopes, pushes = np.linspace(-5.0, 5.0, 20).tolist(), np.linspace(-250.0, 250.0, 50).tolist()
    plan = plan_of("e.toml", [
        "push=[{at=0.05,duration=0.1,force=[10.0,0.0]}]", "randomise.runs=1000",
        f'sweep={{"ground.slope"={slopes},"push.0.force.0"={pushes}}}',
    ])  # fmt: skip
    assert len(plan) == RUNS
    rows = table([run_one(plan, i)[1] for i in range(DIFFERENT)], schema_of(plan.scenario))
    rows = rows.take(pa.array(np.arange(PER_FILE) % DIFFERENT))
    (folder / FOLDER).mkdir(parents=True)
    (folder / "scenario.toml").write_text(to_toml(plan.scenario))
    about, rng = Chunks(plan).about(), np.random.default_rng(0)
    for first in range(0, RUNS, PER_FILE):
        walked = rng.random(PER_FILE) < 0.7
        drawn = {
            "index": np.arange(first, first + PER_FILE), "walked": walked, "fell": ~walked,
            "end": np.where(walked, "completed", "fell"), "cause": np.where(walked, "", "fell forward at 0.123 s"),
            "diverged": np.zeros(PER_FILE, bool), "doubtful": np.zeros(PER_FILE, bool),
        }  # fmt: skip
        columns = [
            pa.array(drawn[field.name]) if field.name in drawn
            else pa.array(rng.normal(size=PER_FILE) ** 2 + 0.1)
            if pa.types.is_floating(field.type) and not field.name.startswith("values")
            else rows[field.name].combine_chunks()
            for field in rows.schema
        ]  # fmt: skip
        data = encoded(pa.Table.from_arrays(columns, schema=rows.schema), about)
        commit_to(folder / FOLDER, FinishedChunk(Chunk(first, PER_FILE), data, 0.0, "", ""))


WATCH = """
import json, os, sys, time
began = time.perf_counter()
pid = os.posix_spawn(sys.executable, [sys.executable, "-m", "biped", *sys.argv[1:]], os.environ)
_, status, used = os.wait4(pid, 0)
clock = time.perf_counter() - began
print(json.dumps([os.waitstatus_to_exitcode(status), used.ru_maxrss / 1024, used.ru_utime + used.ru_stime, clock]))
"""
"""A command's parent that is small: a process is charged with what the one that started it held."""


def memory(*argv: str) -> tuple[float, float, float]:
    """Most memory [MB], CPU [s] and clock time [s] of a command, which must end well, or say that checks failed."""
    done = subprocess.run([sys.executable, "-c", WATCH, *argv], capture_output=True, text=True, check=True)
    code, *used = json.loads(done.stdout.splitlines()[-1])
    assert code in (0, 1), done.stderr
    return tuple(used)


@pytest.mark.slow
def test_a_million_rows_in_little_memory(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write("e.toml", ENSEMBLE)
    synthetic(Path("x"))
    for argv in (["run", "x/scenario.toml", "--out", "x", "--jobs", "1"], ["report", "x"],
                 ["report", "x", "--html", "page.html"], ["plot", "x"]):  # fmt: skip
        most, seconds, clock = memory(*argv)
        print(*argv, round(most), "MB,", round(seconds, 1), "s of CPU,", round(clock, 1), "s by the clock")
        assert most < MOST, argv
    assert len(list(Path("x", FOLDER).glob("*.parquet"))) < 10
    result = json.loads(Path("x/result.json").read_text())
    assert result["summary"]["runs"] == RUNS
    assert result["summary"]["walked"] == pytest.approx(0.7 * RUNS, rel=0.01)
    assert len(result["points"]) == 1000
    assert "1000000" in Path("report.md").read_text().replace(",", "").replace(" ", "")
