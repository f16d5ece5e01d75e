"""What holds for any physical biped: checked over random ones, in random states (seeded, so that a failure repeats)."""

from __future__ import annotations

import atexit
import dataclasses
import shutil
import tempfile
from functools import lru_cache
from pathlib import Path

import mujoco
import numpy as np
import pinocchio
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from biped.base.files import folder
from biped.ensemble.campaign import simulate
from biped.measure.metrics import measure
from biped.robot.columns import COLUMNS
from biped.robot.planar.description import description_at
from biped.robot.planar.model import spec_of
from biped.robot.planar.order import believed_model
from biped.robot.planar.tree import apply_truth
from biped.scenario.devices import Actuation
from biped.scenario.keys import Scenario, Start, Truth
from biped.scenario.metrics import METRICS
from biped.studies.run import plan_of
from tests.ticks import Bench, E, well_ranked

FEW = settings(max_examples=25, deadline=None, derandomize=True)
SEED = st.integers(0, 2**32 - 1)


HERE = Path(tempfile.mkdtemp(prefix="biped-properties-"))
atexit.register(shutil.rmtree, HERE, ignore_errors=True)


@lru_cache(maxsize=64)
def random_biped(seed: int, decades: float) -> tuple[Path, mujoco.MjModel, pinocchio.Model]:
    """A biped of random masses (over 2 × `decades`), inertias and lengths, read by both libraries from one file."""
    rng = np.random.default_rng(seed)
    truth = Truth(
        mass=tuple(10.0 ** rng.uniform(-decades, decades, 7)),
        inertia=tuple(10.0 ** rng.uniform(-0.5, 0.5, 7)),
        length=tuple(2.0 ** rng.uniform(-1, 1, 7)),
    )
    spec = spec_of(folder("models") / "human.xml")
    apply_truth(spec, truth, description_at(folder("models") / "human.xml"))
    for light in list(spec.lights):
        spec.delete(light)
    spec.compile()
    path = HERE / f"biped-{seed}-{decades:g}.xml"
    path.write_text(spec.to_xml(), encoding="utf-8")
    return path, mujoco.MjModel.from_xml_path(str(path)), believed_model(path, 0.0)


def state_of(model: mujoco.MjModel, q: np.ndarray, v: np.ndarray):
    """M (9, 9), h (9,), the points' Jacobian (8, 9) and heights (4,) of MuJoCo."""
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:] = q, v
    mujoco.mj_forward(model, data)
    M, J = np.zeros((9, 9)), np.zeros((8, 9))
    mujoco.mj_fullM(model, data, M)
    sites = [model.site(point).id for point in description_at(folder("models") / "human.xml").points]
    for i, site in enumerate(sites):
        whole = np.zeros((3, 9))
        mujoco.mj_jacSite(model, data, whole, None, site)
        J[2 * i], J[2 * i + 1] = whole[2], whole[0]
    return M, data.qfrc_bias.copy(), J, data.site_xpos[sites, 2].copy()


@given(SEED, SEED)
@FEW
def test_mass_matrix_is_positive_definite_and_the_same_in_both_libraries(seed, state):
    rng = np.random.default_rng(state)
    _, model, believed = random_biped(seed % 20, 3.0)
    q, v = rng.uniform(-2.0, 2.0, 9), 3.0 * rng.standard_normal(9)
    M, h, _, _ = state_of(model, q, v)
    mine = believed.createData()
    other = np.triu(pinocchio.crba(believed, mine, q))
    other = other + np.triu(other, 1).T
    other_h = pinocchio.nonLinearEffects(believed, mine, q, v)
    scale = np.sqrt(np.outer(np.diag(M), np.diag(M)))  # each entry in its own unit, over six orders of magnitude
    assert (np.abs(M - other) / scale).max() < 1e-6  # the file holds six to eight digits of what MuJoCo compiled
    assert pytest.approx(M.T) == M
    assert np.linalg.eigvalsh(M / scale).min() > 0.0
    assert np.abs(h - other_h).max() < 1e-5 * np.abs(h).max()


