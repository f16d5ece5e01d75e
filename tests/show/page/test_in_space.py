"""The page of a robot in space: arms, cameras, keys in words, and a headline that says what runs had to do."""

from __future__ import annotations

import base64
import itertools
import math
from pathlib import Path

import mujoco
import numpy as np
import pytest

from biped.cli.main import main
from biped.ensemble.checks import goal_of
from biped.scenario.reference import unit_of
from biped.show.page.frames import UNIT, Frames, frames_of
from biped.show.page.html import key_words, setting
from biped.show.page.player import VIEWS
from biped.show.results_folder import ResultsFolder
from tests.show.page.browser import MISSING, browser

STANDS = """
model = "h1"
law = "stand"
duration = 1.2
window = { start = 0.2, end = 1.2 }
ground.slope = 2.0
ground.side_slope = 3.0
push = [{ at = 0.6, duration = 0.1, force = [0.0, 20.0, 0.0] }]
randomise.runs = 2
expect.stood = { min = 1 }
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    where = tmp_path_factory.mktemp("h1")
    (where / "s.toml").write_text(STANDS, encoding="utf-8")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(where)
        assert main(["run", "s.toml", "--out", "r", "--jobs", "1"]) == 0
        assert main(["report", "r", "--html", "p.html"]) == 0
    return where


@pytest.fixture(scope="module")
def results(folder) -> ResultsFolder:
    return ResultsFolder(folder / "r")


@pytest.fixture(scope="module")
def frames(results) -> Frames:
    return frames_of(results.trajectory(0), results.model(0))


def test_arms_hang_where_the_model_puts_them(results, frames):
    run, model = results.trajectory(0), results.model(0)
    slope, side = math.tan(math.radians(2.0)), math.tan(math.radians(3.0))
    data = mujoco.MjData(model)
    data.qpos[:] = run.qpos(model)[0]
    mujoco.mj_kinematics(model, data)
    right, left, across = frames.arms
    assert across == (right[0], left[0])
    shown = frames.place[0]
    up = -np.array(run.gravity) / np.linalg.norm(run.gravity)
    for arm, name in ((right, "right_forearm"), (left, "left_forearm")):
        elbow = data.xpos[model.body(name).id]
        drawn = shown[list(arm)] - shown[10]
        height = (elbow - run.figure[0, -1]) @ up  # how high it is over the trunk's end does not ask for the frame
        far = np.linalg.norm(elbow - run.figure[0, -1])
        assert min(abs(point[2] - height) + abs(np.linalg.norm(point) - far) for point in drawn) < 1e-6
        assert np.sign(shown[arm[-1], 1] - shown[10, 1]) == (1.0 if name.startswith("left") else -1.0)
    lengths = [np.linalg.norm(np.diff(frames.place[:, list(right)], axis=1), axis=2)]
    assert np.ptp(lengths, axis=1).max() < 1e-9  # of rigid parts, in every picture
    assert len(frames.place[0]) == 12 + len(right) + len(left)
    # The feet stand on the plane that the floor is drawn as.
    sole = frames.place[:, [3, 4, 8, 9]]
    above = sole[..., 2] - slope * sole[..., 0] - side * sole[..., 1]
    assert np.abs(above).max() < 0.03


def test_the_floor_is_the_plane_that_feet_stand_on(frames):
    points = np.array([point for line in frames.floor() for point in line])
    slope, side = math.tan(math.radians(2.0)), math.tan(math.radians(3.0))
    np.testing.assert_allclose(points[:, 2], slope * points[:, 0] + side * points[:, 1], atol=2e-3)
    assert np.ptp(points[:, 1]) >= 2.0


def test_numbers_of_the_page_are_those_of_the_pictures(frames):
    data = frames.data()
    base = np.frombuffer(base64.b64decode(data["base"]), "<f4").reshape(-1, 1, 3)
    place = np.frombuffer(base64.b64decode(data["place"]), "<i2").reshape(data["n"], data["points"], 3)
    np.testing.assert_allclose(place * UNIT + base, frames.place, atol=UNIT)
    assert data["pushes"] == [[0.6, 0.7, 0.0, 20.0, 0.0]]


def test_the_headline_says_what_runs_had_to_do(folder, results):
    assert goal_of(results.result) == "stood"
    words = (folder / "p.html").read_text(encoding="utf-8")
    assert f"Stood {results.result['summary']['stood']} of 2" in words
    assert "Walked 0" not in words
    assert "right_ankle" not in words


@pytest.mark.skipif(bool(MISSING), reason=MISSING)
def test_three_cameras_show_the_same_robot_from_three_sides(folder, frames):
    """A leg's length as each camera draws it is what is left of it across that camera's line of sight."""
    legs = "return document.querySelector('[data-part=first]').getAttribute('points')"
    with browser() as shown:
        shown.open(folder / "p.html")
        for number, (name, (azimuth, elevation)) in enumerate(VIEWS.items()):
            shown.run("document.querySelectorAll('[data-view]')[arguments[0]].click()", number)
            pressed = "return document.querySelector('[aria-pressed=true]').textContent"
            assert shown.run(pressed) == name
            drawn = np.array([[float(x) for x in point.split(",")] for point in shown.run(legs).split()])
            a, e = math.radians(azimuth), math.radians(elevation)
            sight = np.array([math.sin(a) * math.cos(e), -math.cos(a) * math.cos(e), math.sin(e)])
            for i, j in itertools.pairwise((0, 1, 2)):
                true = frames.place[0, j] - frames.place[0, i]
                left = np.linalg.norm(true - sight * (true @ sight))
                assert np.linalg.norm(drawn[j] - drawn[i]) == pytest.approx(left, abs=3 * UNIT)
        assert shown.complaints() == []


@pytest.mark.parametrize(
    ("key", "space", "words"),
    [
        ("push.0.force.0", False, "push forward [N]"),
        ("push.0.force.1", False, "push up [N]"),
        ("push.0.force.1", True, "push to the left [N]"),
        ("push.1.at", True, "push 2 at [s]"),
        ("ground.side_slope", True, "ground side slope [°]"),
        ("ground.friction", False, "ground friction"),
        ("no.such.key", False, "no such key"),
    ],
)
def test_keys_are_words_with_units(key, space, words):
    assert key_words(key, space) == words


def test_values_of_a_list_are_short():
    assert setting("push.0.force", [1.23456, -3.0, 2.0], True) == "push force (1.235, −3, 2) N"
    assert unit_of("start.q") == ""  # of several units
