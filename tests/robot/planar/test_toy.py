"""A second robot from a description and a model file alone, and the human with its parts in another order."""

from __future__ import annotations

import mujoco
import numpy as np
import pinocchio
import pytest

from biped.base.trust import trusting
from biped.engines import home
from biped.engines.home import rigid_record
from biped.engines.planar import mujoco as foreign
from biped.engines.rigid.motion import active_rows, mass_and_bias, place
from biped.ensemble.plan import Plan
from biped.measure.metrics import measure
from biped.measure.metrics.walking import walked
from biped.measure.stored import load
from biped.measure.trajectory import Trajectory
from biped.robot.columns import COLUMNS
from biped.robot.load import load_robot
from biped.robot.planar.build import compile_foreign
from biped.robot.planar.description import description_at
from biped.robot.planar.model import posture_of, tree_at
from biped.robot.planar.order import believed_model, pinocchio_tree
from biped.robot.planar.topology import N_CONSTRAINTS, N_POINTS, NQ
from biped.scenario.keys import Scenario
from biped.scenario.reading import read_scenario
from tests.robot.planar.toy import make, shuffled_human

SLOPE = 4.0
ENGINES = {"mujoco": foreign.simulate, "home": home.simulate}


@pytest.fixture(scope="module")
def toy(tmp_path_factory):
    return make(tmp_path_factory.mktemp("toy"))


def scenario(model, text: str = ""):
    path = model.with_name("scenario.toml")
    gait = 'controller = "gait.toml"' if model.with_name("gait.toml").is_file() else ""
    path.write_text(f'model = "{model.name}"\nduration = 0.3\n{gait}\n{text}', encoding="utf-8")
    return read_scenario(str(path))


def test_nothing_is_where_the_human_has_it(toy):
    order = compile_foreign(toy, scenario(toy)).order
    assert not order.canonical
    assert order.joints.tolist() == [0, 1, 2, 6, 7, 8, 3, 4, 5]
    assert order.actuators.tolist() == [5, 4, 3, 2, 1, 0]
    assert order.stops.tolist() == [1, 0]
    assert order.contacts.tolist() != [0, 1, 2, 3]


