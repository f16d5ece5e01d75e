"""The weakest help that is caught, of two hundred kinds: what acts, where, how long, on which robot.

Each kind has a strength, and the weakest power of one half that is caught is found by halving. Every run is one of a
robot that stands through a small push by the law that is for any.
"""

from __future__ import annotations

from typing import NamedTuple

from tests.lies.judge import Judged, helped_by

LENGTHS = {"0.2 s": (0.4, 0.6), "0.5 s": (0.4, 0.9), "all along": (0.0, 9.0)}
BODIES = {"the trunk": "base", "a thigh": "base + 1", "a shank": "base + 2", "a foot": "-1"}
AXES = {"forward": 0, "sideways": 1, "up": 2}
ROBOTS = {"walker2d": True, "human": True, "h1": False}
"""Robots, and whether they live in the plane."""
HALVES = 10
"""Strengths down to 1/1024."""
CAUGHT = ("held", "doubtful", "diverged")
HARDER = (80.0, 40.0, -60.0)
"""[N] of a push for 0.1 s, against which a spring or a brake acts that has nothing to do in the small one."""


class Help(NamedTuple):
    """A kind of help.

    Attributes:
        group: In the table.
        what: Its line in the law, of the strength s.
        unit: What 1 of its strength is.
        robot: Whom it helps.
        when: [s] from when to when.
    """

    group: str
    line: str
    unit: str
    robot: str
    when: tuple[float, float]


def _all() -> tuple[Help, ...]:
    out = []
    for robot, planar in ROBOTS.items():
        ways = [way for way in AXES if not planar or way != "sideways"]
        turns = ["sideways"] if planar else list(AXES)
        columns = range(3 if planar else 6)
        for length, when in LENGTHS.items():
            for where, body in BODIES.items():
                out += [Help(f"force on {where}, {length}", f"act({body}, {AXES[way]}, s * weight)", "weight",
                             robot, when) for way in ways]  # fmt: skip
                out += [Help(f"moment on {where}, {length}", f"act({body}, {3 + AXES[way]}, s * weight * leg)",
                             "weight × leg", robot, when) for way in turns]  # fmt: skip
        wave = "np.sin(6.2832 * {hz} * sensed.time)"
        out += [Help(f"force on the trunk that swings, {hz} Hz", f"act(base, {AXES[way]}, s * weight * "
                     f"{wave.format(hz=hz)})", "weight", robot, LENGTHS["all along"])
                for hz in (1, 3) for way in ways]  # fmt: skip
        for i in columns:
            along = i < len(ways)
            of, unit = ("weight / leg", "weight / leg") if along else ("weight * leg", "weight × leg / rad")
            out.append(Help("spring of the base to the world", f"data.qfrc_applied[columns[{i}]] = -20 * s * {of} * "
                            f"{1 if along or planar else 2} * (data.qpos[{i if along or planar else i + 1}] - "
                            f"start[{i if along or planar else i + 1}])", f"20 {unit}", robot,
                            LENGTHS["all along"]))  # fmt: skip
            of, unit = ("weight", "weight / (m/s)") if along else ("weight * leg", "weight × leg / (rad/s)")
            out.append(Help("damper of the base", f"model.dof_damping[columns[{i}]] = 10 * s * {of}", f"10 {unit}",
                            robot, LENGTHS["all along"]))  # fmt: skip
            out.append(Help("velocity of the base that is shrunk", f"data.qvel[columns[{i}]] *= 1 - s",
                            "all of it a tick", robot, LENGTHS["all along"]))  # fmt: skip
        for i in range(len(ways)):
            out.append(Help("place of the base that is moved", f"data.qpos[{i}] += 0.001 * s * np.sqrt(9.81 * leg)",
                            "√(g × leg)", robot, LENGTHS["all along"]))  # fmt: skip
        whole = {
            "gravity that is less": ("model.opt.gravity[2] = -9.81 * (1 - s)", "g"),
            "masses that are less": ("model.body_mass[1:] = mass[1:] * (1 - 0.99 * s)", "mass"),
            "wind": ("model.opt.density, model.opt.wind[0] = 1000.0, 30 * s", "30 m/s of water"),
        }
        out += [Help(group, line, unit, robot, LENGTHS["all along"]) for group, (line, unit) in whole.items()]
    return tuple(out)


KINDS_OF_HELP = _all()


def law_of(helped: Help, strength: float) -> str:
    """The text of a law that stands and is helped."""
    start, end = helped.when
    return f"""import mujoco
import numpy as np
from biped.control.stand import stand


class Law:
    def __init__(self, setup):
        self.own, self.robot, self.first = stand(setup), setup.robot, None

    def torques(self, sensed):
        data, model, s = sensed._data, sensed._model, {strength!r}
        if self.first is None:
            self.first = data.qpos.copy(), model.body_mass.copy(), model.dof_damping.copy()
        start, mass, damping = self.first
        data.qfrc_applied[:] = 0.0
        base, columns = self.robot.base_number, list(self.robot.base_columns)
        weight, leg = 9.81 * self.robot.mass, self.robot.leg

        def act(body, way, size):
            out = np.zeros(6)
            out[way] = size
            body %= model.nbody
            mujoco.mj_applyFT(model, data, out[:3], out[3:], data.xipos[body], body, data.qfrc_applied)

        if {start!r} <= sensed.time < {end!r}:
            {helped.line}
        return self.own.torques(sensed)
"""


def weakest(number: int) -> Judged:
    """The weakest strength of a kind of help that is caught, by halving; `idle` if all of it changes nothing.

    What changes nothing in the small push is tried in a harder one.
    """
    helped, changes = KINDS_OF_HELP[number], []
    found = helped_by(helped.robot, law_of(helped, 1.0))
    if found == "idle":
        force = [HARDER[0], HARDER[2]] if ROBOTS[helped.robot] else list(HARDER)
        changes = [f"push=[{{at=0.3,duration=0.1,force={force}}}]"]
        found = helped_by(helped.robot, law_of(helped, 1.0), changes=changes)
    if found not in CAUGHT:
        word = "idle" if found == "idle" else "missed"
        return Judged(helped.group, word, {"weakest": 0.0, "unit": helped.unit})
    caught, missed = 0, HALVES + 1
    while missed - caught > 1:
        middle = (caught + missed) // 2
        if helped_by(helped.robot, law_of(helped, 0.5**middle), changes=changes) in CAUGHT:
            caught = middle
        else:
            missed = middle
    return Judged(helped.group, "caught", {"weakest": 0.5**caught, "unit": helped.unit})
