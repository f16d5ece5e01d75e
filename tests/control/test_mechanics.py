"""`control.mechanics`: whoever computes them, the law's matrices are those of the model file at the sensed state."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, NamedTuple

import mujoco
import numpy as np
import pytest

from biped.base.errors import InputError
from biped.control.planar.controller import ThesisLaw
from biped.control.space.law import Spatial
from biped.control.space.own import Pinocchio, compute, own_of
from biped.control.space.places import Mechanics
from biped.control.space.record import LEG, LEGS
from biped.ensemble.campaign import simulate
from biped.robot.columns import WIDTH
from biped.robot.planar.order import order_of
from biped.robot.spec import read
from biped.robot.tree import tree_of
from biped.scenario.reading import read_scenario
from biped.studies.run import plan_of
from tests.control.space.scene import Referee, Scene, states

ALONE = ("window={start=0.01, end=0.02}", "expect={}", "sweep={}", "randomise={}", "push=[]")
PUSHING = ("actuation.mode=joint", "actuation.contacts=pushing")


class Shipped(NamedTuple):
    """A shipped robot that the thesis's law walks: its scenario, changes to it, and one that makes it another robot."""

    scenario: str
    changes: tuple[str, ...]
    wrong: str

    @property
    def sources(self) -> tuple[str, ...]:
        return ("compiled", "pinocchio") if self.planar else ("compiled", "pinocchio", "engine")

    @property
    def planar(self) -> bool:
        return self.scenario in ("calm/own", "robot/motors")

    def run(self, *changes: str):
        return plan_of(self.scenario, [*ALONE, *self.changes, *changes]).run(0)


SEVEN = "truth={mass=[1.2, 0.8, 1.3, 1.0, 1.1, 1.0, 1.5], inertia=[1.5, 1, 1, 1, 1, 1, 1], joint_damping=0.5}"
ROBOTS = {
    "human": Shipped("calm/own", (), SEVEN),
    "robot": Shipped("robot/motors", PUSHING, SEVEN),
    "human3d": Shipped("spatial/own", (), "truth={part=[{name='torso', mass=1.3, shift=[0.05, 0.02, 0.0]}], "
                                          "armature=0.05, joint_damping=0.5, joint_friction=0.5}"),
    "h1": Shipped("any/h1_walk", PUSHING, "truth={part=[{name='torso', mass=1.3, inertia=2.0}], armature=0.05}"),
    "h1, stiff arms": Shipped(
        "any/h1_walk", (*PUSHING, "robot.rigid=['left_elbow', 'right_elbow', 'torso']"),
        "truth={part=[{name='left_shank', mass=1.5}], joint_damping=1.0}",
    ),
}  # fmt: skip
EVERY = [(name, source) for name, robot in ROBOTS.items() for source in robot.sources]
CROOKED = """
<mujoco>
  <compiler angle="radian"/>
  <option gravity="1.5 -0.7 -9.5"/>
  <worldbody>
    <body name="base" pos="0.3 -0.2 1" euler="0.1 0.2 0.3">
      <freejoint/>
      <inertial pos="0.02 -0.03 0.1" mass="7" fullinertia="0.3 0.25 0.2 0.02 -0.03 0.01"/>
      <body name="welded" pos="0.1 0.05 -0.1" euler="0.4 -0.3 0.2">
        <inertial pos="0.01 0.02 0.03" mass="1.5" diaginertia="0.02 0.03 0.01"/>
        <body name="three" pos="0 0.1 -0.2" euler="-0.2 0.1 0.5">
          <joint type="hinge" axis="1 1 0" pos="0.05 0 0.02" ref="0.3" armature="0.1"/>
          <joint type="slide" axis="0 1 1" ref="-0.1" damping="2"/>
          <joint type="hinge" axis="0.2 0 1" pos="-0.01 0.03 0" stiffness="5"/>
          <inertial pos="0 0 -0.2" euler="0.3 0.2 0.1" mass="2" diaginertia="0.05 0.04 0.02"/>
          <body name="tip" pos="0 0 -0.4">
            <joint type="hinge" axis="0 1 0" armature="0.02"/>
            <inertial pos="0.05 0 -0.1" mass="0.5" diaginertia="0.002 0.003 0.001"/>
          </body>
        </body>
      </body>
      <body name="other" pos="0 -0.1 -0.2">
        <joint type="hinge" axis="1 0 0"/>
        <inertial pos="0 0 -0.3" mass="3" diaginertia="0.05 0.05 0.01"/>
      </body>
    </body>
  </worldbody>
</mujoco>
"""


