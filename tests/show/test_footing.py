"""What is drawn on the ground of a walk in space, read back from its recording; and how it is seen."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from biped.engines.mujoco import simulate
from biped.ensemble.plan import Plan
from biped.robot.run import visual_model
from biped.scenario.reading import read_scenario, to_toml
from biped.show.recording import Recorded, layout, record
from biped.show.recording.series import place
from tests.show.recordings import CHANGES, contents_of, read, recorded

FOOT = [slice(0, 4), slice(4, 8)]


@pytest.fixture(scope="module")
def run():
    plan = Plan(read_scenario("spatial/own", ["duration=1.6", "window.start=0.8", "window.end=1.6"]))
    t = simulate(plan.run(0))
    assert t.end == "completed"
    return Recorded("walk", t, visual_model(plan.model, plan.scenario), {}, [], to_toml(plan.scenario))


@pytest.fixture(scope="module")
def path(run, tmp_path_factory):
    path = tmp_path_factory.mktemp("footing") / "run.rrd"
    record(path, [run], title="a walk")
    return path


def rows_of(t, time):
    return np.rint(np.asarray(time) / 1e9 / t.tick).astype(int)


def test_the_capture_point_is_the_extrapolated_centre_of_mass(path, run):
    t = run.trajectory
    time, place = read(path, "/walk/scene/capture_point")[0]["Points3D:positions"]
    rows, place = rows_of(t, time), np.array(place)[:, 0]
    expected = t.com[rows] + t.com_velocity[rows] * np.sqrt(t.com[rows, 2:] / 9.81)
    np.testing.assert_allclose(place[:, :2], expected[:, :2], atol=1e-5)
    assert (place[:, 2] < 0.01).all()


def test_support_is_the_hull_of_what_touches(path, run):
    t = run.trajectory
    time, strips = read(path, "/walk/scene/support")[0]["LineStrips3D:strips"]
    areas = 0
    for row, found in zip(rows_of(t, time), strips, strict=True):
        touching = t.point[row, t.contact[row] > 0.0, :2]
        if len(touching) < 3:
            continue
        (x, y), hull = np.array(found[0])[:-1, :2].T, ConvexHull(touching)
        area = 0.5 * (x @ np.roll(y, -1) - np.roll(x, -1) @ y)
        assert area == pytest.approx(hull.volume, rel=1e-3)
        areas += 1
    assert areas > 30


def test_steps_are_where_feet_stood(path, run):
    t = run.trajectory
    for foot, name in enumerate(("right_steps", "left_steps")):
        time, strips = read(path, f"/walk/scene/{name}")[0]["LineStrips3D:strips"]
        assert 1 <= len(time) <= 2
        for row, found in zip(rows_of(t, time), strips, strict=True):
            assert t.down[row, foot]
            assert not t.down[row - 20, foot]
            corners = np.array(found[0])[:, :2]
            standing = row + 150  # in the middle of the stance
            away = np.linalg.norm(corners[:, None] - t.point[standing, FOOT[foot], :2], axis=2).min(axis=1)
            assert (away < 0.02).all()


def test_a_walk_in_space_is_seen_from_three_sides_and_one_in_the_plane_from_its_own(run):
    def views(one):
        found = []

        def visit(part):
            found.extend([part.name] if type(part).__name__ == "Spatial3DView" else [])
            for child in contents_of(part):
                if not isinstance(child, str):
                    visit(child)

        visit(layout(place([one])).root_container)
        return found

    assert views(run) == ["Walk", "From ahead", "Steps, from above"]
    assert views(recorded("flat", CHANGES)) == ["Walk"]
