"""Clips: what is drawn is what was logged, files are what they are called, and what is missing is said."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import mujoco
import numpy as np
import pytest
from PIL import Image

from biped.base.errors import InputError
from biped.cli.main import main
from biped.show import film
from biped.show.film.stage import walkers
from biped.show.results_folder import run_of
from tests.cases import command, write

try:
    film.platform()
    BLIND = ""
except InputError as error:
    BLIND = str(error)
drawing = pytest.mark.skipif(bool(BLIND), reason=BLIND)

PUSH = "push=[{at=0.3,duration=0.3,force=[200.0,0.0]}]"
SHORT = ["--set", "duration=1.0", "--set", "window.start=0.5", "--set", "window.end=1.0", "--set", PUSH]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    where = tmp_path_factory.mktemp("film")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(where)
        assert main(["run", "level_normal", *SHORT, "--out", "one"]) in (0, 1)
        assert main(["run", "level_normal", *SHORT, "--set", "ground.slope=5", "--out", "two"]) in (0, 1)
    return where


@pytest.fixture
def here(folder, monkeypatch):
    monkeypatch.chdir(folder)


def frames(path):
    with Image.open(path) as clip:
        out = []
        for i in range(clip.n_frames):
            clip.seek(i)
            out.append(np.asarray(clip.convert("RGB"), float))
        return out, clip.info["duration"]


def coloured(frame, red, green, blue):
    return (frame * [red, green, blue]).sum(axis=2) > 60


@drawing
def test_a_clip_shows_the_legs_the_ground_the_forces_and_the_push(here, capsys):
    assert main(["video", "one", "--out", "one.gif", "--width", "320", "--fps", "10", "--eye", "side"]) == 0
    assert "one.gif: 10 frames" in capsys.readouterr().out
    drawn, pause = frames("one.gif")
    assert len(drawn) == 10
    assert pause == 100
    assert drawn[0].shape == (180, 320, 3)
    for frame in drawn:
        assert coloured(frame, -1.0, 0.0, 1.0).sum() > 100  # the right leg is blue
        assert coloured(frame, 1.0, 0.0, -1.0).sum() > 100  # the left one orange
    pushed = [int(coloured(frame, 0.5, -1.0, 0.5).sum()) for frame in drawn]
    assert all(count > 30 for count in pushed[3:6])  # 0.3 to 0.6 s
    assert all(count < 10 for count in (*pushed[:3], *pushed[6:]))
    # 200 N are half a metre of an arrow; of 1.8 m that stand 64 % of the frame is filled, which is 2.8 m high.
    across = np.flatnonzero(coloured(drawn[4], 0.5, -1.0, 0.5).any(axis=0))
    assert np.ptp(across) == pytest.approx(0.5 / 2.8 * 180, rel=0.25)


@drawing
def test_the_ground_is_as_light_at_the_start_as_further_on(here):
    assert main(["run", "level_normal", "--out", "whole"]) == 0
    assert main(["video", "whole", "--out", "whole.gif", "--width", "320", "--fps", "1"]) == 0
    drawn, _ = frames("whole.gif")
    ground = [frame[-12:-2].mean() for frame in drawn]
    assert max(ground) < 230, "white, as what is behind it"
    assert np.ptp(ground) < 10


@drawing
def test_two_runs_side_by_side_or_as_a_ghost_and_a_slope(here):
    for name, more in (("beside", []), ("ghost", ["--ghost"])):
        argv = [
            "video",
            "one",
            "two",
            "--out",
            f"{name}.gif",
            "--width",
            "320",
            "--fps",
            "5",
            "--to",
            "0.4",
            "--eye",
            "side",
            *more,
        ]
        assert main(argv) == 0
    beside, ghost = (frames(f"{name}.gif")[0][0] for name in ("beside", "ghost"))
    assert coloured(beside, -1.0, 0.0, 1.0).sum() > 0
    assert np.abs(beside - ghost).max() > 50
    assert (
        main(["video", "two", "--out", "slope.gif", "--width", "320", "--fps", "5", "--to", "0.2", "--eye", "side"])
        == 0
    )
    level, slope = (frames(f"{name}.gif")[0][0] for name in ("ghost", "slope"))
    # The far edge of the ground rises to the right by about the slope.
    edges = [np.argmax(frame[:, x].sum(axis=1) < 700.0) for frame in (slope,) for x in (250, 310)]
    assert edges[1] < edges[0]
    assert level.shape == slope.shape


@drawing
def test_several_runs_have_a_picture_each_and_slow_motion_has_more_frames(here, capsys):
    argv = ["video", "one", "two", "one", "--out", "three.gif", "--size", "480x180", "--fps", "5", "--to", "0.4"]
    assert main([*argv, "--slow", "2"]) == 0
    assert "three.gif: 4 frames" in capsys.readouterr().out
    drawn, _ = frames("three.gif")
    assert drawn[0].shape == (180, 480, 3)
    first, _, third = np.split(drawn[2], 3, axis=1)
    assert np.abs(first - third).mean() < 2.0, "the same run looks the same"
    for part in np.split(drawn[2], 3, axis=1):
        assert coloured(part, -1.0, 0.0, 1.0).sum() > 50


@drawing
def test_after_a_fall_the_clip_goes_on_and_the_robot_lies_down(here, capsys):
    push = "push=[{at=0.2,duration=0.3,force=[-400.0,0.0]}]"
    short = ["--set", "duration=3.0", "--set", "window.start=0.5", "--set", "window.end=3.0", "--set", push]
    assert main(["run", "level_normal", *short, "--out", "down"]) == 1
    name, run, model = run_of(Path("down"), None)
    (walker,) = walkers([(name, run, model)], False)
    assert run.end == "fell"
    assert walker.end == pytest.approx(run.time[-1] + 1.0)
    drawn = mujoco.MjData(model)
    heights = []
    for row in (len(run) - 1, -1):
        drawn.qpos[:] = walker.q[row]
        mujoco.mj_forward(model, drawn)
        heights.append(drawn.xipos[1:, 2].max())
    assert heights[1] < 0.5 * heights[0]
    assert drawn.xipos[1:, 2].min() > -0.1, "it lies on the ground and not below"


@drawing
def test_an_mp4_is_one(here):
    ffmpeg = pytest.importorskip("imageio_ffmpeg")
    argv = ["video", "one", "--out", "one.mp4", "--width", "320", "--fps", "10"]
    assert main(argv) == 0
    command = [
        ffmpeg.get_ffmpeg_exe(),
        "-loglevel",
        "error",
        "-i",
        "one.mp4",
        "-f",
        "rawvideo",
        "-pix_fmt",
        "rgb24",
        "-",
    ]
    raw = subprocess.run(command, capture_output=True, check=True).stdout
    clip = np.frombuffer(raw, np.uint8).reshape(-1, 180, 320, 3)
    assert len(clip) == 10
    assert coloured(clip[5].astype(float), -1.0, 0.0, 1.0).sum() > 100


@drawing
def test_an_encoder_that_fails_says_why_and_leaves_nothing(here, monkeypatch, capsys):
    pytest.importorskip("imageio_ffmpeg")
    monkeypatch.setattr(film, "_ffmpeg", lambda: sys.executable)
    assert main(["video", "one", "--out", "bad.mp4", "--width", "64", "--fps", "5"]) == 1
    assert "video: the encoder failed" in " ".join(capsys.readouterr().err.split())
    assert not list(Path().glob("*bad.mp4*"))


def test_the_extra_is_named(here, monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    assert main(["video", "one", "--out", "x.mp4"]) == 2
    assert "pip install imageio-ffmpeg" in " ".join(capsys.readouterr().err.split())
    assert not Path("x.mp4").exists()
    film.check(Path("x.gif"))


def test_where_nothing_can_draw_it_says_what_to_install(here, monkeypatch, capsys):
    tried = []

    def broken(argv, **more):
        tried.append(argv[-1])
        return subprocess.CompletedProcess(argv, -11)

    monkeypatch.setattr(film.subprocess, "run", broken)
    monkeypatch.setattr(sys, "platform", "linux")
    monkeypatch.delenv("MUJOCO_GL", raising=False)
    assert main(["video", "one", "--out", "x.gif"]) == 2
    said = " ".join(capsys.readouterr().err.split())
    assert "tried egl and osmesa" in said
    assert "apt-get install" in said
    assert ["egl" in tried[0], "osmesa" in tried[1]] == [True, True]
    assert not Path("x.gif").exists()
    assert not Path(".x.gif.part").exists()


@pytest.mark.parametrize(
    ("argv", "says"),
    [
        (["one", "--out", "x.avi"], "--out x.avi: expected a file *.mp4 or *.gif"),
        (["one", "--out", "no/x.gif"], "--out no/x.gif: cannot be written"),
        (["nowhere", "--out", "x.gif"], "expected a results folder"),
        (["one"] * 7 + ["--out", "x.gif"], "expected at most 6 runs, got 7"),
        (["one", "--eye", "bottom", "--out", "x.gif"], "--eye bottom: expected three-quarters, side, front, back"),
        (["one", "--eye", "0,99", "--out", "x.gif"], "--eye 0,99: expected"),
        (["one", "--size", "big", "--out", "x.gif"], "expected a size in pixels such as 1280x720, got 'big'"),
        (["one", "--slow", "0", "--out", "x.gif"], "--slow 0: expected"),
        (["one", "--ghost", "--out", "x.gif"], "--ghost: expected two runs"),
        (["one", "--width", "1", "--out", "x.gif"], "--width 1: expected"),
        (["one", "--fps", "nan", "--out", "x.gif"], "--fps nan: expected"),
        (["one", "--from", "5", "--out", "x.gif"], "--from 5: expected a time before the end"),
        (["one", "--from", "0.5", "--to", "0.1", "--out", "x.gif"], "--to 0.1: expected"),
        (["one", "--to", "x", "--out", "x.gif"], "expected a number, got 'x'"),
    ],
)
def test_bad_input_is_one_sentence(here, argv, says, capsys):
    assert main(["video", *argv]) == 2
    assert says in " ".join(capsys.readouterr().err.split())
    assert not Path("x.gif").exists()


@drawing
def test_of_a_campaign_the_run_that_was_asked_for(here, capsys):
    write("s.toml", "duration = 0.3\nstart = { jitter = 0.02 }\nrandomise = { runs = 2 }\nwindow = { start = 0.1 }\n")
    command(capsys, "run", "s.toml", "--jobs", "1", "--out", "many")
    assert main(["video", "many", "--only", "1", "--out", "m.gif", "--width", "64", "--fps", "10"]) == 0
    assert main(["video", "many", "--only", "7", "--out", "m2.gif"]) == 2
    assert "--only 7: expected the number of a run of many, 0 … 1" in " ".join(capsys.readouterr().err.split())
