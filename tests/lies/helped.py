"""Robots that something helps: a random part of a model file, or a random force in a law, anywhere in the tree."""

from __future__ import annotations

import random
from collections.abc import Callable
from pathlib import Path
from xml.etree import ElementTree

XML = ElementTree.Element
MODELS = Path(__file__).parents[2] / "models"
TORSO = 1
"""Number of the base's body."""


def _size(r: random.Random, low: float, high: float) -> float:
    return float(f"{low * (high / low) ** r.random():.4g}")


def _numbers(*values: float) -> str:
    return " ".join(f"{value:.6g}" for value in values)


def _somewhere(r: random.Random, root: XML) -> XML:
    """A body of the robot."""
    return r.choice([body for body in root.iter("body") if body.get("name")])


def _on_base(root: XML) -> list[XML]:
    """The joints that carry the base."""
    world = root.find("worldbody")
    assert world is not None
    return [joint for body in world.findall("body") for joint in body if joint.tag in ("joint", "freejoint")]


def _section(root: XML, name: str) -> XML:
    found = root.find(name)
    return ElementTree.SubElement(root, name) if found is None else found


def _of_joint(r: random.Random, root: XML) -> str:
    joint = r.choice(_on_base(root))
    if joint.tag == "freejoint" or joint.get("type") == "free":  # of which all that follows is left out
        return _fastened(r, root)
    what = r.choice(("damping", "armature", "frictionloss", "stiffness", "range"))
    if what == "range":
        joint.attrib |= {"limited": "true", "range": _numbers(-_size(r, 1e-3, 0.1), _size(r, 1e-3, 0.1))}
    else:
        joint.set(what, _numbers(_size(r, 50.0, 1e4)))
    return "joints of the base"


def _motor(r: random.Random, root: XML) -> str:
    joints = [joint for joint in _on_base(root) if joint.get("type") != "free" and joint.tag == "joint"]
    if not joints:
        return _thruster(r, root)
    joint = r.choice(joints)
    ElementTree.SubElement(_section(root, "actuator"), r.choice(("motor", "position", "velocity")),
                           {"name": "lie", "joint": str(joint.get("name"))})  # fmt: skip
    return "motors of the base"


def _thruster(r: random.Random, root: XML) -> str:
    body = _somewhere(r, root)
    ElementTree.SubElement(body, "site", {"name": "lie"})
    gear = _numbers(*(r.uniform(-1, 1) for _ in range(6)))
    ElementTree.SubElement(_section(root, "actuator"), "motor", {"name": "lie", "site": "lie", "gear": gear})
    return "thrusters"


def _fastened(r: random.Random, root: XML) -> str:
    body, kind = _somewhere(r, root), r.choice(("weld", "connect"))
    more = {"anchor": _numbers(*(r.uniform(-0.2, 0.2) for _ in range(3)))} if kind == "connect" else {}
    soft = _numbers(_size(r, 0.005, 0.3), 1.0)
    ElementTree.SubElement(_section(root, "equality"), kind, {"body1": str(body.get("name")), "solref": soft, **more})
    return "welds and connects"


def _rail(r: random.Random, root: XML) -> str:
    joints = [joint for joint in _on_base(root) if joint.tag == "joint" and joint.get("type") != "free"]
    if not joints:
        return _fastened(r, root)
    joint = r.choice(joints)
    ElementTree.SubElement(_section(root, "equality"), "joint", {"joint1": str(joint.get("name"))})
    return "equalities of the base"


def _rope(r: random.Random, root: XML) -> str:
    joints = [joint for joint in _on_base(root) if joint.tag == "joint" and joint.get("type") != "free"]
    tendon, what = _section(root, "tendon"), r.choice(("stiffness", "damping"))
    size = {what: _numbers(_size(r, 100.0, 1e4))}
    if joints and r.random() < 0.5:
        joint = r.choice(joints)
        fixed = ElementTree.SubElement(tendon, "fixed", size)
        ElementTree.SubElement(fixed, "joint", {"joint": str(joint.get("name")), "coef": "1"})
        return "tendons over the base"
    body, world = _somewhere(r, root), root.find("worldbody")
    assert world is not None
    ElementTree.SubElement(world, "site", {"name": "hook", "pos": _numbers(r.uniform(-1, 1), 0.0, r.uniform(2, 4))})
    ElementTree.SubElement(body, "site", {"name": "tied"})
    spatial = ElementTree.SubElement(tendon, "spatial", size | {"springlength": "0.5"})
    for site in ("hook", "tied"):
        ElementTree.SubElement(spatial, "site", {"site": site})
    return "ropes to the world"