@pytest.mark.parametrize("make_model", [make, shuffled_human])
def test_three_libraries_agree_on_mass_bias_and_rows(make_model, tmp_path):
    """M, h and A of Pinocchio, the compiled tree and MuJoCo, to 1e-12 of their scale."""
    path = make_model(tmp_path)
    robot = description_at(path)
    theirs, order, *_ = compile_foreign(path, scenario(path, f"ground.slope = {SLOPE}"))
    data = mujoco.MjData(theirs)
    model = believed_model(path, SLOPE)
    work, w = model.createData(), rigid_record(pinocchio_tree(model, description_at(path)), SLOPE)[0]
    rng = np.random.default_rng(3)
    for _ in range(100):
        q, v = rng.uniform(-2.0, 2.0, NQ), rng.uniform(-5.0, 5.0, NQ)
        data.qpos[order.joints], data.qvel[order.joints] = q, v
        mujoco.mj_forward(theirs, data)
        M = np.zeros((NQ, NQ))
        mujoco.mj_fullM(theirs, data, M)
        M = M[np.ix_(order.joints, order.joints)]
        h = data.qfrc_bias[order.joints]
        A = np.zeros((2 * N_POINTS, NQ))
        for i, point in enumerate(robot.points):
            J = np.zeros((3, NQ))
            mujoco.mj_jacSite(theirs, data, J, None, theirs.site(point).id)
            A[2 * i], A[2 * i + 1] = J[2, order.joints], J[0, order.joints]
        pinocchio.crba(model, work, q, pinocchio.Convention.WORLD)
        J = work.J.copy()
        place(w, q, v)
        mass_and_bias(w)
        scale = np.abs(M).max()
        np.testing.assert_allclose(np.triu(work.M), np.triu(M), rtol=0, atol=1e-12 * scale)
        np.testing.assert_allclose(np.triu(w["system"]["M"]), np.triu(M), rtol=0, atol=1e-12 * scale)
        np.testing.assert_allclose(
            pinocchio.nonLinearEffects(model, work, q, v), h, rtol=0, atol=1e-12 * np.abs(h).max()
        )
        np.testing.assert_allclose(w["system"]["h"], h, rtol=0, atol=1e-12 * np.abs(h).max())
        pinocchio.updateFramePlacements(model, work)
        w["contact"]["held"] = 0
        for i, point in enumerate(robot.points):
            x, _, z = work.oMf[model.getFrameId(point)].translation
            leg = [0, 1, 2, *range(3 + 3 * (i // 2), 6 + 3 * (i // 2))]
            rows = np.zeros((2, NQ))
            rows[0, leg] = J[2, leg] - J[4, leg] * x
            rows[1, leg] = J[0, leg] + J[4, leg] * z
            np.testing.assert_allclose(rows, A[2 * i : 2 * i + 2], rtol=0, atol=1e-12)
            w["contact"]["active"] = np.eye(N_CONSTRAINTS, dtype=np.uint8)[i]
            assert active_rows(w) == 2
            np.testing.assert_allclose(w["system"]["A"][:2], A[2 * i : 2 * i + 2], rtol=0, atol=1e-12)


def test_both_libraries_read_the_same_tree(toy):
    mine, robot = tree_at(toy), description_at(toy)
    for name, theirs in pinocchio_tree(believed_model(toy, 0.0), robot)._asdict().items():
        np.testing.assert_allclose(theirs, getattr(mine, name), rtol=0, atol=1e-14, err_msg=name)
    # In the file the right leg comes second; here it is the first.
    assert mine.mass.tolist() == [11.0, 2.2, 1.1, 0.4, 2.0, 1.1, 0.4]
    assert mine.armature.tolist() == [0.003, 0.0, 0.0, 0.004, 0.0, 0.0]


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("mode", ["joint", "generalized"])
def test_the_toy_walks_a_few_ticks(toy, engine, mode):
    run = Plan(scenario(toy, f'start.v = [0.3, 0, 0, 0, 0, 0, 0, 0, 0]\nactuation.mode = "{mode}"')).run(0)
    t = ENGINES[engine](run)
    assert t.end == "completed"
    assert len(t) == 300
    assert t.q[-1, 0] > t.q[0, 0] + 0.01, "it moves forward"
    assert np.abs(t.applied[:, 3:]).max() > 1.0
    if mode == "joint":
        assert (t.active[:, :4].sum(axis=1) > 0).any()
        assert np.abs(t.u).max() <= 40.0, "its own torque limit, not the human's"
    weight = t.tree.mass.sum() * 9.81
    assert t.column("force")[..., 1].sum(axis=1).mean() == pytest.approx(weight, rel=0.35)
    assert measure(t, (0.1, 0.3))["energy_residual"] < 0.03


def test_logged_forces_are_all_of_mujocos_constraint_forces(toy):
    """Jᵀ(ground forces) + knee stops = qfrc_constraint, whatever order the file has its contacts and stops in."""
    s = scenario(toy, "start.v = [0.3, 0, 0, 0, 0, 0, 0, 0, 0]")
    t = foreign.simulate(Plan(s).run(0))
    model, order, *_ = compile_foreign(toy, s)
    data = mujoco.MjData(model)
    seen = np.zeros(N_CONSTRAINTS)
    for k in range(len(t)):
        data.qpos[order.joints], data.qvel[order.joints] = t.q[k], t.v[k]
        data.ctrl[order.actuators] = t.u[k]
        mujoco.mj_forward(model, data)
        total = np.zeros(NQ)
        total[[4, 7]] = t.stop[k]
        for i, point in enumerate(t.robot.points):
            J, middle = np.zeros((3, NQ)), data.site(point).xpos * [1.0, 1.0, 0.5]
            mujoco.mj_jac(model, data, J, None, middle, model.site(point).bodyid[0])
            total += J[0, order.joints] * t.column("force")[k, i, 0] + J[2, order.joints] * t.column("force")[k, i, 1]
        force = data.qfrc_constraint[order.joints]
        np.testing.assert_allclose(total, force, rtol=0, atol=2e-5 * max(1.0, np.abs(force).max()))
        seen += [*(t.column("force")[k, :, 1] > 0.0), *(t.stop[k] < 0.0)]
    assert (seen[[0, 1, 2, 4]] > 0).all(), "both feet have touched, and a knee its stop"


@pytest.mark.parametrize("engine", ENGINES)
def test_the_human_walks_the_same_in_any_order(tmp_path, engine):
    """The home engine bit by bit; MuJoCo to rounding, for its own sums follow the file's order."""
    plain = ENGINES[engine](Plan(Scenario(duration=0.3)).run(0))
    mixed = ENGINES[engine](Plan(scenario(shuffled_human(tmp_path))).run(0))
    for name in COLUMNS:
        mine, theirs = mixed.column(name), plain.column(name)
        if engine == "home":
            np.testing.assert_array_equal(mine, theirs, err_msg=name)
        else:
            np.testing.assert_allclose(mine[:20], theirs[:20], rtol=1e-7, atol=1e-7, err_msg=name)
    assert mixed.column("force")[..., 1].max() > 100.0


def test_a_user_law_is_told_in_canonical_order(toy, tmp_path):
    law = tmp_path / "law.py"
    law.write_text(
        "import numpy as np\n"
        "class Law:\n"
        "    def __init__(self, setup): self.model = setup.model\n"
        "    def torques(self, sensed):\n"
        "        assert list(self.model.names)[2:] == ['q_R1', 'q_R2', 'q_R3', 'q_L1', 'q_L2', 'q_L3']\n"
        "        return np.array([0.0, 0.0, 0.0, 0.0, -1.0, 0.0])\n",
        encoding="utf-8",
    )
    with trusting(everything=True):
        t = foreign.simulate(Plan(scenario(toy, f'law = "{law}:Law"')).run(0))
    np.testing.assert_array_equal(t.u, np.broadcast_to([0, 0, 0, 0, -1, 0], (len(t), 6)))
    assert posture_of(toy, "flat")[0][[3, 6]].tolist() == [0.22, -0.2]


def test_a_trajectory_says_what_walked(toy, tmp_path):
    t = foreign.simulate(Plan(scenario(toy, "push = [{ at = 0.1, duration = 0.05, force = [5, 0] }]")).run(0))
    assert t.pushes[0][4] == "trunk", "a torso whatever it is called"
    t.save(tmp_path / "run.npz")
    again = load(tmp_path / "run.npz")
    assert again.robot == t.robot == load_robot(toy, None)
    stepping = {"support": 1.0, "flight": 0.0, "alternation": 1.0}
    numbers = {
        speed: walked(measure(walking(t, speed), (0.1, 0.3)) | stepping, 0.3, t.robot.walked)
        for speed in (0.1, 0.2, 0.4)
    }
    assert numbers == {0.1: False, 0.2: True, 0.4: True}, "0.15 m/s is walking for it, 0.3 for a human"


def walking(t: Trajectory, speed: float) -> Trajectory:
    """The run as if it had moved along at a steady speed."""
    t.q[:, 0] = speed * t.time
    return t
