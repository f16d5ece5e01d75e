"""Figures: what is drawn is read from the axes, and the files are looked at as pictures."""

import dataclasses

import matplotlib
import numpy as np
import pytest
from matplotlib import _pylab_helpers, image
from matplotlib.colors import to_hex
from matplotlib.patches import Circle, Polygon

from biped.base.errors import InputError
from biped.engines.planar.mujoco import simulate
from biped.ensemble.plan import Plan
from biped.measure import signals
from biped.robot.planar.tree import motion
from biped.scenario.reading import read_scenario
from biped.show.figures import curves, plot_ensemble, plot_run, strides
from biped.show.figures.curves import body_rows, capsule, strobe
from biped.show.figures.style import LEFT, RIGHT

WINDOW = (1.0, 2.0)


def run(*changes):
    scenario = read_scenario("level_normal", ["duration=2.5", "window.start=1.0", "window.end=2.0", *changes])
    return simulate(Plan(scenario).run(0))


@pytest.fixture(scope="module")
def walk():
    return run("actuation.mode=generalized")


@pytest.fixture(scope="module")
def pushed():
    return run("actuation.mode=generalized", "push=[{at=0.5,duration=0.2,force=[-80.0,0.0]}]")


@pytest.fixture(scope="module")
def uphill():
    return run("ground.slope=5", "controller=uphill")


def test_files_are_pictures_small_enough_for_a_readme(pushed, tmp_path):
    files = plot_run(pushed, tmp_path / "made" / "here", title="pushed", window=(0.0, 2.5))
    assert [file.name for file in files] == [
        "walk.png", "velocity.png", "torso.png", "phase.png", "loads.png", "strides.png", "push.png"
    ]  # fmt: skip
    for file in files:
        assert file.stat().st_size < 200_000
        pixels = image.imread(file)[..., :3]
        assert pixels.shape[1] > 800
        assert pixels.shape[0] > 200
        ink = (pixels < 0.9).any(axis=2)
        assert 0.01 < ink.mean() < 0.7, file
    assert not _pylab_helpers.Gcf.figs  # nothing of pyplot is left open


def test_the_same_run_gives_the_same_bytes_and_no_push_figure_without_a_push(walk, tmp_path):
    first = plot_run(walk, tmp_path / "a", title="walk", window=WINDOW)
    second = plot_run(walk, tmp_path / "b", title="walk", window=WINDOW)
    assert [file.read_bytes() for file in first] == [file.read_bytes() for file in second]
    assert "push.png" not in [file.name for file in first]


def test_a_stride_goes_from_strike_to_strike_of_the_same_foot_and_flexion_is_positive(walk):
    window = (0.0, 2.5)
    found, rows = strides.strides(walk, window), dict.fromkeys(range(2))
    for foot in rows:
        rows[foot] = [row for row, which in walk.strikes if which == foot]
    assert len(found) == sum(len(of) - 1 for of in rows.values()) > 0
    leg = 0 if len(rows[0]) > 1 else 1
    hip, knee, ankle = found[0]
    first, last = rows[leg][:2]
    angles = np.degrees(walk.joint_angles[:, 3 * leg : 3 * leg + 3])
    assert np.allclose([hip[0], -knee[0], ankle[0]], angles[first])
    assert np.allclose([hip[-1], -knee[-1], ankle[-1]], angles[last])
    middle = np.argmin(abs(np.linspace(0, 100, last - first + 1) - 72.0))
    assert knee[72] == pytest.approx(-angles[first + middle, 1], abs=1.0)
    assert knee.max() > 30.0  # while it swings
    assert hip.argmax() > 60
    assert hip.max() > 15.0
    assert not len(strides.strides(walk, (1.0, 1.1)))
    assert strides.draw({"walk": walk}, "too short", (1.0, 1.1)) is None