@given(SEED, SEED, st.integers(0, 4))
@settings(FEW, max_examples=60)
def test_torques_of_3_15_are_optimal_and_their_projector_is_one(seed, state, touching):
    """No change of u brings N R⁻ᵀ E u nearer to N R⁻ᵀ Q_d: the gradient vanishes; N = N², N = Nᵀ, C N = 0."""
    rng = np.random.default_rng(state)
    path, model, _ = random_biped(seed % 20, 0.5)
    actuation = Actuation(torque_limit=1e9)
    bench = Bench(Scenario(model=str(path), actuation=actuation, start=Start(settle=False)))
    q, v = rng.normal(0.0, 0.4, 9), rng.standard_normal(9)
    q[[4, 7]] = -np.abs(q[[4, 7]]) * (rng.random(2) < 0.7)
    height = np.sort(state_of(model, q, v)[3])
    q[1] -= height[0] - 0.01 if touching == 0 else height[touching - 1]
    u = bench.tick(q, v)
    M, _, J, _ = state_of(model, q, v)
    knees = np.eye(9)[[4, 7]]
    A = np.vstack([J[np.repeat(np.array(bench.active[:4]) > 0, 2)], knees[np.array(bench.active[4:]) > 0]])
    assume(well_ranked(M, A))
    R_T = np.linalg.inv(np.linalg.cholesky(M))  # R⁻ᵀ, with M = RᵀR
    C = A @ R_T.T
    N = np.eye(9) - np.linalg.pinv(C, rcond=1e-4) @ C if len(A) else np.eye(9)
    assert np.abs(N @ N - N).max() < 1e-10
    assert np.abs(N - N.T).max() < 1e-10
    assert np.abs(C @ N).max(initial=0.0) < 1e-3 * np.abs(C).max(
        initial=1.0
    )  # below the rank tolerance nothing is said
    B, wanted = N @ R_T @ E, N @ R_T @ bench.c["tick"]["Q_d"]
    gradient = B.T @ (B @ u - wanted)
    assert np.abs(gradient).max() < 1e-7 * np.linalg.norm(B) * np.linalg.norm(R_T @ bench.c["tick"]["Q_d"])


@lru_cache(maxsize=1)
def walk():
    return simulate(plan_of("level_normal", ["duration=4.0", "window.start=1.0", "window.end=4.0"]).run(0))


def same(one: dict, other: dict) -> None:
    for name in METRICS:
        assert other[name] == pytest.approx(one[name], rel=1e-6, abs=1e-9, nan_ok=True), name


@given(st.floats(-1e3, 1e3))
@settings(FEW, max_examples=5)
def test_metrics_do_not_depend_on_the_origin(shift):
    t = walk()
    moved = dataclasses.replace(t, log=t.log.copy())
    moved.q[:, 0] += shift
    same(measure(t, (1.0, 4.0)), measure(moved, (1.0, 4.0)))


def test_metrics_do_not_depend_on_which_leg_is_called_right():
    t = walk()
    order = {
        "q": [0, 1, 2, 6, 7, 8, 3, 4, 5], "u": [3, 4, 5, 0, 1, 2], "phase": [1, 0], "believed": [2, 3, 0, 1],
        "active": [2, 3, 0, 1, 5, 4], "height": [2, 3, 0, 1], "force": [2, 3, 0, 1], "stop": [1, 0],
    }  # fmt: skip
    order["v"] = order["Q_d"] = order["q"]
    assert order.keys() | {"time"} == COLUMNS.keys()
    mirrored = dataclasses.replace(t, log=t.log.copy())
    for name, columns in order.items():
        mirrored.column(name)[:] = t.column(name)[:, columns]
    assert not np.array_equal(mirrored.log, t.log)
    same(measure(t, (1.0, 4.0)), measure(mirrored, (1.0, 4.0)))