def _air(r: random.Random, root: XML) -> str:
    option = ElementTree.SubElement(root, "option")
    what = r.choice(("wind", "density", "viscosity"))
    option.set("density", _numbers(_size(r, 100.0, 3000.0)))
    if what == "viscosity":
        option.set("viscosity", _numbers(_size(r, 1.0, 100.0)))
    elif what == "wind":
        option.set("wind", _numbers(r.uniform(-8, 8), 0.0, r.uniform(-2, 8)))
    return "air"


def _weightless(r: random.Random, root: XML) -> str:
    if r.random() < 0.2:
        ElementTree.SubElement(ElementTree.SubElement(root, "option"), "flag", {"gravity": "disable"})
        return "weightlessness"
    bodies = [body for body in root.iter("body") if body.get("name")]
    for body in r.sample(bodies, r.randint(1, len(bodies))):
        body.set("gravcomp", _numbers(_size(r, 0.3, 1.2)))
    return "weightlessness"


def _obstacle(r: random.Random, root: XML) -> str:
    """A rail, a wall or a seat that the robot may lean on, which is no ground."""
    world = root.find("worldbody")
    assert world is not None
    size = _numbers(*(r.uniform(0.02, 0.4) for _ in range(3)))
    place = _numbers(r.uniform(-0.5, 0.5), r.uniform(-0.3, 0.3), r.uniform(0.3, 1.5))
    ElementTree.SubElement(world, "geom", {"type": "box", "size": size, "pos": place})
    return "obstacles"


def _mover(r: random.Random, root: XML) -> str:
    """A body beside the robot that moves by itself, and is welded to it or pushes it."""
    world, body = root.find("worldbody"), _somewhere(r, root)
    assert world is not None
    mover = ElementTree.SubElement(world, "body", {"name": "lie", "pos": _numbers(r.uniform(-0.5, 0.5), 0.0, 1.0)})
    if r.random() < 0.3:
        mover.set("mocap", "true")
    else:
        ElementTree.SubElement(mover, "joint", {"name": "lie", "type": r.choice(("slide", "hinge")), "axis": "0 1 1"})
    ElementTree.SubElement(mover, "geom", {"size": _numbers(r.uniform(0.05, 0.3)), "mass": "5"})
    if mover.get("mocap") or r.random() < 0.5:
        ends = {"body1": "lie", "body2": str(body.get("name"))}
        ElementTree.SubElement(_section(root, "equality"), r.choice(("weld", "connect")), ends | {"anchor": "0 0 0"})
    return "bodies that move"


def _sticky(r: random.Random, root: XML) -> str:
    name = str(_somewhere(r, root).get("name"))
    gain = {"name": "lie", "body": name, "ctrlrange": "0 1", "gain": _numbers(_size(r, 100.0, 3000.0))}
    ElementTree.SubElement(_section(root, "actuator"), "adhesion", gain)
    return "adhesion"


def _sites(r: random.Random, root: XML) -> str:
    """A weld or a connection between sites, one of them of the world."""
    body, world, kind = _somewhere(r, root), root.find("worldbody"), r.choice(("weld", "connect"))
    assert world is not None
    ElementTree.SubElement(world, "site", {"name": "hook", "pos": _numbers(0.0, 0.0, r.uniform(0.0, 2.0))})
    ElementTree.SubElement(body, "site", {"name": "tied"})
    ElementTree.SubElement(_section(root, "equality"), kind, {"site1": "hook", "site2": "tied"})
    return "welds and connects"


def _coupling(r: random.Random, root: XML) -> str:
    """A joint of the base that is geared to one of the robot's own."""
    ours = [joint for joint in _on_base(root) if joint.tag == "joint" and joint.get("type") != "free"]
    joints = [str(joint.get("name")) for joint in root.iter("joint") if joint.get("name") and joint not in ours]
    if not ours or not joints:
        return _sites(r, root)
    ratio = _numbers(0.0, r.choice((-1, 1)) * _size(r, 0.05, 1.0), 0.0, 0.0, 0.0)
    ends = {"joint1": str(r.choice(ours).get("name")), "joint2": r.choice(joints), "polycoef": ratio}
    ElementTree.SubElement(_section(root, "equality"), "joint", ends)
    return "equalities of the base"


