"""What a law of a robot of any kind is told is not what is true: sensors, and a robot that is not its file's."""

from __future__ import annotations

import math

import numpy as np
import pytest

from biped.base.errors import InputError
from biped.engines.mujoco import simulate
from biped.measure.metrics import assess
from biped.robot.build import compiled
from biped.scenario.reading import read_scenario
from biped.studies.run import plan_of
from tests.engines.test_mujoco import law_of, named, stood

TOLD = """    def __init__(self, setup):
        self.n = len(setup.torque_limit)
        self.names = [f"told_{i}" for i in range(len(setup.q) + len(setup.v) + 5)]
        self.signals = dict.fromkeys(self.names, 0.0)
        self.mass = setup.model.body_mass.sum()

    def torques(self, sensed):
        base = sensed.base
        told = (*sensed.q, *sensed.v, *base.angular_velocity, self.mass, sensed.M[0, 0])
        self.signals = dict(zip(self.names, map(float, told), strict=True))
        return np.zeros(self.n)
"""


def told(tmp_path, model: str, *changes: str):
    """A short run of a limp robot, and what its law was told: coordinates, velocities and the rest, a row a tick."""
    law = law_of(tmp_path, TOLD)
    t = simulate(plan_of(named(model), (law, "duration=0.2", "fall.height=0.01", "fall.tilt=180", *changes)).run(0))
    values = np.stack(list(t.signals.values()), axis=1)
    nq, nv = t.q.shape[1], t.v.shape[1]
    return t, values[:, :nq], values[:, nq : nq + nv], values[:, nq + nv :]


def test_without_sensors_it_is_told_the_truth(tmp_path):
    t, q, v, _ = told(tmp_path, "walker2d")
    np.testing.assert_array_equal(q, t.q)
    np.testing.assert_array_equal(v, t.v)


@pytest.mark.parametrize("model", ["walker2d", "humanoid"])
def test_late_by_whole_ticks(tmp_path, model):
    t, q, v, _ = told(tmp_path, model, "sensors.delay=0.007")
    np.testing.assert_allclose(q[7:], t.q[:-7], atol=1e-12)
    np.testing.assert_allclose(v[7:], t.v[:-7], atol=1e-12)
    np.testing.assert_allclose(q[:8], np.tile(t.q[0], (8, 1)), atol=1e-12)


def test_noise_is_on_hinges_and_base_as_large_as_it_says(tmp_path):
    t, q, v, _ = told(tmp_path, "humanoid", "sensors={angle_noise=0.01,rate_noise=0.1,height_noise=0.002}")
    off = q - t.q
    assert off[:, :3].std() == pytest.approx(0.002, rel=0.15)
    assert off[:, 7:].std() == pytest.approx(0.01, rel=0.05)
    # A small turn is twice the vector part of its quaternion.
    assert 2.0 * off[:, 4:7].std() == pytest.approx(0.01, rel=0.2)
    np.testing.assert_allclose(np.linalg.norm(q[:, 3:7], axis=1), 1.0, atol=1e-12)
    assert np.abs((v - t.v)[:, :3]).max() == 0.0
    assert (v - t.v)[:, 3:].std() == pytest.approx(0.1, rel=0.05)
    assert abs(np.corrcoef(off[1:, 7], off[:-1, 7])[0, 1]) < 0.25


def test_encoders_round_the_joints_and_have_zeros_of_their_own(tmp_path):
    t, q, _, _ = told(tmp_path, "walker2d", "sensors.quantisation=0.02")
    np.testing.assert_array_equal(q[:, :3], t.q[:, :3])
    np.testing.assert_allclose(q[:, 3:] / 0.02, np.rint(q[:, 3:] / 0.02), atol=1e-9)
    assert 0.009 < np.abs(q - t.q).max() <= 0.01 + 1e-12
    t, q, _, _ = told(tmp_path, "walker2d", "sensors.zero_error=0.05")
    off = q - t.q
    np.testing.assert_allclose(off, np.tile(off[0], (len(off), 1)), atol=1e-12)
    assert (off[0, :3] == 0.0).all()
    assert 0.01 < np.abs(off[0, 3:]).max() < 0.2


@pytest.mark.parametrize("model", ["walker2d", "humanoid"])
def test_a_gyro_measures_how_the_base_turns(tmp_path, model):
    fine = "sensors.gyro={noise=0.0,cutoff=1e6,range=1e6,bias=0.0}"
    t, q, v, rest = told(tmp_path, model, fine)
    np.testing.assert_allclose(q, t.q, atol=1e-12)
    np.testing.assert_allclose(v, t.v, atol=1e-9)
    about = slice(2, 3) if model == "walker2d" else slice(3, 6)
    biased = told(tmp_path, model, fine.replace("bias=0.0", "bias=3.0"))
    np.testing.assert_allclose(biased[2][:, about] - biased[0].v[:, about], math.radians(3.0), atol=1e-9)
    assert np.abs(np.delete(biased[2] - biased[0].v, about, axis=1)).max() == 0.0
    assert rest[:, :3].any()
    clipped = told(tmp_path, model, fine.replace("range=1e6", "range=5.0"))
    assert np.abs(clipped[2][:, about]).max() == pytest.approx(math.radians(5.0))
    noisy = told(tmp_path, model, fine.replace("noise=0.0", "noise=0.1"))
    # Density d sampled at 1 kHz: d sqrt(f / 2).
    assert (noisy[2] - noisy[0].v)[:, about].std() == pytest.approx(math.radians(0.1) * math.sqrt(500.0), rel=0.2)