@pytest.mark.parametrize("joint", strides.PEOPLE)
def test_people_pass_the_angles_that_are_named_and_their_stride_is_closed(joint):
    curve = strides.of_people(joint)
    for percent, degrees in strides.PEOPLE[joint]:
        assert curve[percent] == pytest.approx(degrees, abs=1e-9)
    assert curve[0] == pytest.approx(curve[100], abs=1e-9)
    assert curve.max() <= max(degrees for _, degrees in strides.PEOPLE[joint]) + 1e-9


def test_settings_do_not_leak(walk, tmp_path):
    before = dict(matplotlib.rcParams)
    plot_run(walk, tmp_path, title="walk", window=WINDOW)
    assert dict(matplotlib.rcParams) == before


def bodies(figure):
    """Polygons and circles by colour."""
    shapes = {}
    for patch in figure.axes[0].patches:
        shapes.setdefault(to_hex(patch.get_facecolor()).upper(), []).append(patch)
    return shapes


def test_bodies_stand_where_forward_kinematics_puts_them(walk):
    shapes = bodies(strobe(walk, "walk"))
    rows = body_rows(walk)
    assert len(rows) > 2
    assert np.ptp(np.diff(rows)) <= 1  # a stroboscope flashes at equal times
    pose = motion(walk.tree, walk.q[rows], walk.v[rows])
    for colour, points in ((RIGHT, pose.point[:, :2]), (LEFT, pose.point[:, 2:])):
        feet = [p for p in shapes[colour] if isinstance(p, Polygon) and len(p.get_xy()) == 6]
        assert len(shapes[colour]) == 3 * len(feet) == 3 * len(rows)
        drawn = np.array([[foot.get_xy()[1], foot.get_xy()[0]] for foot in feet])  # toe, heel
        np.testing.assert_allclose(drawn, points, atol=1e-12)
    heads = [p for shape in shapes.values() for p in shape if isinstance(p, Circle)]
    hips = pose.joint[:, 1]
    assert len(heads) == len(rows)
    for head, hip in zip(heads, hips, strict=True):
        assert 0.55 < np.hypot(*(np.array(head.center) - hip)) < 0.9
        assert head.center[1] > hip[1]


def test_a_slope_is_drawn_tilted_with_feet_on_it(uphill):
    figure = strobe(uphill, "uphill")
    ground = figure.axes[0].lines[0]
    x, z = ground.get_data()
    assert (z[1] - z[0]) / (x[1] - x[0]) == pytest.approx(np.tan(np.radians(5.0)))
    shapes = bodies(figure)
    feet = np.array([p.get_xy()[:2] for c in (RIGHT, LEFT) for p in shapes[c] if len(p.get_xy()) == 6])
    height = (feet[..., 1] - np.tan(np.radians(5.0)) * feet[..., 0]) * np.cos(np.radians(5.0))
    rows = body_rows(uphill)
    np.testing.assert_allclose(np.sort(height.ravel()), np.sort(uphill.height[rows].ravel()), atol=1e-9)


def test_a_limb_is_round_at_both_ends():
    outline = capsule(np.array([1.0, 2.0]), np.array([1.0, 5.0]), 0.5, 0.25)
    assert outline[:, 1].min() == pytest.approx(1.5, abs=0.01)
    assert outline[:, 1].max() == pytest.approx(5.25, abs=0.01)
    assert np.ptp(outline[:, 0]) == pytest.approx(1.0)


def test_velocity_and_its_mean(walk):
    axes = curves.velocity(walk, "walk", WINDOW).axes[0]
    drawn, mean = axes.lines
    np.testing.assert_array_equal(drawn.get_ydata(), walk.v[:, 0])
    assert mean.get_ydata()[0] == pytest.approx(walk.v[1000:2001, 0].mean())
    assert mean.get_xdata() == pytest.approx([1.0, 2.0])
    assert "m/s" in axes.get_ylabel()
    assert "[s]" in axes.get_xlabel()


def test_upright_is_90_degrees_from_the_horizontal(walk, uphill):
    for run, slope in ((walk, 0.0), (uphill, 5.0)):
        line = curves.torso(run, "torso").axes[0].lines[1]
        np.testing.assert_allclose(line.get_ydata(), 90.0 + np.degrees(run.q[:, 2]) + slope)


