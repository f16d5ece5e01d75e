"""Trajectories of failures take a tenth of the room and lose nothing that can be seen; hostile files are refused."""

from __future__ import annotations

import dataclasses
import json
import lzma

import numpy as np
import pytest

from biped.base.errors import InputError
from biped.engines.planar.mujoco import simulate
from biped.ensemble import failures
from biped.ensemble.plan import Plan
from biped.robot.columns import COLUMNS
from biped.scenario.reading import read_scenario


@pytest.fixture(scope="module")
def walk():
    changes = ["duration=3.0", "window.start=1.0", "window.end=3.0", "push=[{at=0.4,duration=0.2,force=[-80.0,0.0]}]"]
    return simulate(Plan(read_scenario("level_normal", changes)).run(0))


def test_three_seconds_are_small_and_every_tick_is_there(walk, tmp_path):
    failures.save_packed(walk.last(3.0), tmp_path / "w.xz")
    assert (tmp_path / "w.xz").stat().st_size < 200_000
    again = failures.load_packed(tmp_path / "w.xz")
    assert len(again) == len(walk)
    np.testing.assert_array_equal(again.time, walk.time)
    for name in COLUMNS:
        away = np.abs(again.column(name) - walk.column(name)).max()
        assert away <= 0.501 * failures.RESOLUTION.get(name, 0.0), name
    for field in dataclasses.fields(walk):
        if field.name not in ("log", "tree"):
            assert getattr(again, field.name) == getattr(walk, field.name)
    assert all((a == b).all() for a, b in zip(again.tree, walk.tree, strict=True))


def test_the_same_run_gives_the_same_bytes(walk, tmp_path):
    for name in "ab":
        failures.save_packed(walk, tmp_path / name)
    assert (tmp_path / "a").read_bytes() == (tmp_path / "b").read_bytes()


def test_the_end_of_a_run_keeps_its_times(walk, tmp_path):
    failures.save_packed(walk.last(0.5), tmp_path / "w.xz")
    again = failures.load_packed(tmp_path / "w.xz")
    np.testing.assert_array_equal(again.time, walk.time[-500:])


def test_numbers_that_blew_up_come_back_as_such(walk, tmp_path):
    log = walk.log[:20].copy()
    log[-1, 1:12] = np.nan
    log[-2, 3], log[-3, 4] = np.inf, 1e12
    failures.save_packed(dataclasses.replace(walk, log=log, end="diverged"), tmp_path / "w.xz")
    again = failures.load_packed(tmp_path / "w.xz").log
    assert np.isnan(again[-1, 1:12]).all()
    assert np.isnan(again[-2, 3])
    assert again[-3, 4] == pytest.approx(1e12)
    assert np.isfinite(again[:-3]).all()


def stream(about, body=b""):
    return lzma.compress(json.dumps(about).encode() + b"\n" + body)


@pytest.mark.parametrize("kind", ["text", "no head", "rows", "bomb", "short", "long", "cut", "tick", "robot"])
def test_what_means_harm_is_refused(kind, walk, tmp_path):
    failures.save_packed(walk.last(0.1), tmp_path / "w.xz")
    whole = (tmp_path / "w.xz").read_bytes()
    head, _, body = lzma.decompress(whole).partition(b"\n")
    about = json.loads(head)
    bad = {
        "text": b"text",
        "no head": lzma.compress(b"x" * 10_000_000),
        "rows": stream(about | {"rows": 10**9}),
        "bomb": stream(about, b"\0" * 200_000_000) if kind == "bomb" else b"",
        "short": stream(about, body[:-8]),
        "long": stream(about, body + b"\0"),
        "cut": whole[:-200],
        "tick": stream(about | {"tick": 0.0}, body),
        "robot": stream(about | {"robot": {"base": 3}}, body),
    }
    (tmp_path / "w.xz").write_bytes(bad[kind])
    with pytest.raises(InputError, match=r"w.xz: not a trajectory: .*; remove it"):
        failures.load_packed(tmp_path / "w.xz")
