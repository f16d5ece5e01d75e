"""Runs to record, and what is in the file afterwards."""

import subprocess
import sys

import numpy as np
from rerun.chunk import RrdReader

from biped.engines.planar.mujoco import simulate
from biped.ensemble.plan import Plan
from biped.robot.planar.build import compile_foreign
from biped.scenario.reading import read_scenario, to_toml
from biped.show.recording import Recorded

SLOPE, FORWARD, UP = 5.0, 120.0, 30.0
CHANGES = [
    "duration=1.2", "window.start=0.6", "window.end=1.2", f"ground.slope={SLOPE}",
    f"push=[{{at=0.4,duration=0.2,force=[{FORWARD},{UP}]}}]",
]  # fmt: skip


def recorded(name, changes, **more):
    scenario = read_scenario("level_normal", changes)
    plan = Plan(scenario)
    model = compile_foreign(plan.model, scenario, visuals=True).model
    text = to_toml(plan.scenario)
    return Recorded(name, simulate(plan.run(0)), model, more.get("metrics", {}), more.get("checks", []), text)


def rerun(*arguments):
    command = [sys.executable, "-m", "rerun", "rrd", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, check=False)


def read(path, entity):
    """Columns of an entity by component: temporal ones as (times [ns], lists), static ones as lists."""
    temporal, static = {}, {}
    for chunk in RrdReader(str(path)).stream().filter(content=entity).to_chunks():
        batch = chunk.to_record_batch()
        for name in batch.schema.names:
            values = batch.column(name)
            if ":" not in name:
                continue
            if chunk.is_static:
                static[name] = values.to_pylist()[0]
            else:
                temporal[name] = (np.asarray(batch.column("time")).astype("i8"), values.to_pylist())
    return temporal, static


def contents_of(part):
    contents = getattr(part, "contents", None) or []
    return [contents] if isinstance(contents, str) else contents


def named_in(blueprint):
    """Entities that a blueprint names."""
    named = set()

    def visit(part):
        for child in contents_of(part):
            if isinstance(child, str):
                named.add(child)
            else:
                visit(child)
        named.add(str(getattr(part, "origin", "/")))

    visit(blueprint.root_container)
    return named