def states_of(robot: Shipped) -> list[tuple[np.ndarray, np.ndarray]]:
    """States of its walk, a few milliseconds apart."""
    t = simulate(robot.run("duration=0.5"))
    return [(t.q[k], t.v[k]) for k in range(0, len(t), 25)]


def torques_at(robot: Shipped, source: str, there: list[tuple[np.ndarray, np.ndarray]]) -> np.ndarray:
    """What a law commands in states, one after another, as if they were ticks of a run."""
    run = robot.run(f"control.mechanics={source}")
    if robot.planar:
        q, v = np.zeros(9), np.zeros(9)
        law = ThesisLaw(run, run.tree, q, v, np.zeros((len(there), WIDTH)))
        tick, out = law.tick, []
        for k, (q[:], v[:]) in enumerate(there):
            tick(k, k * run.tick)
            out.append(law.u.copy())
        return np.array(out)
    from biped.engines.plant import MujocoPlant

    plant, out = MujocoPlant(run), []
    for k, (q, v) in enumerate(there):
        plant.data.qpos[:], plant.data.qvel[:] = q, v
        mujoco.mj_step1(plant.model, plant.data)
        plant.observation.begin(k * run.tick)
        out.append(plant.law.command(k, plant.observation).copy())
    return np.array(out)


@pytest.mark.parametrize("robot", ROBOTS.values(), ids=ROBOTS)
def test_the_torques_are_the_same_whoever_computes(robot):
    there = states_of(robot)
    first, *others = (torques_at(robot, source, there) for source in robot.sources)
    assert np.abs(first).max() > 1.0
    for other in others:
        assert not np.array_equal(first, other), "both came from one place"
        assert np.abs(other - first).max() < 1e-9 * np.abs(first).max()


def test_the_walk_is_the_same_whoever_computes():
    """Of the walk that amplifies differences least: those of others grow from 1e-13 as any difference does."""
    robot = ROBOTS["human3d"]
    walks = [simulate(robot.run("duration=0.5", f"control.mechanics={source}")) for source in robot.sources]
    for walk in walks[1:]:
        assert np.abs(walk.q - walks[0].q).max() < 1e-9
        assert np.abs(walk.u - walks[0].u).max() < 1e-6


def test_the_compiled_loop_asks_its_own_kernels_as_the_one_in_python_does():
    from biped.engines.mujoco import loop_of
    from biped.engines.mujoco import simulate as in_mujoco

    run = ROBOTS["human3d"].run("duration=0.4", "control.mechanics=compiled")
    assert loop_of(run) == "compiled"
    fast, slow = in_mujoco(run), in_mujoco(run, watch=lambda model, data, forces: None)
    assert np.abs(fast.u - slow.u).max() < 1e-6 * np.abs(slow.u).max()
    other = ROBOTS["human3d"].run("duration=0.4", "control.mechanics=engine")
    assert not np.array_equal(in_mujoco(other).u, fast.u), "the kernels were not asked"


