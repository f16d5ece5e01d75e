"""The scene of a recording: bodies, forces and pushes are where the trajectory has them."""

import math

import mujoco
import numpy as np
import pytest

from biped.ensemble.plan import Plan
from biped.robot.ground import GRAVITY
from biped.robot.planar.model import spec_of
from biped.robot.planar.topology import POINT_LINK
from biped.robot.planar.tree import motion
from biped.scenario.reading import read_scenario
from biped.show.recording import record
from biped.show.recording.scene import BODY_WEIGHT, PUSH
from tests.show.recording.pushed import ROOT, frames, nanoseconds
from tests.show.recordings import CHANGES, FORWARD, SLOPE, UP, read, rerun


def test_bodies_are_where_forward_kinematics_puts_them(path, run):
    t, rows = run.trajectory, frames(run.trajectory)
    pose = motion(t.tree, t.q[rows], t.v[rows])
    for link, body in ((0, "torso"), (3, "right_foot"), (5, "left_shank")):
        temporal, _ = read(path, f"{ROOT}/scene/body/{body}")
        time, place = temporal["Transform3D:translation"]
        assert np.array_equal(time, nanoseconds(t, rows))
        place = np.array(place)[:, 0]
        np.testing.assert_allclose(place[:, [0, 2]], pose.joint[:, link], atol=1e-6)
        x, y, z, w = np.array(temporal["Transform3D:quaternion"][1])[:, 0].T
        np.testing.assert_allclose(x**2 + z**2, 0.0, atol=1e-12)
        # Counter-clockwise as seen from -y is a turn about -y.
        np.testing.assert_allclose(np.exp(2j * np.arctan2(-y, w)), np.exp(1j * pose.angle[:, link]), atol=1e-5)


def test_every_visual_geom_is_drawn_in_its_colour(path, run):
    model = run.model
    shown = [g for g in range(model.ngeom) if model.geom_group[g] == 2]
    assert len(shown) == 13
    for g in shown:
        body = model.body(model.geom_bodyid[g]).name
        _, static = read(path, f"{ROOT}/scene/body/{body}/shape_{g}")
        kind = "Capsules3D" if model.geom_type[g] == mujoco.mjtGeom.mjGEOM_CAPSULE else "Ellipsoids3D"
        colour = np.round(255 * model.geom_rgba[g]).astype(int)
        packed = static[f"{kind}:colors"][0]
        assert [packed >> 24, (packed >> 16) & 255, (packed >> 8) & 255, packed & 255] == colour.tolist()
        if kind == "Capsules3D":
            assert static["Capsules3D:radii"][0] == pytest.approx(model.geom_size[g][0])
            assert static["Capsules3D:lengths"][0] == pytest.approx(2 * model.geom_size[g][1])


def test_a_capsule_is_between_its_two_ends(path, run):
    """The thigh's visual goes from the hip to the knee, 5 cm to the right."""
    g = run.model.geom("right_thigh_visual").id
    _, static = read(path, f"{ROOT}/scene/body/right_thigh/shape_{g}")
    x, y, z, w = static["Capsules3D:quaternions"][0]
    axis = np.array([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)])
    start = np.array(static["Capsules3D:translations"][0])
    ends = sorted([start.tolist(), (start + static["Capsules3D:lengths"][0] * axis).tolist()], key=lambda e: -e[2])
    np.testing.assert_allclose(ends, [[0, -0.05, 0], [0, -0.05, -0.441]], atol=1e-6)


def test_gravity_is_vertical_in_the_view(path):
    _, static = read(path, f"{ROOT}/scene")
    turn = np.array(static["Transform3D:mat3x3"][0]).reshape(3, 3).T  # columns come one after the other
    s = math.radians(SLOPE)
    np.testing.assert_allclose(turn @ [-math.sin(s), 0.0, -math.cos(s)], [0.0, 0.0, -1.0], atol=1e-6)
    np.testing.assert_allclose(turn @ [0.0, 1.0, 0.0], [0.0, 1.0, 0.0], atol=1e-6)


