"""The disturbance observer finds joint torques that the law does not know: in closed form, and in a walk."""

from __future__ import annotations

import numpy as np
import pytest

from biped.base.jit import kernel
from biped.control.planar.observer import observe
from biped.control.planar.sensing import sense_links
from biped.control.planar.setup import controller_record
from biped.engines.planar import mujoco
from biped.robot.planar.kinematics import mass_matrix, point_row
from biped.robot.planar.topology import BASE, N_POINTS, NQ, NU
from biped.robot.unmodelled import torques_at, unmodelled_of
from biped.studies.run import plan_of

TICK, K = 1e-3, 200.0
BENT = np.array([0.0, 0.9, 0.1, 0.3, -0.5, 0.2, -0.4, -0.3, 0.1])


@kernel
def follow(record, q, v, u, out):
    """Has an observer look at a walk (n, 9), (n, 9) under torques (n, 6); writes what it believes at each tick."""
    c = record[0]
    for k in range(len(q)):
        sense_links(c, q[k], v[k])
        mass_matrix(c["tree"], c["at"], c["work"]["M"])
        observe(c, c["work"]["M"], q[k], v[k], k == 0)
        for j in range(NU):
            out[k, j], c["observer"]["applied"][j] = c["observer"]["estimate"][j], u[k, j]


class Scene:
    """A walker in a posture, moved by known forces for an instant at a time."""

    def __init__(self):
        run = plan_of("upright/own", [f"actuation.observer={K}"]).run(0)
        self.record = controller_record(run, run.tree)
        self.c = c = self.record[0]
        self.v = np.zeros(NQ)
        sense_links(c, BENT, self.v)
        mass_matrix(c["tree"], c["at"], c["work"]["M"])
        full = np.array(c["work"]["M"])
        self.M = np.triu(full) + np.triu(full, 1).T
        self.o, self.limit = c["observer"], np.array(c["actuation"]["limit"])
        self.rows = np.zeros((N_POINTS, 2, NQ))
        for point in range(N_POINTS):
            for direction in range(2):
                point_row(c["at"], point, direction, self.rows[point, direction])

    def ticks(self, number: int, disturbance: np.ndarray, forces: np.ndarray, touching: tuple[int, ...]) -> np.ndarray:
        """The estimate after some ticks in the same state under a constant disturbance and forces (4, 2) of points."""
        c = self.c
        torque = np.linspace(-10.0, 10.0, NU)
        for k in range(number + 1):
            c["tick"]["height"] = [0.0 if point in touching else 0.1 for point in range(N_POINTS)]
            observe(c, c["work"]["M"], BENT, self.v, k == 0)
            h = np.array(c["tick"]["h"])
            force = np.zeros(NQ)
            force[BASE:] = torque + disturbance
            force += np.einsum("pd,pdj->j", forces, self.rows)
            # What it saw last it forgets: only the change in a tick counts, so the state can stay where it is.
            self.o["v"][:] = self.v - TICK * np.linalg.solve(self.M, force - h)
            self.o["applied"][:] = torque
        return np.array(self.o["estimate"])


DISTURBANCE = np.array([4.0, -3.0, 2.0, -1.0, 5.0, -6.0])


@pytest.mark.parametrize("touching", [(), (0, 1), (1,), (2, 3), (2,)])
def test_a_constant_torque_is_found_with_the_bandwidth_whatever_touches_of_one_foot(touching):
    forces = np.zeros((N_POINTS, 2))
    for point in touching:
        forces[point] = 400.0 + 50.0 * point, 80.0 - 30.0 * point
    for number in (1, 5, 20):
        found = Scene().ticks(number, DISTURBANCE, forces, touching)
        np.testing.assert_allclose(found, DISTURBANCE * (1.0 - np.exp(-K * TICK * number)), rtol=1e-8)


def test_of_two_feet_on_a_point_each_all_is_found_but_what_makes_them_push_each_other():
    scene, forces = Scene(), np.zeros((N_POINTS, 2))
    forces[0], forces[3] = (300.0, 40.0), (350.0, -20.0)
    found = scene.ticks(60, DISTURBANCE, forces, (0, 3))
    # Along the line through both points opposite forces move nothing: the torques that they stand for cannot be seen.
    between = scene.c["at"]["point"][3] - scene.c["at"]["point"][0]
    unseen = (between[::-1, None] * (scene.rows[3] - scene.rows[0])).sum(0)
    assert np.abs(unseen[:BASE]).max() < 1e-9 * np.abs(unseen).max()
    unseen = unseen[BASE:] / np.linalg.norm(unseen[BASE:])
    error = found - DISTURBANCE
    assert abs(unseen @ error) > 0.3, "the test says nothing where that part happens to be small"
    assert np.abs(error - (unseen @ error) * unseen).max() < 0.02 * abs(unseen @ error)
    assert abs(unseen @ found) < 0.02 * np.linalg.norm(found)


def test_no_more_is_believed_than_half_a_limit_and_a_knee_at_its_stop_says_nothing():
    scene = Scene()
    found = scene.ticks(100, scene.limit, np.zeros((N_POINTS, 2)), ())
    np.testing.assert_allclose(found, 0.5 * scene.limit)
    straight = BENT.copy()
    straight[4] = 0.0
    scene.o["estimate"] = 0.0
    for _ in range(2):
        observe(scene.c, scene.c["work"]["M"], straight, scene.v, False)
    assert scene.o["estimate"][1] == 0.0
    assert (np.delete(scene.o["estimate"], 1) != 0.0).all()


def test_a_walk_shows_the_torques_that_nobody_modelled():
    asked = ["truth.unmodelled.torque=0.05", "actuation.observer=400.0", "duration=2.0"]
    run = plan_of("upright/own", asked).run(0)
    t, (made,) = mujoco.simulate(run), unmodelled_of(run)
    true = np.zeros_like(t.u)
    for k in range(len(t)):
        torques_at(made, t.q[k, BASE:], t.v[k, BASE:])
        true[k] = made.added
    assert len(t) == 2000, "fell"
    record = controller_record(run, run.tree)
    # What is logged is the sum, within the limit: at the limit, what the law asked for is not known.
    clipped = (np.abs(t.u) > np.array(record[0]["actuation"]["limit"]) - 1e-6).any(1)
    assert clipped.sum() < 40
    found = np.zeros_like(t.u)
    follow(record, *(np.array(a) for a in (t.q, t.v, t.u - true)), found)
    on = (t.height.reshape(-1, 2, 2) < 2e-4).any(2)
    one = ~(on[1:].all(1) | on[:-1].all(1)) & (np.convolve(clipped, np.ones(40))[1 : len(t)] == 0.0)
    assert one.sum() > 800
    for joint in (0, 2, 3, 5):  # knees rest on their stops for a while
        error = (found[1:] - true[:-1])[one, joint]
        assert np.sqrt((error[100:] ** 2).mean()) < 0.2 * np.sqrt((true[:, joint] ** 2).mean())
