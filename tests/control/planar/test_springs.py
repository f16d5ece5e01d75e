"""Q_d against the matrices of (3.16)-(3.17), built literally in absolute coordinates."""

from __future__ import annotations

import numpy as np
import pytest

from biped.scenario.devices import Actuation
from biped.scenario.gains import Gains
from biped.scenario.keys import Scenario
from biped.scenario.world import Ground
from tests.ticks import OFFSET, Bench, S, states

TABLE_3_2 = {  # normal gait: k_d1, k_d2 … k_d4 by leg state 1 … 4
    "k": (400.0, (700.0, 70.0, 70.0, 0.0), (30.0, 30.0, 0.0, 30.0), (20.0, 20.0, 5.0, 5.0)),
    "b": (50.0, (300.0, 1.0, 1.0, 0.0), (5.0, 5.0, 1.0, 5.0), (15.0, 15.0, 1.0, 1.0)),
    "theta_l": np.radians([68.0, 122.0, 122.0, 122.0]),
    "theta_a": np.radians([0.0, 0.0, 10.0, 0.0]),
}


def matrix(gains, right: int, left: int) -> np.ndarray:
    """(3.17) for leg states 1 … 4 of the right and left leg."""
    k1, k2, k3, k4 = gains
    K = np.zeros((9, 7))
    K[2, 0] = k1
    for row, column, s in ((3, 1, right - 1), (6, 4, left - 1)):
        K[row, column], K[row, column + 1] = k2[s], -k3[s]
        K[row + 1, column + 1], K[row + 1, column + 2] = k3[s], -k4[s]
        K[row + 2, column + 2] = k4[s]
    return K


def wanted(q_abs, v_abs, right: int, left: int, knees) -> np.ndarray:
    """(3.16) in absolute coordinates."""

    def feedback(x):
        return np.array([x[2], x[3], x[4] - x[3], x[5] - x[4], x[6], x[7] - x[6], x[8] - x[7]])

    phi = feedback(q_abs) + np.array([0, 0, 0, np.pi / 2, 0, 0, np.pi / 2])
    l, a = TABLE_3_2["theta_l"], TABLE_3_2["theta_a"]
    knee = np.radians(knees)
    phi_d = np.array(
        [np.radians(87.5), l[right - 1], knee[right - 1], a[right - 1], l[left - 1], knee[left - 1], a[left - 1]]
    )
    K, B = matrix(TABLE_3_2["k"], right, left), matrix(TABLE_3_2["b"], right, left)
    return -K @ (phi - phi_d) - B @ feedback(v_abs)


@pytest.mark.parametrize(
    ("slope", "angles", "tilt", "knees"),
    [(0.0, "gravity", 0.0, None), (5.0, "gravity", 5.0, None), (5.0, "slope", 0.0, None),
     (0.0, "gravity", 0.0, (-12.0, -30.0, -50.0, -7.0))],
)  # fmt: skip
def test_desired_forces(slope, angles, tilt, knees):
    """Absolute angles are measured from gravity (the slope frame's plus the slope) or from the slope's normal."""
    bench = Bench(
        Scenario(
            actuation=Actuation(torque_limit=1e9),
            ground=Ground(slope=slope, angles=angles),
            gains=Gains(theta_k=knees),
        )
    )
    seen = set()
    for q, v in states(150, 30):
        bench.tick(q, v)
        q_abs, v_abs = np.linalg.solve(S, q - OFFSET), np.linalg.solve(S, v)
        q_abs[2:] += np.radians(tilt)
        right, left = bench.c["memory"]["phase"] + 1
        seen.add((int(right), int(left)))
        expected = np.linalg.inv(S).T @ wanted(
            q_abs, v_abs, right, left, knees or (0.0,) * 4
        )  # Q_joint · v_joint = Q_abs · v_abs
        # Ankle springs act on the joint angle, which a common tilt leaves alone.
        np.testing.assert_allclose(bench.c["tick"]["Q_d"], expected, atol=1e-10)
    assert len(seen) > 6