def test_kernels_compute_by_default_but_where_only_mujoco_can(tmp_path):
    run = ROBOTS["h1"].run("duration=0.02")
    asked = (
        run,
        *(ROBOTS["h1"].run("duration=0.02", f"control.mechanics={source}") for source in ("compiled", "engine")),
    )
    default, compiled, engine = (simulate(one).u for one in asked)
    assert np.array_equal(default, compiled)
    assert not np.array_equal(default, engine)

    tendon = '<tendon><fixed name="cord" armature="0.1"><joint joint="left_elbow" coef="1"/></fixed></tendon>'
    file = tmp_path / "h1_with_a_cord.xml"
    file.write_text(Path("models/h1.xml").read_text(encoding="utf-8").replace("</mujoco>", f"{tendon}</mujoco>"))
    model = f"model={json.dumps(str(file))}"
    default, engine = (
        simulate(ROBOTS["h1"].run("duration=0.02", model, *keys)).u for keys in ((), ("control.mechanics=engine",))
    )
    assert np.array_equal(default, engine)
    with pytest.raises(InputError, match="expected 'engine': the model has tendons with an inertia"):
        simulate(ROBOTS["h1"].run("duration=0.02", model, "control.mechanics=compiled"))


class Noted:
    """What laws computed with in runs of a test: sensed coordinates and M, tick by tick; in the plane, of the last."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch):
        self.q, self.M, self.laws = [], [], []
        asked, made = Spatial.torques, ThesisLaw.__init__

        def torques(law: Any, sensed: Any) -> np.ndarray:
            out = asked(law, sensed)
            self.q.append(sensed.q.copy())
            self.M.append(_whole(law.record[0]))
            return out

        def make(law: Any, run: Any, believed: Any, q: np.ndarray, *more: Any) -> None:
            made(law, run, believed, q, *more)
            self.laws.append((law, q))

        monkeypatch.setattr(Spatial, "torques", torques)
        monkeypatch.setattr(ThesisLaw, "__init__", make)

    def seen(self) -> list[tuple[np.ndarray, np.ndarray]]:
        """(q, M) of both kinds of robot."""
        for law, q in self.laws:
            M = np.triu(law.record[0]["work"]["M"])
            self.q.append(q.copy())
            self.M.append(M + np.triu(M, 1).T)
        return list(zip(self.q, self.M, strict=True))


def _whole(c: Any) -> np.ndarray:
    """M of a spatial law's record, in the model's order."""
    column, at = c["belief"]["column"], c["at"]
    upper, reach = at["M_base"].shape[0], at["M_cross"].shape[2]
    M = np.zeros((len(column), len(column)))
    M[:upper, :upper] = at["M_base"]
    for leg in range(LEGS):
        mine = slice(upper + LEG * leg, upper + LEG * (leg + 1))
        M[mine, mine], M[mine, upper - reach : upper] = at["M_leg"][leg], at["M_cross"][leg]
        M[upper - reach : upper, mine] = at["M_cross"][leg].T
    there = np.flatnonzero(column >= 0)
    out = np.empty((len(there), len(there)))
    out[np.ix_(column[there], column[there])] = M[np.ix_(there, there)]
    return out


def of_the_file(run: Any, q: np.ndarray) -> np.ndarray:
    """M by MuJoCo of the model file alone, which nothing of the run has touched."""
    if run.scenario.robot is None:
        model = mujoco.MjModel.from_xml_path(str(run.model))
        joints = order_of(model, run.robot.seven_links).joints
    else:
        model, joints = read(run.model, run.scenario.robot).compile(), None
    data, M = mujoco.MjData(model), np.empty((model.nv, model.nv))
    if joints is None:
        data.qpos[:] = q
    else:
        data.qpos[joints] = q
    mujoco.mj_forward(model, data)
    mujoco.mj_fullM(model, data, M)
    return M if joints is None else M[np.ix_(joints, joints)]


@pytest.mark.parametrize(("name", "source"), EVERY)
def test_what_the_law_believes_is_the_file_at_what_it_senses(name, source, monkeypatch):
    """Another robot walks, and sensors are noisy and late: no number of either is in the law's mass matrix.

    In space the loop in Python is watched, whose every bit is that of the compiled one (tests/engines/test_walking.py).
    """
    from biped.engines.mujoco import simulate as in_mujoco

    robot, noted = ROBOTS[name], Noted(monkeypatch)
    sensors = "sensors={angle_noise=0.01, rate_noise=0.1, delay=0.01}"
    run = robot.run("duration=0.06", robot.wrong, sensors, f"control.mechanics={source}")
    t = simulate(run) if robot.planar else in_mujoco(run, watch=lambda model, data, forces: None)
    seen = noted.seen()
    assert len(seen) == (1 if robot.planar else len(t))
    for q, M in seen:
        assert np.abs(M - of_the_file(run, q)).max() < 1e-12 * M.max()
    q, M = seen[-1]
    assert np.abs(q - t.q[-1]).max() > 1e-3, "sensed as it is: the test would not see whose state M is of"
    assert np.abs(M - of_the_file(run, t.q[-1])).max() > 1e-5 * M.max()
    straight = robot.run("duration=0.06", sensors, f"control.mechanics={source}")
    assert not np.array_equal(simulate(straight).v[-1], t.v[-1]), "the same robot walks: the test would not see whose M"


def test_a_crooked_tree_is_mujocos():
    """Joints beside their bodies' origins, turned zeros, a slide, welded bodies, rotors; gravity aslant."""
    model = mujoco.MjModel.from_xml_string(CROOKED)
    tree, data = tree_of(model), mujoco.MjData(model)
    random, nv = np.random.default_rng(3), model.nv

    b = model.nbody
    m = Mechanics(data.qpos, data.qvel, np.zeros(model.nC), np.zeros(0, np.int64), np.zeros(nv), *(
        np.zeros(s) for s in ((nv, 6), (nv, 6), (b, 6), (b, 3), (b, 9), (b, 3))))  # fmt: skip
    m.turned[0, [0, 4, 8]] = 1.0
    for _ in range(5):
        mujoco.mj_integratePos(model, data.qpos, random.normal(size=nv), 1.0)
        data.qvel[:] = random.normal(size=nv)
        mujoco.mj_forward(model, data)
        compute(tree, m)
        theirs = data.M, data.qfrc_bias, data.cdof, data.cdof_dot, data.cvel, data.xmat, data.xpos
        for own, other in zip((m.M, m.h, m.axes, m.axes_rate, m.twist, m.turned, m.origin), theirs, strict=True):
            assert np.abs(own - other).max() < 1e-12 * np.abs(other).max()
        assert np.abs(m.com[1] - data.subtree_com[1]).max() < 1e-12


