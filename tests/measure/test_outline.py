"""What a walker stands on."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from biped.measure.metrics.gait import outline


def test_outlines_are_convex_hulls():
    rng = np.random.default_rng(3)
    for count in (3, 4, 8, 30):
        points = rng.standard_normal((count, 2))
        hull = ConvexHull(points)
        found = outline(points)
        assert sorted(map(tuple, found)) == sorted(map(tuple, points[hull.vertices]))
        x, y = found.T
        area = 0.5 * float(x @ np.roll(y, -1) - np.roll(x, -1) @ y)
        assert area == pytest.approx(hull.volume)  # anticlockwise


def test_outlines_of_what_has_no_area():
    assert outline(np.empty((0, 2))).shape == (0, 2)
    assert outline(np.array([[1.0, 2.0]])).tolist() == [[1.0, 2.0]]
    row = np.array([[0.0, 0.0], [1.0, 1.0], [0.5, 0.5], [0.0, 0.0]])
    assert outline(row).tolist() == [[0.0, 0.0], [1.0, 1.0]]
