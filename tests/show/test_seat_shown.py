"""A seat as every picture draws it: the same box, and the force with which it bears the pelvis."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib.patches import Polygon

from biped.engines.planar.mujoco import simulate
from biped.ensemble.plan import Plan
from biped.measure.signals import corners_of
from biped.robot.ground import GRAVITY
from biped.robot.planar.build import compile_foreign
from biped.scenario.reading import read_scenario, to_toml
from biped.show import spatial
from biped.show.figures.curves import strobe
from biped.show.page.frames import frames_of
from biped.show.page.player import PlayedRun, walks
from biped.show.recording import Recorded, record
from tests.engines.planar.test_seat import SEATED
from tests.show.recordings import read

CORNERS = [(-0.65, 0.0), (-0.65, 0.485), (-0.15, 0.485), (-0.15, 0.0)]


@pytest.fixture(scope="module")
def run():
    plan = Plan(read_scenario("calm/own", [*SEATED, "duration=1.2", "window.start=0.8", "window.end=1.2"]))
    model = compile_foreign(plan.model, plan.scenario, visuals=True).model
    return Recorded("sits", simulate(plan.run(0)), model, {}, [], to_toml(plan.scenario))


@pytest.fixture(scope="module")
def path(run, tmp_path_factory):
    file = tmp_path_factory.mktemp("seat") / "sits.rrd"
    record(file, [run], title="sits")
    return file


def test_the_recording_has_the_box_and_an_arrow_of_its_force(path, run):
    _, static = read(path, "/sits/scene/seat")
    middle, half = (np.array(static[f"Boxes3D:{name}"][0]) for name in ("centers", "half_sizes"))
    np.testing.assert_allclose((middle + half)[[0, 2]], CORNERS[2], atol=1e-6)
    np.testing.assert_allclose((middle - half)[[0, 2]], CORNERS[0], atol=1e-6)
    columns, _ = read(path, "/sits/scene/seat_force")
    last = np.array(columns["Arrows3D:vectors"][1][-1][0])
    weight = run.trajectory.tree.mass.sum() * GRAVITY
    np.testing.assert_allclose(last[[0, 2]], 0.6 * run.trajectory.seat_force[-1, :2] / weight, atol=0.01)
    start = np.array(columns["Arrows3D:origins"][1][-1][0])
    assert start[2] == pytest.approx(0.485, abs=2e-3)  # where the pelvis meets it
    assert start[1] == pytest.approx(-half[1], abs=1e-6)  # on the viewer's side


def test_who_has_no_seat_is_drawn_none(tmp_path, run):
    plan = Plan(read_scenario("calm/own", ["duration=0.3", "window.start=0.0", "window.end=0.3"]))
    other = run._replace(name="walks", trajectory=simulate(plan.run(0)))
    record(tmp_path / "w.rrd", [other], title="walks")
    assert read(tmp_path / "w.rrd", "/walks/scene/seat") == ({}, {})
    assert spatial.seat(other.trajectory) is None
    assert 'class="seat"' not in str(walks([PlayedRun("walk", "walked", frames_of(other.trajectory))]))
    assert not len(corners_of(other.trajectory))


def test_the_page_and_the_figure_draw_its_corners(run):
    np.testing.assert_allclose(frames_of(run.trajectory).seat, CORNERS, atol=1e-12)
    drawn = str(walks([PlayedRun("sits", "sat still", frames_of(run.trajectory))]))
    corners = " ".join(f"{x:.3f},{-z:.3f}" for x, z in CORNERS)
    assert f'points="{corners}"' in drawn
    patches = strobe(run.trajectory, "sits").axes[0].patches
    boxes = [patch.get_xy()[:4] for patch in patches if isinstance(patch, Polygon) and len(patch.get_xy()) == 5]
    assert any(np.allclose(box, CORNERS) for box in boxes)


def test_a_clips_stage_has_the_box(run):
    from biped.show.film.stage import Camera, FilmStage, walkers

    scene = FilmStage(walkers([("sits", run.trajectory, run.model)], ghost=False), 30.0, Camera(30.0, 15.0), 16 / 9).at(
        1.0
    )
    boxes = [(np.array(g.pos), np.array(g.size)) for g in scene.geoms[: scene.ngeom]]
    middle, half = spatial.seat(run.trajectory)
    assert sum(np.allclose(pos, middle, atol=1e-6) and np.allclose(size, half, atol=1e-6) for pos, size in boxes) == 1