def test_the_human_in_space_is_the_one_that_pinocchio_reads_by_itself():
    """Pinocchio's own reader of the file, without MuJoCo."""
    scene = Scene()
    for q, v in states(scene, 3, 5):
        referee = Referee(q, v)
        for made in (own_of(scene.c, scene.model, q, v), Pinocchio(scene.c, scene.model, q, v)):
            if isinstance(made, Pinocchio):
                made.renew()
            else:
                compute(*made)
            h, M = made.mechanics.h, np.zeros((18, 18))
            rows = scene.model
            for i in range(18):
                row = slice(rows.M_rowadr[i], rows.M_rowadr[i] + rows.M_rownnz[i])
                M[i, rows.M_colind[row]] = made.mechanics.M[row]
            M = M + np.tril(M, -1).T
            assert np.abs(h - referee.h).max() < 1e-12 * np.abs(referee.h).max()
            assert np.abs(M - referee.M).max() < 1e-12 * referee.M.max()


@pytest.mark.parametrize(("scenario", "changes", "words"), [
    ("spatial/own", ["control.mechanics=pinochio"],
     r"control.mechanics: expected one of compiled, pinocchio, engine, got 'pinochio'; did you mean 'pinocchio'"),
    ("level_normal", ["control.mechanic=pinocchio"], r"control.mechanic: unknown key; did you mean 'mechanics'"),
    ("level_normal", ["control.mechanics=engine"], r"control.mechanics: expected 'compiled' or 'pinocchio'"),
    ("any/h1", ["control.mechanics=pinocchio"], r"control.mechanics: expected none: law 'stand' takes no notice of it"),
])  # fmt: skip
def test_what_no_law_reads_is_refused(scenario, changes, words):
    with pytest.raises(InputError, match=words):
        read_scenario(scenario, changes)
