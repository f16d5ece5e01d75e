"""Soles of meshes, balls, cylinders and discs: what a foot rests on when it is flat."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from biped.robot.sole import height_over_rest
from tests.robot.edited import SIDES, Edit, built


def shoe(spec: mujoco.MjSpec) -> None:
    """Gives both feet a mesh with a rim 12 mm above what it stands on, which is 5 mm lower than the soles were."""
    rims = [[[x, y, z] for x in xs for y in ys] for xs, ys, z in (
        ((-0.05, 0.16), (-0.045, 0.045), 0.012), ((-0.04, 0.14), (-0.035, 0.035), 0.0),
        ((-0.05, 0.16), (-0.045, 0.045), 0.04))]  # fmt: skip
    spec.add_mesh(name="shoe", uservert=np.array(rims).ravel().tolist())
    for side in SIDES:
        geom = spec.geom(f"{side}_sole")
        geom.type, geom.meshname, geom.pos = mujoco.mjtGeom.mjGEOM_MESH, "shoe", [0.0, 0.0, -0.075]


def test_a_sole_of_a_mesh_is_what_it_rests_on(tmp_path):
    _, _, anatomy = built(tmp_path, shoe)
    for leg in anatomy.legs:
        assert np.abs(leg.sole) == pytest.approx(np.array([[0.14, 0.035, 0.075]] * 2 + [[0.04, 0.035, 0.075]] * 2))
        assert leg.sole[:, 2] == pytest.approx(-0.075)


def balls(radius: float, corners: np.ndarray) -> Edit:
    """Puts four spheres below both feet, about centres (4, 3) [m] in the frame of a foot."""

    def edit(spec: mujoco.MjSpec) -> None:
        for side in SIDES:
            for number, place in enumerate(corners):
                foot = spec.body(f"{side}_foot")
                foot.add_geom(name=f"{side}_{number}", type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[radius, 0.0, 0.0],
                              pos=place, contype=1, conaffinity=1)  # fmt: skip

    return edit


BALLS = np.array([[0.13, 0.03, -0.0725], [0.13, -0.03, -0.0725], [-0.04, 0.03, -0.0725], [-0.04, -0.03, -0.0725]])


def test_spheres_below_a_plate_are_the_sole(tmp_path):
    """As R1's: the plate reaches further out than the spheres on which the robot stands."""
    _, robot, anatomy = built(tmp_path, balls(0.01, BALLS))
    assert len(robot.feet[0].points) == 8
    for leg in anatomy.legs:
        assert np.abs(leg.sole) == pytest.approx(np.array([[0.13, 0.03, 0.0825]] * 2 + [[0.04, 0.03, 0.0825]] * 2))


def tilted(slope: float) -> Edit:
    """Feet of four large spheres whose plane is tilted where the ankles have their zero."""
    turn = np.array([[np.cos(slope), 0.0, np.sin(slope)], [0.0, 1.0, 0.0], [-np.sin(slope), 0.0, np.cos(slope)]])

    def edit(spec: mujoco.MjSpec) -> None:
        for side in SIDES:
            plate = spec.geom(f"{side}_sole")
            plate.contype = plate.conaffinity = 0
        balls(0.03, BALLS @ turn.T)(spec)

    return edit


def test_large_spheres_touch_with_what_is_lowest_when_the_foot_is_flat(tmp_path):
    _, _, anatomy = built(tmp_path, tilted(0.1))
    for leg in anatomy.legs:
        depth = leg.sole @ [np.sin(0.1), 0.0, np.cos(0.1)]
        assert depth == pytest.approx(-0.0725 - 0.03, abs=1e-6)


def cylinders(height: float, radius: float, quat: list[float], places: np.ndarray) -> Edit:
    """Feet of cylinders."""

    def edit(spec: mujoco.MjSpec) -> None:
        for side in SIDES:
            foot = spec.body(f"{side}_foot")
            for geom in list(foot.geoms):
                spec.delete(geom)
            for place in places:
                foot.add_geom(type=mujoco.mjtGeom.mjGEOM_CYLINDER, size=[radius, 0.5 * height, 0.0], quat=quat,
                              pos=place, contype=0, conaffinity=1)  # fmt: skip

    return edit


@pytest.mark.parametrize("roll", [0.0, 30.0, 45.0, 90.0])
def test_lying_cylinders_touch_along_their_lowest_lines_however_they_are_rolled(tmp_path, roll):
    """Axis along x, rolled about itself, which changes no physics."""
    laid, rolled, quat = np.zeros(4), np.zeros(4), np.zeros(4)
    mujoco.mju_axisAngle2Quat(laid, np.array([0.0, 1.0, 0.0]), 0.5 * np.pi)
    mujoco.mju_axisAngle2Quat(rolled, np.array([0.0, 0.0, 1.0]), np.deg2rad(roll))
    mujoco.mju_mulQuat(quat, laid, rolled)
    two = np.array([[0.05, y, -0.05] for y in (0.03, -0.03)])
    _, robot, anatomy = built(tmp_path, cylinders(0.2, 0.02, list(quat), two))
    ends = sorted((x, y, -0.07) for x in (-0.05, 0.15) for y in (-0.03, 0.03))
    for foot, leg in zip(robot.feet, anatomy.legs, strict=True):
        np.testing.assert_allclose(sorted(map(tuple, np.round(foot.points, 9))), ends, atol=1e-8)
        np.testing.assert_allclose(sorted(map(tuple, np.round(leg.sole, 9))), ends, atol=1e-8)


@pytest.mark.parametrize("turned", [0.0, 20.0, 45.0])
def test_a_standing_disc_has_four_corners_however_it_is_turned(tmp_path, turned):
    quat = np.zeros(4)
    mujoco.mju_axisAngle2Quat(quat, np.array([0.0, 0.0, 1.0]), np.deg2rad(turned))
    _, _, anatomy = built(tmp_path, cylinders(0.02, 0.08, list(quat), np.array([[0.05, 0.0, -0.06]])))
    reach = 0.08 * np.sqrt(0.5)
    corners = sorted((0.05 + x, y, -0.07) for x in (-reach, reach) for y in (-reach, reach))
    for leg in anatomy.legs:
        np.testing.assert_allclose(sorted(map(tuple, np.round(leg.sole, 9))), corners, atol=1e-8)


@pytest.mark.parametrize("tilt", [0.0, 0.05, -0.1])
def test_what_rests_on_a_plane_has_no_height_over_it(tilt):
    """A plate with a bump above it and a rim: its corners are at zero, the rest at its distance, tilted or not."""
    points = np.array([[0.1, 0.05, 0.0], [0.1, -0.05, 0.0], [-0.1, 0.05, 0.0], [-0.1, -0.05, 0.0], [0.12, 0.06, 0.004],
                       [-0.12, 0.0, 0.01], [0.0, 0.0, 0.03]])  # fmt: skip
    raised = points + np.column_stack([np.zeros((7, 2)), tilt * points[:, 0] + 0.3])
    assert height_over_rest(raised) == pytest.approx(points[:, 2], abs=1e-12)
