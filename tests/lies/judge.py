"""Carries out a lie or an honest run, and says in a word what the verdict on it is."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from contextlib import nullcontext
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple
from unittest import mock

import numpy as np

from biped.base.errors import InputError
from biped.base.trust import grant
from biped.engines.untouched import Untouched
from biped.ensemble.campaign import run_one
from biped.ensemble.rows import Row
from biped.measure.momentum import unexplained
from biped.measure.trajectory import Trajectory
from biped.measure.verdict import HELD_WORDS
from biped.robot import recognise
from biped.robot.planar import model
from biped.studies.run import plan_of
from tests.lies.dishonest import dishonest
from tests.lies.helped import helped_model, helping_law
from tests.lies.honest import honest, of_policy, shipped

HONEST = ("honest", "shipped", "policy")
KINDS = ("part", "part, unnamed", "law", "dishonest", *HONEST)
"""Helped by a part of the model file; likewise with the model check silenced, which leaves the sentinel; helped by a
force in a law; dishonest; honest: drawn, of the shipped scenarios, of policies."""
LIES = ("walked", "stood", "sat")
FALSE = {kind: ("alarm",) if kind in HONEST else LIES for kind in KINDS}
"""What must not become of each kind."""
STANDING = ("walker2d", "human", "h1")
"""Robots that stand by the law that is for any."""
IDLE = 0.01
"""Of a leg's length: a robot that walks or stands by itself, and whose centre of mass is never further than that from
where it is without the help, was not helped."""
MEASURES = ("tilt", "com_height", "foot_support", "slip", "pull", "sinking", "energy_residual")
_SHORT = ["duration=1.2", "window.start=0.1", "window.end=1.2", "randomise.runs=1", "randomise.draw={}"]


class Judged(NamedTuple):
    """What became of one of a kind.

    Attributes:
        group: What kind of help, of lie, or of honest run it is.
        found: `walked`, `stood`, `sat`, `fell`, `stayed up`, `refused`, `idle` (help that changes nothing), `held`
            (something else holds or drives it), `doubtful` or `diverged` for another reason; `alarm` of an honest run
            whose numbers are not sound.
        numbers: Of an honest run: what nothing explains, over 0.2 s and 2 s, and what its feet and trunk did.
    """

    group: str
    found: str
    numbers: dict[str, Any]


@cache
def _folder() -> Path:
    return Path(tempfile.mkdtemp(prefix="biped-lies-"))


def judged(kind: str, number: int, policies: tuple[str, ...] = ()) -> Judged:
    """The verdict on one of a kind, by its number; policies are scenarios by path."""
    if kind == "law":
        return _of_law(number)
    if kind.startswith("part"):
        return _of_part(number, named=kind == "part")
    if kind == "dishonest":
        name, changes, group = dishonest(number)
        return Judged(group, _found(name, changes)[0], {})
    drawn = of_policy(number, policies) if kind == "policy" else {"honest": honest, "shipped": shipped}[kind](number)
    name, changes, group, index = drawn
    found, t, row = _found(name, changes, index)
    if t is None or row is None:
        return Judged(group, found, {})
    return Judged(group, found if row.verdict == "sound" else "alarm", _numbers(t, row))


def _numbers(t: Trajectory, row: Row) -> dict[str, Any]:
    left = unexplained(t)
    out: dict[str, Any] = {"sampled": t.sampled}
    for name, means in left._asdict().items():
        out |= {f"{name} {word}": mean.share for word, mean in zip(("short", "long"), means, strict=True)}
    return out | {name: float(getattr(row, name)) for name in MEASURES}


def _of_law(number: int) -> Judged:
    text, what = helping_law(number)
    return Judged(what, helped_by(STANDING[number % len(STANDING)], text), {})


def helped_by(robot: str, text: str, watched: bool = False, changes: Sequence[str] = ()) -> str:
    """The verdict on a robot that stands through a small push by a law of this text, in a word.

    Args:
        robot: Its name.
        text: The law's.
        watched: Whether what the law does to the simulator is watched: otherwise the sentinel of momentum is alone.
        changes: Of the scenario.
    """
    path, scenario = _folder() / "law.py", _stands(robot, robot)
    path.write_text(text, encoding="utf-8")
    grant(path)
    short = [*_SHORT, *changes]
    with nullcontext() if watched else mock.patch.object(Untouched, "found", return_value={}):
        found, t, _ = _found(scenario, [f"law={path}:Law", *short])
    return _idle(found, t, scenario, short)


def _of_part(number: int, named: bool) -> Judged:
    """A part for the thesis's law on seven links, or for the law that stands on any robot."""
    seven = number % 2 == 0
    model = "human" if seven else STANDING[number // 2 % len(STANDING)]
    text, what = helped_model(number, model)
    path = _folder() / f"part{number}.xml"
    path.write_text(text, encoding="utf-8")
    if seven:
        name, plain, changes = "level_normal", "level_normal", ["duration=3.0", "window.start=1.0", "window.end=3.0"]
        found, t = _silently(name, [f"model={path}", *changes], named)
    else:
        name, plain, changes = _stands(model, str(path)), _stands(model, model), _SHORT
        found, t = _silently(name, changes, named)
        Path(name).unlink()
    path.unlink()
    return Judged(what, _idle(found, t, plain, changes), {})


def _silently(name: str, changes: list[str], named: bool) -> tuple[str, Trajectory | None]:
    """The verdict on a run, with the model check silenced unless parts are to be named."""
    if named:
        return _found(name, changes)[:2]
    with mock.patch.object(model, "holds", _silent), mock.patch.object(recognise, "holds", _silent):
        return _found(name, changes)[:2]


def _silent(*_: object) -> list[str]:
    return []


def _idle(found: str, t: Trajectory | None, name: str, changes: list[str]) -> str:
    """`idle` where a robot does by itself what it does with its help, and moves alike."""
    if found not in LIES or t is None:
        return found
    alone, plain, _ = _found(name, changes)
    if alone != found or plain is None:
        return found
    return "idle" if np.abs(t.com - plain.com).max() < IDLE * t.robot.leg else found


def _stands(robot: str, model: str) -> str:
    """A scenario in which a robot stands through a small push."""
    path = _folder() / f"{robot}-{Path(model).stem}.toml"
    size = 2 if robot in ("human", "walker2d") else 3
    start = 'start = "heel_toe"\n' if robot == "human" else ""
    path.write_text(f'model = "{model}"\nlaw = "stand"\n[robot]\n{start}[[push]]\nat = 0.3\nduration = 0.1\n'
                    f"force = {[20.0, 5.0, 0.0][:size]}\n", encoding="utf-8")  # fmt: skip
    return str(path)


def _found(name: str, changes: list[str], index: int = 0) -> tuple[str, Trajectory | None, Row | None]:
    """What the verdict on a run is, in a word, and the run; none where it is refused."""
    try:
        t, row = run_one(plan_of(name, changes), index)
    except InputError:
        return "refused", None, None
    return _word(row), t, row


def _word(row: Row) -> str:
    if row.verdict == "doubtful":
        return "held" if HELD_WORDS in row.doubt else "doubtful"
    if row.verdict == "diverged" or row.diverged:
        return "diverged"
    for word, is_so in (("walked", row.walked), ("stood", row.stood), ("sat", row.sat), ("fell", row.fell)):
        if is_so:
            return word
    return "stayed up"
