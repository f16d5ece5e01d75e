"""Carries out a lie or an honest run, and says in a word what the verdict on it is."""

from __future__ import annotations

import tempfile
from functools import cache
from pathlib import Path
from unittest import mock

from biped.base.errors import InputError
from biped.base.trust import grant
from biped.ensemble.campaign import run_one
from biped.measure.verdict import HELD_WORDS
from biped.robot import recognise
from biped.robot.planar import check
from biped.studies.planned import plan_of
from tests.lies.dishonest import dishonest
from tests.lies.helped import helped_model, helping_law
from tests.lies.honest import honest

KINDS = ("part", "part, unnamed", "law", "dishonest", "honest")
"""Helped by a part of the model file; likewise with the model check silenced, which leaves the sentinel; helped by a
force in a law; dishonest; honest."""
LIES = ("walked", "stood", "sat")
FALSE = {kind: LIES for kind in KINDS[:4]} | {"honest": ("alarm",)}
"""What must not become of each kind."""
STANDING = ("walker2d", "human", "h1", "human3d")
"""Robots that stand by the law that is for any."""
_SHORT = ["duration=1.2", "window.start=0.1", "window.end=1.2", "randomise.runs=1", "randomise.draw={}"]


@cache
def _folder() -> Path:
    return Path(tempfile.mkdtemp(prefix="biped-lies-"))


def judged(kind: str, number: int) -> tuple[str, str]:
    """Group and verdict of one of a kind: `walked`, `stood`, `sat`, `fell`, `stayed up`, `refused`, `held` (something
    else holds or drives it), `doubtful` or `diverged` for another reason, or of honest ones `sound` or `alarm`."""
    if kind == "law":
        return _of_law(number)
    if kind.startswith("part"):
        return _of_part(number, named=kind == "part")
    name, changes, group = (dishonest if kind == "dishonest" else honest)(number)
    return group, _ended(name, changes, alarms=kind == "honest")


def _of_law(number: int) -> tuple[str, str]:
    text, what = helping_law(number)
    path = _folder() / f"law{number}.py"
    path.write_text(text, encoding="utf-8")
    grant(path)
    model = STANDING[number % len(STANDING)]
    found = _ended(_stands(model, model), [f"law={path}:Law", *_SHORT])
    path.unlink()
    return what.split()[0], found


def _of_part(number: int, named: bool) -> tuple[str, str]:
    """A part for the thesis's law on seven links, or for the law that stands on any robot."""
    seven = number % 2 == 0
    model = "human" if seven else STANDING[number // 2 % len(STANDING)]
    text, what = helped_model(number, model)
    path = _folder() / f"part{number}.xml"
    path.write_text(text, encoding="utf-8")
    if seven:
        name, changes = "level_normal", [f"model={path}", "duration=2.5", "window.start=0.5", "window.end=2.5"]
    else:
        name, changes = _stands(model, str(path)), _SHORT
    if named:
        found = _ended(name, changes)
    else:
        with mock.patch.object(check, "holds", _silent), mock.patch.object(recognise, "holds", _silent):
            found = _ended(name, changes)
    path.unlink()
    return what.split()[0], found


def _silent(*_: object) -> list[str]:
    return []


def _stands(robot: str, model: str) -> str:
    """A scenario in which a robot stands through a small push."""
    path = _folder() / f"{robot}-{Path(model).stem}.toml"
    size = 2 if robot in ("human", "walker2d") else 3
    start = 'start = "single"\n' if robot == "human" else ""
    path.write_text(f'model = "{model}"\nlaw = "stand"\n[robot]\n{start}[[push]]\nat = 0.3\nduration = 0.1\n'
                    f"force = {[20.0, 5.0, 0.0][:size]}\n", encoding="utf-8")  # fmt: skip
    return str(path)


def _ended(name: str, changes: list[str], alarms: bool = False) -> str:
    """What the verdict on a run is, in a word."""
    try:
        _, row = run_one(plan_of(name, changes), 0)
    except InputError:
        return "refused"
    if row.verdict == "doubtful":
        return "alarm" if alarms else "held" if HELD_WORDS in row.doubt else "doubtful"
    if row.verdict == "diverged" or row.diverged:
        return "diverged"
    if alarms:
        return "sound"
    for word, is_so in (("walked", row.walked), ("stood", row.stood), ("sat", row.sat), ("fell", row.fell)):
        if is_so:
            return word
    return "stayed up"