def test_phase_portraits_are_of_the_right_leg(walk):
    for i, axes in enumerate(curves.phase(walk, "walk", WINDOW).axes):
        whole, window = axes.lines
        np.testing.assert_allclose(whole.get_xdata(), np.degrees(walk.q[:, 3 + i]))
        np.testing.assert_allclose(whole.get_ydata(), np.degrees(walk.v[:, 3 + i]))
        assert len(window.get_xdata()) == 1001


def test_a_push_is_marked_where_it_was(pushed):
    axes = curves.push(pushed, "pushed").axes[0]
    (span,) = axes.patches
    assert span.get_x() == pytest.approx(0.5)
    assert span.get_width() == pytest.approx(0.2)
    assert axes.get_legend().get_texts()[0].get_text() == "-80 N on the torso"


def test_loads_show_torques_forces_against_weight_and_leg_states(walk):
    *joints, force, lanes = curves.loads(walk, "walk", WINDOW).axes
    for joint, axes in enumerate(joints):
        for leg, colour in enumerate((RIGHT, LEFT)):  # thin as they are, then their means
            thin, mean = axes.lines[2 * leg : 2 * leg + 2]
            np.testing.assert_array_equal(thin.get_ydata(), walk.applied[1000:2001, 3 + 3 * leg + joint])
            assert to_hex(thin.get_color()).upper() == to_hex(mean.get_color()).upper() == colour
    np.testing.assert_allclose(
        force.lines[0].get_ydata()[500], walk.force[1490:1510, :2, 2].sum(axis=1).mean(), rtol=0.02
    )
    assert force.lines[2].get_ydata()[0] == pytest.approx(75.0 * 9.81)
    # Each state's bars cover as much time as the leg spent in it.
    for bar, (leg, state) in zip(lanes.collections, [(i, s) for i in (0, 1) for s in (1, 2, 3, 4)], strict=True):
        x = [path.get_extents().width for path in bar.get_paths()]
        ticks = (walk.phase[1000:2001, leg] == state).sum()
        assert sum(x) == pytest.approx(1e-3 * ticks, abs=1e-3 * (len(x) + 1))


def test_moving_means_keep_a_constant_and_a_straight_line():
    line = np.linspace(0.0, 1.0, 200)
    np.testing.assert_allclose(signals.smooth(np.full(200, 3.0), 1e-3), 3.0)
    np.testing.assert_allclose(signals.smooth(line, 1e-3)[20:-20], line[20:-20], atol=1.01 * (line[1] - line[0]))


def test_an_ensemble_tells_the_fallen_from_the_others(walk, pushed, tmp_path):
    fallen = dataclasses.replace(walk, log=walk.log[:700], end="fell", cause="fell forward at 0.700 s")
    figure = curves.ensemble([walk, pushed, fallen], "three")
    axes = figure.axes[0]
    long = [line for line in axes.lines if len(line.get_xdata()) > 1]
    assert [to_hex(line.get_color()).upper() for line in long] == [RIGHT, RIGHT, LEFT]
    assert long[2].get_xdata()[-1] < 0.7
    plot_ensemble([walk, pushed, fallen], tmp_path / "many.png", "three")
    assert image.imread(tmp_path / "many.png").shape[1] > 800


def test_short_and_diverged_runs_are_drawn_too(walk, tmp_path):
    log = walk.log[:40].copy()
    log[-1, 1:19] = np.nan
    short = dataclasses.replace(walk, log=log, end="diverged")
    assert len(plot_run(short, tmp_path, title="short", window=WINDOW)) == 5


def test_files_that_cannot_be_written_are_an_error_in_words(walk, tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="file: cannot be made: File exists"):
        plot_run(walk, tmp_path / "file", title="nowhere", window=WINDOW)
    with pytest.raises(InputError, match=r"many.png: cannot be written: No such file"):
        plot_ensemble([walk], tmp_path / "nowhere" / "many.png", "nowhere")
