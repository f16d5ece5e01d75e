"""The line of the ground: where its corners are, how high it is between them, and that a seed fixes it."""

from __future__ import annotations

import numpy as np
import pytest

from biped.base.errors import InputError
from biped.ensemble.plan import Plan
from biped.robot.ground import (
    GROUND,
    KNOTS,
    LEVEL,
    height_below,
    piece_below,
    profile_from,
    profile_of,
    rise_of,
    set_ground,
)
from biped.scenario.keys import Scenario
from biped.scenario.world import Ground, Steps, Tiles

TILES = Ground(tiles=Tiles(height=0.03, length=0.4, ramp=0.1, start=1.0, number=5))
STAIRS = Ground(steps=Steps(rise=0.1, run=0.5, ramp=0.05, start=2.0, number=2, back=True))


def record(profile):
    out = np.zeros(1, GROUND)
    set_ground(out[0], profile)
    return out[0]


def test_steps_up_and_back_down():
    p = profile_of(STAIRS, 0)
    np.testing.assert_allclose(p.x, [2.0, 2.05, 2.5, 2.55, 3.0, 3.05, 3.5, 3.55])
    np.testing.assert_allclose(p.z, [0.0, 0.1, 0.1, 0.2, 0.2, 0.1, 0.1, 0.0])


def test_tiles_are_level_within_their_height_and_end_level():
    p = profile_of(TILES, 7)
    at = np.array([1.3, 1.7, 2.1, 2.5, 2.9])
    heights = p.height(at)
    assert np.abs(heights).max() <= 0.03
    assert np.abs(np.diff(heights)).min() > 0.0
    np.testing.assert_array_equal(p.height(at - 0.15), heights)  # from the end of a tile's ramp to its own end
    np.testing.assert_allclose(p.height(np.array([1.45])), heights[:2].mean())  # half-way up the ramp
    np.testing.assert_array_equal(p.height(np.array([-9.0, 0.9, 3.2, 99.0])), 0.0)


def test_a_seed_fixes_the_tiles_and_their_height_only_scales_them():
    a, again, other = profile_of(TILES, 7), profile_of(TILES, 7), profile_of(TILES, 8)
    np.testing.assert_array_equal(a.z, again.z)
    assert np.abs(a.z - other.z).max() > 1e-3
    twice = profile_of(Ground(tiles=Tiles(height=0.06, length=0.4, ramp=0.1, start=1.0, number=5)), 7)
    np.testing.assert_allclose(twice.z, 2.0 * a.z)


def test_tiles_and_steps_add_up():
    both = Ground(tiles=TILES.tiles, steps=STAIRS.steps)
    x = np.linspace(0.0, 5.0, 501)
    np.testing.assert_allclose(
        profile_of(both, 3).height(x), profile_of(TILES, 3).height(x) + profile_of(STAIRS, 3).height(x), atol=1e-15
    )


def test_kernels_agree_with_the_line():
    p = profile_of(Ground(tiles=TILES.tiles, steps=STAIRS.steps), 3)
    r = record(p)
    x = np.concatenate([np.linspace(0.0, 5.0, 777), p.x])
    np.testing.assert_allclose([height_below(r, at) for at in x], p.height(x), atol=1e-15)
    for at in x[:777]:
        ahead = (p.height(np.array([at + 1e-9]))[0] - p.height(np.array([at]))[0]) / 1e-9
        assert rise_of(r, piece_below(r, at)) == pytest.approx(ahead, abs=1e-5)
    assert height_below(record(LEVEL), 3.0) == 0.0


def test_the_largest_ground_fits():
    largest = Ground(
        tiles=Tiles(height=0.01, number=400, length=0.3), steps=Steps(rise=0.01, number=50, back=True, start=1.01)
    )
    p = profile_of(largest, 0)
    assert 900 < len(p.x) <= KNOTS
    assert (np.diff(p.x) > 0.0).all()


@pytest.mark.parametrize(
    "kept", [[[1.0], [1.0, 2.0]], [[2.0, 1.0], [0.0, 0.0]], [[], []], [[0.0, np.nan], [0.0, 0.0]], [[[1.0]], [[1.0]]]]
)
def test_what_is_no_ground(kept):
    with pytest.raises(ValueError, match="ground"):
        profile_from(kept)


@pytest.mark.parametrize(
    ("ground", "key"),
    [
        (Ground(tiles=Tiles(height=0.01, start=0.2)), "ground.tiles.start"),
        (Ground(steps=Steps(rise=-0.01, start=-1.0)), "ground.steps.start"),
    ],
)
def test_nobody_starts_on_a_step(ground, key):
    with pytest.raises(InputError, match=rf"{key}: expected a place beyond the feet.*0\.\d\d\d m") as error:
        Plan(Scenario(ground=ground))
    assert error.value.key == key