def test_the_centre_of_mass_hangs_vertically_above_the_ground_and_drags_its_trail(path, run):
    t, rows = run.trajectory, frames(run.trajectory)
    com = motion(t.tree, t.q[rows], t.v[rows]).com
    expected = (com * t.tree.mass[:, None]).sum(axis=1) / 75.0
    place = np.array(read(path, f"{ROOT}/scene/centre_of_mass")[0]["Points3D:positions"][1])[:, 0]
    np.testing.assert_allclose(place[:, [0, 2]], expected, atol=1e-6)
    plumb = np.array(read(path, f"{ROOT}/scene/centre_of_mass/plumb")[0]["LineStrips3D:strips"][1])[:, 0]
    np.testing.assert_allclose(plumb[:, 1], place)
    np.testing.assert_allclose(plumb[:, 0, 2], 0.0, atol=1e-6)
    s = math.radians(SLOPE)
    hanging = (plumb[:, 1] - plumb[:, 0])[:, [0, 2]] @ [1, 1j] * np.exp(1j * s)
    np.testing.assert_allclose(hanging.real, 0.0, atol=1e-6)
    trail = np.array(read(path, f"{ROOT}/scene/trail")[0]["LineStrips3D:strips"][1])[:, 0]
    np.testing.assert_array_equal(trail[:, 1], place.astype(np.float32))
    np.testing.assert_array_equal(trail[1:, 0], trail[:-1, 1])


def test_the_view_goes_along_on_the_ground(path, run):
    rows = frames(run.trajectory)
    eye = np.array(read(path, f"{ROOT}/eye")[0]["Transform3D:translation"][1])[:, 0]
    place = np.array(read(path, f"{ROOT}/scene/centre_of_mass")[0]["Points3D:positions"][1])[:, 0]
    along = eye[:, [0, 2]] @ [1, 1j] * np.exp(-1j * math.radians(SLOPE))
    np.testing.assert_allclose(along, place[:, 0], atol=1e-6)
    assert len(eye) == len(rows)


def test_contact_forces_are_means_of_the_trajectorys(path, run):
    t, rows = run.trajectory, frames(run.trajectory)
    temporal, _ = read(path, f"{ROOT}/scene/contact_force")
    time, vectors = temporal["Arrows3D:vectors"]
    _, origins = temporal["Arrows3D:origins"]
    newton = BODY_WEIGHT / (75.0 * GRAVITY)
    assert np.array_equal(time, nanoseconds(t, rows))
    points = motion(t.tree, t.q[rows], t.v[rows]).point
    seen = 0
    for i, row in enumerate(rows):
        mean = t.column("force")[row : row + 17].mean(axis=0)
        loaded = np.linalg.norm(mean, axis=1) > 5.0
        arrows = np.array(vectors[i]).reshape(-1, 3) / newton
        np.testing.assert_allclose(arrows[:, [0, 2]], mean[loaded], rtol=1e-5, atol=1e-3)
        np.testing.assert_allclose(np.array(origins[i]).reshape(-1, 3)[:, [0, 2]], points[i, loaded], atol=1e-6)
        seen += loaded.sum()
    assert seen > 50


def test_forces_that_the_law_counts_on_are_thin_arrows_nearer_by(path, run, tmp_path):
    assert read(path, f"{ROOT}/scene/believed_force") == ({}, {}), "this law counts on none"
    believed = tmp_path / "believed.rrd"
    record(
        believed,
        [run._replace(believed=lambda trajectory: 0.5 * trajectory.column("force"))],
        title="half of what there is",
    )
    of = {name: read(believed, f"{ROOT}/scene/{name}_force") for name in ("contact", "believed")}
    (there, drawn), (counted, style) = of["contact"], of["believed"]
    assert style["Arrows3D:radii"][0] < drawn["Arrows3D:radii"][0]
    row = 20
    real, half = (np.array(arrows["Arrows3D:vectors"][1][row]) for arrows in (there, counted))
    np.testing.assert_allclose(half, 0.5 * real, rtol=1e-5)
    real, half = (np.array(arrows["Arrows3D:origins"][1][row]) for arrows in (there, counted))
    np.testing.assert_allclose(half - real, np.tile([0.0, -0.03, 0.0], (len(real), 1)), atol=1e-6)


def test_arrows_are_on_the_side_of_their_foot(path, run):
    temporal, _ = read(path, f"{ROOT}/scene/contact_force")
    aside = {round(origin[1], 3) for row in temporal["Arrows3D:origins"][1] for origin in row}
    assert aside == {-0.12, -0.02}  # right leg at -0.05 and left at 0.05, both a little towards the viewer
    assert POINT_LINK == (3, 3, 6, 6)


