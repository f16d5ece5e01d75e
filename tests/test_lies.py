"""No lie walks, stands or sits, and no honest run raises an alarm; `python -m tests.lies` judges thousands."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

from biped.ensemble.campaign import run_one
from biped.studies.run import plan_of
from tests.lies import inside
from tests.lies.judge import _SHORT, FALSE, KINDS, _found, _idle, _stands, helped_by, judged
from tests.lies.power import KINDS_OF_HELP, law_of

DRAWN = KINDS[:5]


def outcomes(kind: str, count: int) -> Counter[str]:
    found = {number: judged(kind, number) for number in range(count)}
    wrong = {number: one for number, one in found.items() if one.found in FALSE[kind]}
    assert not wrong
    return Counter(one.found for one in found.values())


def test_parts_that_hold_a_robot_are_refused():
    """An obstacle that nothing of the robot can touch is none, and a body that nothing can touch is left out."""
    found = [judged("part", number) for number in range(60)]
    assert {one.group for one in found if one.found != "refused"} <= {"obstacles", "bodies that move"}
    assert not [one for one in found if one.found in FALSE["part"]]
    assert sum(one.found == "refused" for one in found) >= 50


LISTED = {
    "slides on one foot": ("robust/own", "ground.slope=-4.97", "ground.friction=0.02"),
    "slides at 16 m/s": ("calm/own", "ground.slope=-43.3", "ground.friction=0.02", "fall.height=0.01"),
    "feet below the ground": ("upright/own", "ground.contact_time=0.1"),
    "thrown, and down on its knees": (
        "level_slow_generalized",
        "start.v=[2.66,0,-7.4,0,0,0,0,0,0]",
        "ground.slope=-6.82",
        "fall.height=0.01",
        "fall.tilt=180.0",
        "duration=2.251",
        "window.start=0.0",
        "window.end=2.251",
    ),
    "a moment": ("level_slow_generalized", "window.start=2.0", "window.end=2.1"),
}


@pytest.mark.parametrize("lie", LISTED)
def test_lies_that_once_walked_or_stood(lie):
    name, *changes = LISTED[lie]
    _, row = run_one(plan_of(name, ["duration=6.0", "sweep={}", "randomise.runs=1", *changes]), 0)
    assert not any((row.walked, row.stood, row.sat)), row


def test_help_is_idle_where_the_robot_moves_as_it_would_without():
    name = _stands("walker2d", "walker2d")
    found, t, _ = _found(name, _SHORT)
    assert t is not None
    assert _idle(found, t, name, _SHORT) == "idle"
    moved = replace(t, log=t.log.copy())
    moved.column("com")[:, 0] += np.linspace(0.0, 0.02, len(t))
    assert _idle("stood", moved, name, _SHORT) == "stood"


def test_no_strength_is_idle_and_all_of_it_is_caught():
    """Of forces and moments: brakes of what does not move are idle at any strength."""
    assert len(KINDS_OF_HELP) >= 200
    some = [one for one in KINDS_OF_HELP if one.group.startswith(("force", "moment"))]
    for helped in some[::31]:
        assert helped_by(helped.robot, law_of(helped, 0.0)) == "idle", helped
        assert helped_by(helped.robot, law_of(helped, 1.0)) in ("held", "diverged", "doubtful"), helped


@pytest.mark.parametrize("robot", ["walker2d", pytest.param("h1", marks=pytest.mark.slow)])
@pytest.mark.parametrize("line", inside.LAWS)
def test_a_law_that_changes_the_simulator_is_noticed(line, robot):
    """Inside the robot and the ground too, where momentum shows nothing."""
    assert helped_by(robot, inside.law_with(line), watched=True) in ("held", "diverged", "doubtful")


def test_a_law_that_changes_nothing_is_not_doubted():
    honest = inside.law_with("time").replace(inside.LAWS["time"], "columns.append(data.qvel[0] + model.nv)")
    assert helped_by("walker2d", honest, watched=True) == "idle"


@pytest.mark.parametrize("part", inside.PARTS)
def test_parts_written_down_one_by_one_do_not_stand(part, tmp_path):
    (tmp_path / "lie.xml").write_text(inside.model_with(part, "walker2d"), encoding="utf-8")
    found, t, _ = _found(_stands("walker2d", str(tmp_path / "lie.xml")), _SHORT)
    assert _idle(found, t, _stands("walker2d", "walker2d"), _SHORT) in ("refused", "held", "diverged")


@pytest.mark.parametrize("kind", DRAWN[1:])
def test_a_few_of_each_kind(kind):
    assert outcomes(kind, 6).total() == 6


@pytest.mark.slow
def test_honest_runs_that_once_were_doubted():
    assert judged("honest", 166).found == "sat"
    _, row = run_one(plan_of("any/cells/damping", []), 5)
    assert (row.verdict, row.end) == ("sound", "fell")


@pytest.mark.slow
@pytest.mark.parametrize("kind", DRAWN)
def test_a_hundred_of_each_kind(kind):
    found = outcomes(kind, 100)
    if kind in ("law", "part, unnamed"):  # the rest is refused or has nothing to do
        assert found["held"] >= 20, found
        assert found["held"] + found["diverged"] >= 50, found