def test_a_filtered_gyro_lags_by_its_time_constant(tmp_path):
    t, _, v, _ = told(tmp_path, "walker2d", "sensors.gyro={noise=0.0,cutoff=5.0,range=1e6,bias=0.0}")
    follow = 1.0 - math.exp(-2.0 * math.pi * 5.0 * 1e-3)
    expected = np.empty(len(t))
    at = t.v[0, 2]
    for k, rate in enumerate(t.v[:, 2]):
        at += follow * (rate - at)
        expected[k] = at
    np.testing.assert_allclose(v[:, 2], expected, atol=1e-12)


def test_the_same_seed_measures_the_same(tmp_path):
    noisy = ("sensors={angle_noise=0.01,rate_noise=0.1,zero_error=0.01,gyro={}}",)
    first, again = told(tmp_path, "walker2d", *noisy), told(tmp_path, "walker2d", *noisy)
    assert first[0].log.tobytes() == again[0].log.tobytes()
    assert told(tmp_path, "walker2d", *noisy, "seed=1")[0].log.tobytes() != first[0].log.tobytes()


def test_a_law_knows_the_file_and_not_the_truth(tmp_path):
    truth = "truth.part=[{name='torso',mass=1.5,inertia=2.0,shift=[0.02,0.0,0.01]}]"
    t, _, _, rest = told(tmp_path, "h1", truth)
    file = stood("h1")
    torso = file.robot.masses[file.robot.bodies.index("torso")]
    assert t.robot.mass == pytest.approx(file.robot.mass + 0.5 * torso)
    np.testing.assert_allclose(rest[:, 3:5], file.robot.mass, rtol=1e-9)  # what it sums up, and M[0, 0]
    moved = 1.5 * torso * np.array([0.02, 0.0, 0.01]) + 0.5 * torso * _place(file, "torso")
    centre = (file.robot.mass * file.com[0] + moved) / t.robot.mass
    np.testing.assert_allclose(t.com[0], centre, atol=1e-6)
    numbers, plainly = (assess(one, (0.0, 0.2)).numbers for one in (t, told(tmp_path, "h1")[0]))
    assert numbers["momentum_residual"] < 1e-3
    assert numbers["energy_residual"] < 1.5 * plainly["energy_residual"] < 0.02, "of a limp robot that collapses"
    s = read_scenario(named("h1"), [truth])
    plain, true = (compiled(plan_of(named("h1"), c).model, read_scenario(named("h1"), c), "torque")
                   for c in ([], [truth]))  # fmt: skip
    number = plain.body("torso").id
    np.testing.assert_allclose(true.body_inertia[number], 3.0 * plain.body_inertia[number])
    others = np.arange(plain.nbody) != number
    np.testing.assert_allclose(true.body_inertia[others], plain.body_inertia[others], rtol=1e-12)
    assert s.truth.part[0].mass == 1.5


def _place(t, body: str) -> np.ndarray:
    """(3,) [m] centre of mass of a body at the start."""
    import mujoco

    plan = plan_of(named(t.robot.name), ())
    model = compiled(plan.model, plan.scenario, "torque")
    data = mujoco.MjData(model)
    data.qpos[:] = t.q[0]
    mujoco.mj_kinematics(model, data)
    return data.xipos[model.body(body).id].copy()


def test_damping_is_that_of_the_joints_alone():
    plans = [plan_of(named("walker2d"), changes) for changes in ((), ("truth.joint_damping=0.3",))]
    plain, true = (compiled(plan.model, plan.scenario, "torque") for plan in plans)
    more = (true.dof_damping - plain.dof_damping).reshape(true.nv, -1)[:, 0]
    np.testing.assert_allclose(more, [0.0, 0.0, 0.0, *(0.3,) * 6], atol=1e-12)


def test_it_stands_with_sensors_and_wrong_masses():
    changes = (
        "sensors={angle_noise=1e-4,rate_noise=1e-3,delay=0.002,gyro={}}",
        "truth.part=[{name='torso',mass=1.05}]",
        "truth.joint_damping=0.05",
    )
    assert stood("h1", *changes).end == "completed"


def test_each_wrong_mass_can_be_drawn():
    plan = plan_of(named("h1"), ("truth.part=[{name='torso'}]", "randomise.runs=3",
                                 'randomise.draw={"truth.part.0.mass"={uniform=[0.9,1.1]}}'))  # fmt: skip
    masses = [plan.run(i).scenario.truth.part[0].mass for i in range(3)]
    assert len(set(masses)) == 3
    assert all(0.9 <= mass <= 1.1 for mass in masses)


@pytest.mark.parametrize(
    ("scenario", "change", "words"),
    [
        ("h1", "sensors.encoders={}", r"sensors.encoders: expected none: law 'stand' takes no notice"),
        ("h1", "sensors.switches={}", r"sensors.switches: expected none: law 'stand' takes no notice"),
        ("h1", "truth.hip_mass=0.1", r"truth.hip_mass: expected 0.0: law 'stand' takes no notice"),
        ("h1", "estimator={}", r"estimator: expected none: law 'stand' takes no notice"),
        ("h1", "truth.part=[{name='tors'}]", r"truth.part\[0\].name: model 'h1' has no body 'tors'; .*torso"),
        ("h1", "truth.part=[{name='torso'},{name='torso'}]", r"truth.part\[1\].name: 'torso' is named twice"),
        ("h1", "truth.part=[{name='torso',weight=2}]", r"truth.part\[0\].weight: unknown key"),
        ("", "sensors.zero_error=0.1", r"sensors.zero_error: belongs to robots of any kind"),
        ("", "truth.part=[{name='torso'}]", r"truth.part: belongs to robots of any kind"),
        ("", "ground.side_slope=3", r"ground.side_slope: belongs to robots of any kind"),
    ],
)  # fmt: skip
def test_what_is_refused(scenario, change, words):
    with pytest.raises(InputError, match=words):
        plan_of(named(scenario) if scenario else "level_normal", (change,))
