"""Campaigns on a Dask cluster, whose scheduler and workers are processes of their own, are those of processes here."""

from __future__ import annotations

import pickle
from pathlib import Path

import cloudpickle
import pytest

import biped
from biped.base.errors import InputError
from biped.base.writing import dumps
from biped.ensemble.chunks import Chunks
from biped.ensemble.executor import workers
from biped.ensemble.failures import SUFFIX
from biped.ensemble.plan import Plan
from biped.scenario.reading import read_scenario
from biped.studies.comparison import compare
from biped.studies.regress.references import ensemble, measured
from biped.studies.run import run
from biped.studies.stability import study
from biped.studies.tune import tune
from biped.studies.tune.evaluate import Study, Task
from biped.studies.tune.search_space import SearchSpace
from tests.cases import contents, write

pytestmark = [
    pytest.mark.filterwarnings("ignore::ResourceWarning", "ignore::DeprecationWarning"),
    pytest.mark.usefixtures("folder"),
]


def test_a_campaign_on_a_cluster_is_the_same_bytes(cluster):
    run("e.toml", (), 1, Path("here"))
    done = run("e.toml", (), cluster, Path("there"))
    assert done.result["summary"]["runs"] == 6
    here, there = contents("here"), contents("there")
    for name in ("result.json", "runs.parquet", "scenario.toml"):
        assert here[name] == there[name]
    kept = {name for name in there if name.endswith(SUFFIX)}
    assert len(kept) == 3, "failures.keep"
    assert all(there[name] == here[name] for name in kept)


def test_the_same_executor_carries_everything(cluster):
    """Functions with what they refer to, and errors with their key."""
    factor = 3

    def times(x: int) -> int:
        if x == 7:
            raise InputError("law: what it was", "law")
        return factor * x

    with workers(times, cluster) as carried_out:
        assert list(carried_out(range(5))) == [0, 3, 6, 9, 12]
        with pytest.raises(InputError, match="what it was") as caught:
            list(carried_out(range(9)))
    assert caught.value.key == "law"


def test_work_is_made_anew_where_it_comes_to():
    plan = ensemble(Plan(read_scenario("e.toml")))
    again = pickle.loads(pickle.dumps(plan))
    assert again.scenario == plan.scenario
    study = Study(read_scenario("tune/efficient"))
    name, space = next(iter(study.tune.conditions)), SearchSpace(study.scenario, study.gains)
    task = Task(name, 0, 1, False, space.candidate([0.0] * len(space.axes)))
    there = cloudpickle.loads(cloudpickle.dumps(study.outcome))
    assert there.__self__.tune == study.tune
    assert pickle.loads(pickle.dumps(task)) == task
    assert len(cloudpickle.dumps(Chunks(plan))) < 10_000, "text and a digest"


def test_regression_on_a_cluster_is_the_same(cluster):
    plan = ensemble(Plan(read_scenario("e.toml")))
    here, there = (measured(plan, jobs, "2000-01-01", "here", lambda: None) for jobs in (1, cluster))
    assert here == there


SEARCH = """duration = 0.6
seed = 3
start = { posture = "heel_toe", jitter = 0.002 }
window.start = 0.3
[tune]
gains = ["k_d1", "theta_b"]
generations = 2
population = 4
recheck = 1
checks = 1
unseen = 1
finalists = 1
[tune.conditions.level]
runs = 1
"""


def test_a_search_on_a_cluster_is_the_same(cluster):
    write("search.toml", SEARCH)
    here, there = (tune("search.toml", (), jobs, Path(name)) for name, jobs in (("here", 1), ("there", cluster)))
    assert here.found == there.found
    assert here.gait.read_text() == there.gait.read_text()


def test_both_engines_on_a_cluster_are_the_same(cluster):
    here, there = (compare("e.toml", "e", (), jobs).as_dict() for jobs in (1, cluster))
    assert dumps(here) == dumps(there)


class Idle:
    """A law that does nothing."""

    def __init__(self, setup):
        pass

    def torques(self, sensed):
        return [0.0] * 6


@pytest.mark.slow
def test_from_python_with_a_law_that_is_an_object():
    here, there = (biped.run("e.toml", law=Idle, **who).runs for who in ({"jobs": 1}, {"cluster": "local:2"}))
    assert dumps(here.to_pylist()) == dumps(there.to_pylist())


@pytest.mark.slow
def test_stability_on_a_cluster_is_the_same(cluster):
    here, there = (study("level_slow_generalized", [], ("mujoco",), jobs) for jobs in (2, cluster))
    assert dumps(here.as_dict()) == dumps(there.as_dict())
