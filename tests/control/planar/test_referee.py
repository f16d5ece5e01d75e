"""What Pinocchio said of a model is remembered only as long as it would say so again."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from biped.base import kernels
from biped.control.planar import controller
from biped.studies.run import plan_of
from tests.ticks import HUMAN

RUN = plan_of("level_normal", ()).run(0)


@pytest.fixture
def asked(tmp_path, monkeypatch):
    """How often Pinocchio is asked, with nothing remembered."""
    monkeypatch.setattr(kernels, "cache_folder", lambda: tmp_path)
    times, ask = [], controller._refereed
    monkeypatch.setattr(controller, "_refereed", lambda *question: times.append(question) or ask(*question))
    controller._agrees.cache_clear()
    yield times
    controller._agrees.cache_clear()


def forgets():
    controller._agrees.cache_clear()  # as another process does


def test_what_agrees_is_asked_once(asked):
    for _ in range(3):
        assert controller.agrees(RUN, RUN.tree)
        forgets()
    assert len(asked) == 1


def test_what_does_not_agree_is_not_remembered(asked):
    tree = RUN.tree
    wrong = tree._replace(mass=tree.mass * (1.0 + 1e-9))
    for _ in range(2):
        assert not controller.agrees(RUN, wrong)
        forgets()
    assert len(asked) == 2


def test_another_file_or_another_tree_is_another_question(asked, tmp_path):
    tree = RUN.tree
    assert controller.agrees(RUN, tree)
    copy = tmp_path / "copy.xml"
    copy.write_text(HUMAN.read_text(encoding="utf-8"), encoding="utf-8")
    copy.with_suffix(".toml").write_text(HUMAN.with_suffix(".toml").read_text(encoding="utf-8"), encoding="utf-8")
    copied = replace(RUN, model=copy)
    assert controller.agrees(copied, tree), "the same bytes: remembered"
    assert len(asked) == 1
    heavier = copy.read_text(encoding="utf-8").replace('mass="50.85"', 'mass="50.86"')
    copy.write_text(heavier, encoding="utf-8")
    forgets()
    assert not controller.agrees(copied, tree), "the same tree, but no longer the file's"
    assert len(asked) == 2
    assert not controller.agrees(RUN, tree._replace(com=tree.com + np.array([0.0, 1e-6])))
    assert len(asked) == 3


def test_where_nothing_can_be_written_it_is_asked_again(asked, tmp_path):
    (tmp_path / "agreed").write_text("no folder", encoding="utf-8")
    for _ in range(2):
        assert controller.agrees(RUN, RUN.tree)
        forgets()
    assert len(asked) == 2
