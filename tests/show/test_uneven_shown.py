"""Ground that is not level, and pushes that change, as every picture draws them: the same line, the same forces."""

from __future__ import annotations

import math
import re

import mujoco
import numpy as np
import pytest

from biped.engines.planar.mujoco import simulate
from biped.ensemble.plan import Plan
from biped.robot.ground import LEVEL, slabs
from biped.robot.planar.build import compile_foreign
from biped.robot.planar.description import description_at
from biped.scenario.reading import read_scenario
from biped.show.figures.curves import ground_line
from biped.show.page.frames import frames_of
from biped.show.page.player import PlayedRun, walks
from biped.show.recording import record, result
from biped.show.viewer import _arrange
from tests.show.recordings import read, recorded

CHANGES = [
    "duration=1.0", "window={start=0.5,end=1.0}", "ground.slope=3.0",
    "ground.tiles={height=0.02,length=0.2,start=0.5,number=20}",
    "push=[{at=0.2,duration=0.6,force=[80.0,0.0],shape='sine',frequency=2.0}]",
]  # fmt: skip
SLOPE = math.radians(3.0)
TURN = np.array([[math.cos(SLOPE), math.sin(SLOPE)], [-math.sin(SLOPE), math.cos(SLOPE)]])


@pytest.fixture(scope="module")
def run():
    return recorded("tiles", CHANGES)


@pytest.fixture(scope="module")
def path(run, tmp_path_factory):
    file = tmp_path_factory.mktemp("uneven") / "walk.rrd"
    record(file, [run], title="tiles")
    return file


def corners(profile, low, high):
    """Corners of the ground between two places, turned so that gravity is vertical."""
    inside = (profile.x > low) & (profile.x < high)
    return np.stack([profile.x[inside], profile.z[inside]], axis=1) @ TURN


def test_slabs_lie_on_the_ground(run):
    profile = run.trajectory.ground
    laid = slabs(profile, -1, 12, 0.5)
    way = np.stack([np.cos(laid.angle), np.sin(laid.angle)], axis=1) * 0.5 * laid.length[:, None]
    for end in (laid.middle - way, laid.middle + way):
        np.testing.assert_allclose(end[:, 1], profile.height(end[:, 0]), atol=1e-12)
    assert (0.5 * np.cos(laid.angle) * laid.length * 2).sum() == pytest.approx(6.5 * 0.5 * 2)
    assert len(slabs(LEVEL, -1, 12, 0.5).length) == 13


def test_the_figures_ground_has_every_corner(run):
    way = ground_line(run.trajectory, -1.0, 3.0)
    assert way[0, 0] == -1.0
    assert way[-1, 0] == 3.0
    assert (np.diff(way[:, 0]) > 0.0).all()
    for corner in corners(run.trajectory.ground, 0.0, 2.8):
        assert np.abs(way - corner).sum(axis=1).min() < 1e-12


def test_the_page_draws_every_corner_and_the_force_of_the_moment(run):
    frames = frames_of(run.trajectory)
    drawn = str(walks([PlayedRun("walk", "walked", frames)]))
    for x, z in corners(run.trajectory.ground, 0.0, 2.8):
        assert f"{x:.3f} {-z:.3f}" in drawn
    pushes = np.array(frames.data()["pushes"])
    assert pushes[:, 2].max() == pytest.approx(80.0, rel=0.01)
    assert pushes[:, 2].min() == pytest.approx(-80.0, rel=0.01)


def test_the_recordings_tiles_are_the_ground(path, run):
    _, static = read(path, "/tiles/scene/ground")
    centre, half, turn = (np.array(static[f"Boxes3D:{name}"]) for name in ("centers", "half_sizes", "quaternions"))
    assert np.allclose(turn[:, [0, 2]], 0.0)
    angle = -2.0 * np.arctan2(turn[:, 1], turn[:, 3])
    top = centre[:, [0, 2]] + half[:, 2:] * np.stack([-np.sin(angle), np.cos(angle)], axis=1)
    for side in (-1.0, 1.0):
        end = top + side * half[:, :1] * np.stack([np.cos(angle), np.sin(angle)], axis=1)
        np.testing.assert_allclose(end[:, 1], run.trajectory.ground.height(end[:, 0]), atol=1e-6)
    plumb = np.array(read(path, "/tiles/scene/centre_of_mass/plumb")[0]["LineStrips3D:strips"][1])[:, 0, 0]
    np.testing.assert_allclose(plumb[:, 2], run.trajectory.ground.height(plumb[:, 0]), atol=1e-6)


def test_the_recordings_push_is_one_arrow_that_goes_with_the_force(path):
    columns, static = read(path, "/tiles/scene/push_0")
    arrows = np.array([one[0] for one in columns["Arrows3D:vectors"][1] if one])
    assert static["Arrows3D:labels"] == ["up to 80 N"]
    length = np.linalg.norm(arrows, axis=1)
    assert length.max() == pytest.approx(80.0 / 400.0, rel=0.02)
    assert arrows[:, 0].min() < -0.15  # and it turns round
    assert not read(path, "/tiles/scene/push_1")[0]


def test_words_of_a_recording(run):
    said = result(run)
    assert re.search(r"ground -\d\.\d to \+\d\.\d cm high", said)
    assert "push on the torso: changing, up to 80 N, 0.2 to 0.8 s" in said


class Viewer:
    """Stands for MuJoCo's: room for a scene's geoms."""

    def __init__(self, model):
        self.cam, self.opt, self.user_scn = mujoco.MjvCamera(), mujoco.MjvOption(), mujoco.MjvScene(model, 900)


def test_the_live_viewer_shows_the_ground_instead_of_a_plane():
    single = Plan(read_scenario("level_normal", CHANGES)).run(0)
    seen = []

    def watch(model, data, forces):
        if not seen:
            seen.append(Viewer(model))
            _arrange(seen[0], model, description_at(single.model).base.link, simulate(single).ground)
            assert model.geom("ground").rgba[3] == 0.0

    profile = simulate(single, watch).ground
    shared = compile_foreign(single.model, single.scenario, visuals=True).model
    assert shared.geom("ground").rgba[3] == 1.0
    scene = seen[0].user_scn
    boxes = [geom for geom in scene.geoms[: scene.ngeom] if geom.size[1] > 0.4]
    assert len(boxes) > len(profile.x)
    for geom in boxes:
        normal = np.array(geom.mat).reshape(3, 3)[:, 2]
        top = np.array(geom.pos) + geom.size[2] * normal
        assert top[2] == pytest.approx(float(profile.height(np.array(top[0]))), abs=1e-6)