def _cord(r: random.Random, root: XML) -> str:
    """A tendon of one length between a body and the world."""
    _rope(r, root)
    tendon = _section(root, "tendon")[-1]
    tendon.set("name", "lie")
    ElementTree.SubElement(_section(root, "equality"), "tendon", {"tendon1": "lie"})
    return "tendons of one length"


def _crank(r: random.Random, root: XML) -> str:
    """A slider and crank between a body and the world."""
    body, world = _somewhere(r, root), root.find("worldbody")
    assert world is not None
    ElementTree.SubElement(world, "site", {"name": "hook", "pos": _numbers(r.uniform(-1, 1), 0.0, 1.0)})
    ElementTree.SubElement(body, "site", {"name": "tied"})
    kind = {"cranksite": "tied", "slidersite": "hook", "cranklength": _numbers(r.uniform(0.3, 2.0))}
    if r.random() < 0.4:
        kind = {"site": "tied", "refsite": "hook", "gear": _numbers(*(r.uniform(-1, 1) for _ in range(6)))}
    ElementTree.SubElement(_section(root, "actuator"), "motor", {"name": "lie", **kind})
    return "thrusters"


PARTS: tuple[Callable[[random.Random, XML], str], ...] = (
    _of_joint, _motor, _thruster, _fastened, _rail, _rope, _air, _weightless, _obstacle, _mover, _sticky, _sites,
    _coupling, _cord, _crank,
)  # fmt: skip


def helped_model(number: int, model: str) -> tuple[str, str]:
    """A model file with one part more that holds or drives the robot from outside, and what that is."""
    r = random.Random(f"part {number}")
    root = ElementTree.fromstring((MODELS / f"{model}.xml").read_text(encoding="utf-8"))
    what = r.choice(PARTS)(r, root)
    return ElementTree.tostring(root, encoding="unicode"), what


LAWS = {
    "forces on a body": "act(body, on * share * weight * way, 0 * way)",
    "moments on a body": "act(body, 0 * way, on * share * weight * leg * way)",
    "a moment on the base": "data.qfrc_applied[columns[-1]] = on * share * weight * leg",
    "forces on the base": "data.qfrc_applied[columns] = on * share * weight * some",
    "velocities of the base": "data.qvel[columns] += on * 0.01 * share * some",
    "places of the base": "data.qpos[:3] += on * 0.002 * share * np.sign(some[:3])",
    "gravity": "model.opt.gravity[2] = -9.81 * (1.0 - on * share)",
    "masses": "model.body_mass[1:] = self.mass * (1.0 - 0.9 * on * share)",
    "dampers of the base": "model.dof_damping[columns] = on * 20.0 * share * weight",
    "wind": "model.opt.density, model.opt.wind[:] = on * 3000.0 * share, 10.0 * way",
}
"""Lines of a law that help its robot, by what they are; `on` is 1 while they do, `share` up to 1."""


def helping_law(number: int) -> tuple[str, str]:
    """The text of a law that stands, and meanwhile has a random force act on its robot, and what that is.

    It gets hold of MuJoCo's state behind what it is given, as nothing in Python can forbid.
    """
    r = random.Random(f"law {number}")
    share, start = _size(r, 0.02, 1.0), r.uniform(0.0, 0.4)
    length, body = r.uniform(0.3, 1.0), r.random()
    way = [r.gauss(0.0, 1.0) for _ in range(3)]
    what = r.choice(tuple(LAWS))
    text = f"""import mujoco
import numpy as np
from biped.control.stand import stand


class Law:
    def __init__(self, setup):
        self.own, self.robot = stand(setup), setup.robot
        self.mass = None
        self.way = np.array({way!r}) / np.linalg.norm({way!r})

    def torques(self, sensed):
        data, model, share, way = sensed._data, sensed._model, {share!r}, self.way
        on = float({start!r} <= sensed.time < {start + length!r})
        body = self.robot.base_number + int({body!r} * (model.nbody - self.robot.base_number))
        columns = list(self.robot.base_columns)
        weight, leg = 9.81 * self.robot.mass, self.robot.leg
        some = np.resize(way, len(columns))
        self.mass = model.body_mass[1:].copy() if self.mass is None else self.mass
        data.qfrc_applied[:] = 0.0

        def act(body, force, moment):
            mujoco.mj_applyFT(model, data, force, moment, data.xipos[body], body, data.qfrc_applied)

        {LAWS[what]}
        return self.own.torques(sensed)
"""
    return text, what