def test_a_push_is_an_arrow_into_the_torso_while_it_lasts(path, run):
    t = run.trajectory
    temporal, static = read(path, f"{ROOT}/scene/push_0")
    time, vectors = temporal["Arrows3D:vectors"]
    assert time[0] == 0.4e9
    assert [len(v) for v in vectors] == [1] * (len(time) - 1) + [0]
    assert time[-1] == 0.6e9
    s = math.radians(SLOPE)
    np.testing.assert_allclose(
        np.array([v[0] for v in vectors[:-1]])[:, [0, 2]] @ [1, 1j] * np.exp(1j * s) / PUSH,
        FORWARD + 1j * UP, rtol=1e-5,
    )  # fmt: skip
    rows = np.round(time[:-1] / 1e6).astype(int)
    tips = np.array(temporal["Arrows3D:origins"][1][:-1])[:, 0] + np.array(vectors[:-1])[:, 0]
    np.testing.assert_allclose(tips[:, [0, 2]], t.q[rows, :2], atol=1e-6)
    assert static["Arrows3D:labels"] == ["124 N"]


def test_runs_side_by_side_and_a_ghost_over_the_one_before(run, tmp_path):
    path = tmp_path / "many.rrd"
    runs = [run._replace(name="a"), run._replace(name="b"), run._replace(name="c", ghost=True)]
    record(path, runs, title="three")
    assert rerun("verify", path).returncode == 0
    lanes = [read(path, f"/{name}/scene")[1]["Transform3D:translation"][0][1] for name in "abc"]
    assert lanes[0] == 0.0
    assert lanes[1] > 1.0
    assert lanes[2] == lanes[1]
    grounds = [bool(read(path, f"/{name}/scene/ground")[1]) for name in "abc"]
    assert grounds == [True, True, False]
    g = run.model.geom("trunk").id
    trunk = read(path, f"/c/scene/body/torso/shape_{g}")[1]["Capsules3D:colors"][0]
    assert trunk & 255 < 128
    assert read(path, "/b/series/velocity")[1]["SeriesLines:names"] == ["b"]


def test_other_shapes_and_materials_of_a_users_model(run, tmp_path):
    scenario = read_scenario("level_normal", CHANGES)
    spec = spec_of(Plan(scenario).model)
    torso = spec.body("torso")
    spec.add_material(name="brass", rgba=[0.8, 0.6, 0.2, 1.0])
    looks = {"group": 2, "mass": 0.0, "contype": 0, "conaffinity": 0}
    box, cylinder, ball, mesh = (mujoco.mjtGeom.mjGEOM_BOX, mujoco.mjtGeom.mjGEOM_CYLINDER,
                                 mujoco.mjtGeom.mjGEOM_SPHERE, mujoco.mjtGeom.mjGEOM_MESH)  # fmt: skip
    torso.add_geom(name="box", type=box, size=[0.1, 0.2, 0.3], pos=[0, 0, 0.1], material="brass",
                   rgba=[0.5, 0.5, 0.5, 1], **looks)  # fmt: skip
    torso.add_geom(name="cylinder", type=cylinder, size=[0.1, 0.2, 0], **looks)
    torso.add_geom(name="ball", type=ball, size=[0.15, 0, 0], **looks)
    corner = [0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1]
    spec.add_mesh(name="tetrahedron", uservert=corner, userface=[0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3])
    torso.add_geom(name="mesh", type=mesh, meshname="tetrahedron", pos=[0.3, 0, 0], **looks)
    model = spec.compile()
    path = tmp_path / "shapes.rrd"
    record(path, [run._replace(model=model)], title="shapes")

    def static(name):
        return read(path, f"{ROOT}/scene/body/torso/shape_{model.geom(name).id}")[1]

    assert static("box")["Boxes3D:half_sizes"][0] == pytest.approx([0.1, 0.2, 0.3])
    assert static("box")["Boxes3D:colors"][0] == 0xCC9933FF
    assert static("cylinder")["Cylinders3D:lengths"][0] == pytest.approx(0.4)
    assert static("ball")["Ellipsoids3D:half_sizes"][0] == pytest.approx([0.15] * 3)
    corners = np.round(static("mesh")["Mesh3D:vertex_positions"], 5) + 0.0
    assert sorted(corners.tolist()) == [[0.3, 0, 0], [0.3, 0, 1], [0.3, 1, 0], [1.3, 0, 0]]
